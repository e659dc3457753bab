# Shared by run.sh, test.sh and sysroot.sh, which have changed into the root of the repository: where caches live
# (outside the clone, so that a fresh clone builds quickly the second time) and how to build a preset.

tactus_cache=${XDG_CACHE_HOME:-$HOME/.cache}/tactus
export CCACHE_DIR=${CCACHE_DIR:-$tactus_cache/ccache}
export CCACHE_MAXSIZE=${CCACHE_MAXSIZE:-5G}
# A clone in another folder hits the same cache entries.
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
# The arm64 root that CMake and qemu look into, see sysroot.sh.
export TACTUS_SYSROOT=${TACTUS_SYSROOT:-$tactus_cache/sysroot-arm64}

jobs=$(nproc)

# build PRESET [CMAKE OPTION...] -- [TARGET...]: configures, quietly while all is well, and builds.
build() {
  local preset=$1 options=()
  shift
  while [ $# -gt 0 ] && [ "$1" != -- ]; do
    options+=("$1")
    shift
  done
  shift
  mkdir -p build
  if ! cmake --preset "$preset" "${options[@]}" >"build/$preset.configure.log" 2>&1; then
    cat "build/$preset.configure.log" >&2
    return 1
  fi
  cmake --build --preset "$preset" -j "$jobs" ${1:+--target "$@"}
}
