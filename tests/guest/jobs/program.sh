# The program on a USB camera that shows the synthetic room: it must track it, without a heap call after boot, and go on
# when somebody has pulled the plug and put it back.
. "$root/tests/guest/jobs/common.sh"

tactus=$build/firmware_host/tactus
out=$results/session
frames=24 pulled_after=12

# number KEY: of the session's summary, which has a line for each value; the first of that name.
number() { sed -n "s/^ *\"$1\": \([-0-9.e+]*\),*$/\1/p" "$out/summary.json" | head -n 1; }

fail() {
  echo "FAILED: $1"
  exit 1
}

# Two frames a second: an emulated processor keeps up, and while it once does not the driver has buffers for two seconds.
start_camera 2 --rates 2 --log "$results/shown"

# On a terminal the program says how far it is. Voxels of 2 cm make integration a sixth of the work, and the path is the
# same within 0.1 mm.
command="$tactus run 'v4l2:${nodes[0]}?color=${nodes[1]}&calibration=$results/room/calibration.toml' --runner lockstep \
  --model none --profile headset --set map.voxel_size_m=0.02 --set map.truncation_m=0.06 --frames 0:$frames --out $out"
script -qefc "$command" "$results/screen" >/dev/null &
session=$!
done_count=0
while [ "${done_count:-0}" -lt "$pulled_after" ] && kill -0 "$session" 2>/dev/null; do
  sleep 0.2
  done_count=$(grep -aoE 'lockstep [0-9]+' "$results/screen" | tail -n 1 | cut -d ' ' -f 2)
done
kill -USR1 "$camera"
sleep 2
kill -USR2 "$camera"
wait "$session"
code=$?
tr '\r' '\n' <"$results/screen" | grep -aE 'tracked|tactus:' || true
[ "$code" = 0 ] || fail "exit code $code"

# The true pose of each tracked frame is that of the frame which the camera showed at that time, half a second from the next.
awk 'FILENAME == ARGV[1] {pose[poses_count++] = $0; next}
     FILENAME == ARGV[2] {frame[shown_count] = $1; time[shown_count++] = $2; next}
     /^#/ {next}
     {
       nearest = 0
       for (i in time) if (($1 - time[i]) ^ 2 < ($1 - time[nearest]) ^ 2) nearest = i
       print $1, pose[frame[nearest] % poses_count]
     }' "$results/room/poses.txt" "$results/shown" "$out/trajectory.txt" >"$results/truth"
"$tactus" eval trajectory "$out/trajectory.txt" "$results/truth" | tee "$results/ate"
echo "tracked $(number frames_tracked), lost $(number frames_lost), missing $(number frames_missing), plug pulled" \
  "$(number losses) times; $(number wall_s) s"
[ "$(number losses)" -ge 1 ] || fail "the pulled plug is not in the summary"
[ "$(number frames_lost)" = 0 ] || fail "tracking was lost"
[ "$(number frames_tracked)" = "$frames" ] || fail "not every frame was tracked"
[ "$(number heap_allocations_after_seal)" = 0 ] || fail "heap calls after boot"
awk '/rigidly aligned/ {found = 1; if ($(NF - 5) > 5) exit 1} END {if (!found) exit 1}' "$results/ate" ||
  fail "the path is more than 5 mm beside the true one"
