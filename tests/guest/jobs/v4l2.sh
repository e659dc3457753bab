# The kernel's virtual cameras (every kind of buffer, Y16, dropped buffers, injected errors) and a USB camera beside them.
. "$root/tests/guest/jobs/common.sh"

need v4l2/guest_v4l2_test
start_camera 2 --rates 10
load vivid n_devs=2 multiplanar=1,2 || exit 1
run_tests v4l2/guest_v4l2_test
code=$?
modprobe -d "$kernel_root" -r vivid
exit "$code"
