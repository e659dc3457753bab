# Sourced by the jobs, which run in the guest; never run by itself.

# What ctest takes for "skipped", too.
skip() {
  echo "skipped: $1"
  exit 77
}

# load MODULE [PARAMETER...]: from Debian's kernel package, which is unpacked beside, not installed.
load() { modprobe -d "$kernel_root" "$@"; }

# need BINARY: of the build folder's tests/guest.
need() { [ -x "$build/tests/guest/$1" ] || skip "this build has no $1"; }

# run_tests BINARY: a GoogleTest binary there. A case that skips lacks something that this guest should have given it.
run_tests() {
  local report
  report=$results/$(basename "$1").xml
  "$build/tests/guest/$1" --gtest_output="xml:$report" || return
  ! grep -q 'result="skipped"' "$report" || { echo "skipped cases are failures here"; return 1; }
}

# start_camera STREAMS OPTION...: plugs in a USB camera with that many streams, which shows the rendered room, and waits for
# its nodes: ${nodes[0]} is depth where it has depth. Its process is $camera, which goes when the job ends.
start_camera() {
  local streams_count=$1 name node
  shift
  load -a uvcvideo vhci-hcd || exit 1
  "$build/tests/guest/usb_camera/guest_usb_camera" "$results/room/clip" --name "tactus camera" "$@" &
  camera=$!
  trap 'kill "$camera"; wait "$camera"' EXIT
  for _ in {1..300}; do
    nodes=()
    for name in /sys/class/video4linux/video*/name; do
      node=${name%/name}
      # Each stream has a node for its images and one, with an odd index, for what goes with them.
      if [ "$(cat "$name" 2>/dev/null)" = "tactus camera" ] && [ $(($(cat "$node/index") % 2)) = 0 ]; then
        nodes+=("/dev/${node##*/}")
      fi
    done
    [ ${#nodes[@]} -ne "$streams_count" ] || return 0
    kill -0 "$camera" || exit 1
    sleep 0.1
  done
  echo "the camera's nodes do not appear"
  exit 1
}
