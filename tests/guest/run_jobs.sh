#!/bin/bash
# Second program of the guest: runs the jobs it was asked for, one after the other, and switches the machine off.
# Leaves RESULTS/JOB.log and RESULTS/JOB.code ("EXIT_CODE SECONDS") for each; toolchains/guest-test.sh reads them.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
. "$1"
export root results build kernel_root
export HOME=$results LC_ALL=C.UTF-8
mkdir /dev/shm /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t devpts -o ptmxmode=0666 devpts /dev/pts
read -r up _ </proc/uptime
echo "guest: up after $up s, Linux $(uname -r)"

for job in $jobs; do
  echo "== $job"
  SECONDS=0
  # A job that hangs must leave time to those after it; the longest takes half of this.
  timeout -k 5 "$job_limit_s" bash "$root/tests/guest/jobs/$job.sh" 2>&1 </dev/null | tee "$results/$job.log"
  echo "${PIPESTATUS[0]} $SECONDS" >"$results/$job.code"
done

dmesg >"$results/dmesg.log"
sync
echo o >/proc/sysrq-trigger
# Nothing can be started while the machine goes down.
while :; do :; done
