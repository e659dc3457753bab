#!/usr/bin/env bash
# toolchains/guest-test.sh [JOB...]: runs the jobs of tests/guest (all of them by default) against real drivers: in QEMU,
# on Debian's kernel, with this machine's files read-only below. Needs no KVM and no root; asks nothing.
# TACTUS_GUEST_ACCEL=tcg: without KVM where there is one. Where QEMU cannot run it says so in one sentence and is content.
set -euo pipefail
cd "$(dirname "$0")/.."
. toolchains/packages.sh
. toolchains/environment.sh
PATH=$PATH:/usr/sbin:/sbin

root=$PWD
build_folder=$root/build/release
work=$root/build/guest
results=$work/results
kernel_root=$tactus_cache/guest-kernel
# All jobs together are to stay below 6 minutes where two processors are emulated.
limit_s=${TACTUS_GUEST_LIMIT_S:-360}
job_limit_s=${TACTUS_GUEST_JOB_LIMIT_S:-150}
all_jobs=(v4l2 uvcvideo libcamera iio program)

say() { echo "guest: $*"; }
skip() {
  say "skipped: $*"
  exit 0
}

# as_root COMMAND...: where that is possible without a question.
as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  else
    sudo -n "$@"
  fi
}

qemu_starts() {
  echo quit | timeout 30 qemu-system-x86_64 -machine none -accel tcg -nodefaults -no-user-config -display none \
    -monitor stdio >/dev/null 2>&1
}

# The package that linux-image-amd64 stands for today, and its version: "NAME VERSION".
newest_kernel() {
  local name version
  name=$(apt-cache depends linux-image-amd64 2>/dev/null | awk '$1 == "Depends:" && $2 ~ /^linux-image-/ {print $2; exit}')
  version=$(apt-cache policy "${name:-none}" 2>/dev/null | awk '$1 == "Candidate:" && $2 != "(none)" {print $2; exit}')
  [ -z "$version" ] || echo "$name $version"
}

