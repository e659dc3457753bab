#!/usr/bin/env bash
# Every test, from a clone on Debian 12: installs what is missing, then builds and runs
#   fuzz     each fuzzer for TACTUS_FUZZ_SECONDS (default 40), one per core at a time
#   asan     the fast tests under AddressSanitizer and UndefinedBehaviorSanitizer
#   tsan     the tests of everything that threads share, under ThreadSanitizer
#   aarch64  the smoke tests, cross-built, under qemu
#   guest    cameras on a kernel of their own, see guest-test.sh
#   release  all tests but the latency budget, which wants a quiet machine: ctest --preset latency
# A phase that fails does not stop the others, but fails the whole. The last lines are those of the release ctest.
set -euo pipefail
cd "$(dirname "$0")/.."
. toolchains/packages.sh
. toolchains/environment.sh

failed=()
report=()

# phase NAME COMMAND...: runs it, notes the time and whether it failed.
phase() {
  local name=$1 start=$SECONDS verdict=ok
  shift
  echo "== $name"
  # A subshell of its own keeps set -e working inside the function; a plain `if phase` would switch it off.
  set +e
  (set -e; "$@")
  [ $? -eq 0 ] || { verdict=FAILED; failed+=("$name"); }
  set -e
  report+=("$(printf '%-16s %4d s  %s' "$name" $((SECONDS - start)) "$verdict")")
  echo "== ${report[-1]}"
}

fuzz_build() { build fuzz -DTACTUS_WERROR=ON -- tactus_fuzzers; }
fuzz_run() { ctest --preset fuzz -j "$jobs"; }
asan_build() { build asan -DTACTUS_WERROR=ON -- tactus_fast_tests; }
asan_run() { ctest --preset asan -j "$jobs"; }
# Where threads share anything, folders of tests/; the test preset leaves out what is not built.
threaded=(rt hal/replay hal/record hal/openni2 pipeline/map pipeline/track conformance)
tsan_build() { build tsan -DTACTUS_WERROR=ON -- $(printf 'tests/%s/all ' "${threaded[@]}"); }
# Address randomisation is switched off: the ThreadSanitizer of GCC 12 cannot map its shadow on kernels that randomise
# more bits than it knows of.
tsan_run() { setarch -R ctest --preset tsan -j "$jobs"; }
aarch64_build() { build aarch64 -DTACTUS_WERROR=ON -- tactus tactus_smoke_tests; }
aarch64_run() { ctest --preset aarch64 -j "$jobs"; }
release_build() { build release -DTACTUS_WERROR=ON -- all; }
release_run() { ctest --preset release -j "$jobs"; }

phase packages install_packages "${packages_run[@]}" "${packages_test[@]}" "${packages_cross[@]}"
[ ${#failed[@]} -eq 0 ] || exit 1
phase sysroot toolchains/sysroot.sh
for preset in fuzz asan tsan aarch64; do
  phase "$preset build" "${preset}_build"
  phase "$preset run" "${preset}_run"
done
phase guest toolchains/guest-test.sh
phase "release build" release_build

echo "== so far"
printf '%s\n' "${report[@]}"
[ ${#failed[@]} -eq 0 ] || echo "failed so far: ${failed[*]}"
release_run || failed+=("release run")
[ ${#failed[@]} -eq 0 ] || { echo "test.sh: failed phases: $(IFS=,; echo "${failed[*]}")" >&2; exit 1; }
