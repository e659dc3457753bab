# The USB camera through the kernel's uvcvideo: every byte, losses of every kind, unplugged in mid-stream.
. "$root/tests/guest/jobs/common.sh"

need uvcvideo/guest_uvcvideo_test
load -a uvcvideo vhci-hcd || exit 1
run_tests uvcvideo/guest_uvcvideo_test
