# A USB camera through libcamera, unplugged in mid-stream.
. "$root/tests/guest/jobs/common.sh"

need libcamera/guest_libcamera_test
# libcamera hears of cameras from udev.
/lib/systemd/systemd-udevd --daemon || exit 1
start_camera 1 --streams color --rates 10
udevadm trigger && udevadm settle --timeout 60 || exit 1

# It names a camera after the firmware's node of the USB controller. A real one has a node and this one has none, so the
# root of /sys lends it one.
give_firmware_node() {
  mkdir -p /run/sys/firmware_node && echo '\_SB_.VHCI' >/run/sys/firmware_node/path || return 1
  for place in /sys/*; do
    mkdir "/run/sys/${place##*/}" && mount --rbind "$place" "/run/sys/${place##*/}" || return 1
  done
  mount --rbind /run/sys /sys
}
give_firmware_node || exit 1

export TACTUS_GUEST_UNPLUG="kill -USR1 $camera" TACTUS_GUEST_PLUG="kill -USR2 $camera"
run_tests libcamera/guest_libcamera_test
