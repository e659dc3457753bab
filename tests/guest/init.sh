#!/bin/sh
# First program of the guest, from its initramfs: mounts the host's root, read-only, below a layer in memory, so that the
# guest is the host's user space on a kernel of its own; then hands over to run_jobs.sh.
. /settings

fail() {
  echo "guest: $1"
  echo o >/proc/sysrq-trigger
  sleep 10
}

mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs devtmpfs /dev
while read -r module; do
  insmod "/modules/$module" || fail "the kernel refuses its module $module"
done </modules/order

mkdir -p /host /layer /root_of_guest
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose,ro host /host || fail "the host's root cannot be mounted"
mount -t tmpfs tmpfs /layer
mkdir /layer/upper /layer/work
mount -t overlay -o lowerdir=/host,upperdir=/layer/upper,workdir=/layer/work overlay /root_of_guest ||
  fail "no layer can be laid over the host's root"
for place in proc sys dev; do
  mount --move "/$place" "/root_of_guest/$place"
done
# What the host's programs left running is not running here.
mount -t tmpfs tmpfs /root_of_guest/run
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 results "/root_of_guest$results" ||
  fail "the folder for results cannot be mounted"
exec switch_root /root_of_guest /bin/bash "$root/tests/guest/run_jobs.sh" "$results/settings"
