# The program on a USB camera that shows the synthetic room: it must track it, go on when the plug is pulled, and make no
# heap call of its own.
. "$root/tests/guest/jobs/common.sh"

tactus=$build/firmware_host/tactus
frames=30

# number KEY FILE: of a JSON text with a line for each value; the first of that name.
number() { sed -n "s/^ *\"$1\": \([-0-9.e+]*\),*$/\1/p" "$2" | head -n 1; }

fail() {
  echo "FAILED: $1"
  exit 1
}

# track NAME OPTION...: one session on a camera that is plugged in with these options; leaves $results/NAME.
track() {
  local name=$1 out=$results/$1
  shift
  # Two frames a second, which is slow enough for an emulated processor, and no more than the driver has buffers for.
  start_camera 2 --together --rates 2 --log "$results/$name.shown" "$@"
  "$tactus" run "v4l2:${nodes[0]}?color=${nodes[1]}&calibration=$results/room/calibration.toml" --runner lockstep \
    --model none --frames "0:$frames" --out "$out" || fail "$name: exit code $?"
  kill "$camera"
  wait "$camera"
  trap - EXIT
  # What the camera showed when, with the true pose of that frame.
  awk 'NR == FNR {pose[NR - 1] = $0; count = NR; next} {print $2, pose[$1 % count]}' \
    "$results/room/poses.txt" "$results/$name.shown" >"$results/$name.truth"
  "$tactus" eval trajectory "$out/trajectory.txt" "$results/$name.truth" --gap 240 | tee "$results/$name.ate"
  echo "$name: tracked $(number frames_tracked "$out/summary.json"), lost $(number frames_lost "$out/summary.json")," \
    "missing $(number frames_missing "$out/summary.json"), $(number wall_s "$out/summary.json") s"
  [ "$(number heap_allocations_after_seal "$out/summary.json")" = 0 ] || fail "$name: heap calls after boot"
}

track steady
[ "$(number frames_tracked "$results/steady/summary.json")" = "$frames" ] || fail "not every frame was tracked"
[ "$(number frames_lost "$results/steady/summary.json")" = 0 ] || fail "tracking was lost"
awk '/rigidly aligned/ {found = 1; if ($(NF - 5) > 5) exit 1} END {if (!found) exit 1}' "$results/steady.ate" ||
  fail "the trajectory is more than 5 mm beside the truth"

track unplugged --unplug-at 12 --plug-again 2
[ "$(number losses "$results/unplugged/summary.json")" -ge 1 ] || fail "the pulled plug is not in the summary"
awk '/rigidly aligned/ {found = 1; if ($(NF - 5) > 20) exit 1} END {if (!found) exit 1}' "$results/unplugged.ate" ||
  fail "after the pulled plug the trajectory is more than 20 mm beside the truth"
