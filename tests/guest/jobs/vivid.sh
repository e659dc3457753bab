# The kernel's virtual cameras: every kind of buffer, Y16, dropped buffers and injected errors.
. "$root/tests/guest/jobs/common.sh"

load vivid n_devs=2 node_types=0x1,0x1 || exit 1
run_tests v4l2/guest_v4l2_test
