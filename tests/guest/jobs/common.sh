# Sourced by the jobs, which run in the guest; never run by itself.

# What ctest takes for "skipped", too.
skip() {
  echo "skipped: $1"
  exit 77
}

# load MODULE [PARAMETER...]: from Debian's kernel package, which is unpacked beside, not installed.
load() { modprobe -d "$kernel_root" "$@"; }

# video_node NAME: the first /dev/videoN whose driver calls it so.
video_node() {
  local name
  for name in /sys/class/video4linux/video*/name; do
    if [ "$(cat "$name")" = "$1" ]; then
      name=${name%/name}
      echo "/dev/${name##*/}"
      return
    fi
  done
  return 1
}

# run_tests BINARY [ARGUMENT...]: a GoogleTest binary of the build folder.
run_tests() {
  local binary=$build/tests/guest/$1
  shift
  [ -x "$binary" ] || skip "$binary is not in this build"
  "$binary" --gtest_brief=0 --gtest_output="xml:$results/$(basename "$binary").xml" "$@"
}
