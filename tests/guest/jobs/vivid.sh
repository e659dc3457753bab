# The kernel's virtual cameras: every kind of buffer, Y16, dropped buffers and injected errors.
. "$root/tests/guest/jobs/common.sh"

need v4l2/guest_v4l2_test
load vivid n_devs=2 node_types=0x1,0x1 || exit 1
trap 'modprobe -d "$kernel_root" -r vivid' EXIT
run_tests v4l2/guest_v4l2_test