# fetch NAME VERSION: downloads and unpacks into the cache; what was there before goes when the new one is whole.
fetch() {
  local fresh=$kernel_root.fresh
  rm -rf "$fresh"
  mkdir -p "$fresh/download"
  (cd "$fresh/download" && apt-get -o APT::Sandbox::User=root download "$1=$2" >../download.log 2>&1) || return 1
  dpkg -x "$fresh"/download/*.deb "$fresh" || return 1
  rm -r "$fresh/download" "$fresh/download.log"
  depmod -b "$fresh" "${1#linux-image-}" || return 1
  echo "$1 $2" >"$fresh/package"
  rm -rf "$kernel_root"
  mv "$fresh" "$kernel_root"
}

fetch_kernel() {
  local wanted have
  have=$(cat "$kernel_root/package" 2>/dev/null || true)
  wanted=$(newest_kernel)
  if [ -n "$wanted" ] && [ "$wanted" = "$have" ]; then
    return
  fi
  say "downloading ${wanted:-the newest kernel of Debian} (70 MB)"
  # shellcheck disable=SC2086  # two words
  if [ -n "$wanted" ] && fetch $wanted; then
    return
  fi
  # The list of packages may be older than the archive.
  if as_root apt-get update >/dev/null 2>&1; then
    wanted=$(newest_kernel)
    # shellcheck disable=SC2086  # two words
    if [ -n "$wanted" ] && fetch $wanted; then
      return
    fi
  fi
  rm -rf "$kernel_root.fresh"
  [ -n "$have" ] || skip "Debian's kernel package cannot be downloaded here, and none is in $kernel_root"
  say "the download failed; $have of an earlier run it is"
}

# The first root: busybox, the modules that lead to the host's files, the first program.
make_initramfs() {
  local tree=$work/initramfs module path release=$1
  rm -rf "$tree"
  mkdir -p "$tree"/{bin,proc,sys,dev,modules}
  cp "$(command -v busybox)" "$tree/bin/busybox"
  for path in sh mount mkdir insmod sleep switch_root; do
    ln -s busybox "$tree/bin/$path"
  done
  for module in virtio_pci 9pnet_virtio 9p overlay; do
    modprobe -d "$kernel_root" -S "$release" --show-depends "$module"
  done | awk '$1 == "insmod" && !seen[$2]++ {print $2}' >"$work/modules"
  while read -r path; do
    cp "$path" "$tree/modules/"
    basename "$path" >>"$tree/modules/order"
  done <"$work/modules"
  cp tests/guest/init.sh "$tree/init"
  chmod +x "$tree/init"
  cp "$results/settings" "$tree/settings"
  (cd "$tree" && find . | cpio -o -H newc --quiet | gzip -1) >"$work/initramfs.gz"
}

write_settings() {
  cat >"$results/settings" <<END
root='$root'
build='$build_folder'
results='$results'
kernel_root='$kernel_root'
jobs='$*'
job_limit_s=$job_limit_s
END
}

machine=
stop_machine() {
  [ -n "$machine" ] || return 0
  kill "$machine" 2>/dev/null || true
  wait "$machine" || true
}
trap stop_machine EXIT
trap 'exit 130' INT TERM

# boot ACCELERATOR LIMIT_S: one run of the guest, from power on to power off; what it says is also in $work/console.log.
# 124: it ran into the limit.
boot() {
  local code=0 console teller
  exec {console}> >(sed -u 's/\r$//' | tee "$work/console.log")
  teller=$!
  # Kernel messages of the drivers under test (errors are their job here) go to dmesg.log alone.
  timeout -k 5 "$2" qemu-system-x86_64 -accel "$1" -cpu max -smp 2 -m 2G \
    -nodefaults -no-user-config -display none -no-reboot -chardev stdio,id=console,signal=off -serial chardev:console \
    -kernel "$kernel" -initrd "$work/initramfs.gz" \
    -append "console=ttyS0 quiet loglevel=2 panic=-1 mitigations=off tsc=reliable random.trust_cpu=on" \
    -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap \
    -virtfs local,path="$results",mount_tag=results,security_model=none,multidevs=remap \
    </dev/null >&"$console" 2>&1 &
  machine=$!
  wait "$machine" || code=$?
  machine=
  exec {console}>&-
  wait "$teller" || true
  return "$code"
}

# Some machines have a KVM that starts and then stands still: a boot without jobs takes 2 s where it works.
kvm_boots() {
  [ "${TACTUS_GUEST_ACCEL:-kvm}" = kvm ] && [ -w /dev/kvm ] || return 1
  write_settings
  boot kvm 10 >/dev/null 2>&1 && grep -q "up after" "$work/console.log"
}

[ "$(uname -m)" = x86_64 ] || skip "the guest runs this machine's own programs, and is made for x86-64 alone"
install_packages "${packages_run[@]}" "${packages_test[@]}" || say "packages are missing, see above"
command -v qemu-system-x86_64 >/dev/null || skip "qemu-system-x86_64 is not installed here"
qemu_starts || skip "qemu-system-x86_64 does not start here"
fetch_kernel
kernel=$(echo "$kernel_root"/boot/vmlinuz-*)

jobs_wanted=("$@")
[ $# -gt 0 ] || jobs_wanted=("${all_jobs[@]}")
for job in "${jobs_wanted[@]}"; do
  [ -f "tests/guest/jobs/$job.sh" ] || { say "there is no job $job; there are: ${all_jobs[*]}" >&2; exit 2; }
done

say "building, preset release"
build release -DTACTUS_WERROR=ON -- tactus_guest_tests

SECONDS=0
rm -rf "$work"
mkdir -p "$results"
# What the USB camera shows.
"$build_folder/tests/guest/usb_camera/guest_render_clip" 'synthetic:bedroom?mode=320x240&frames=40' "$results/room"
write_settings
make_initramfs "${kernel##*/vmlinuz-}"
accel=tcg
if kvm_boots; then
  accel=kvm
fi

say "booting $(cat "$kernel_root/package") with $accel, at most $limit_s s"
write_settings "${jobs_wanted[@]}"
machine_code=0
boot "$accel" "$limit_s" || machine_code=$?

passed=() skipped=() failed=()
for job in "${jobs_wanted[@]}"; do
  code='' seconds=''
  [ ! -f "$results/$job.code" ] || read -r code seconds <"$results/$job.code"
  case $code in
    0) passed+=("$job $seconds s") ;;
    77) skipped+=("$job: $(sed -n 's/^skipped: //p' "$results/$job.log" | head -n 1)") ;;
    '') failed+=("$job: never ended") ;;
    124 | 137) failed+=("$job: longer than $job_limit_s s") ;;
    *) failed+=("$job: exit code $code") ;;
  esac
done
# list WORD...: with commas between.
list() { local IFS=,; echo "$*" | sed 's/,/, /g'; }
say "$SECONDS s with $accel; passed: $(list "${passed[@]:-none}"); skipped: $(list "${skipped[@]:-none}"); \
failed: $(list "${failed[@]:-none}")"
if [ ${#failed[@]} -gt 0 ]; then
  [ "$machine_code" -ne 124 ] || say "the machine was stopped after $limit_s s" >&2
  say "see $work/console.log and $results" >&2
  exit 1
fi
