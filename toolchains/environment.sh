# Settings shared by run.sh and test.sh: where caches live (outside the clone, so that a fresh clone builds quickly
# the second time) and how a phase announces itself.

tactus_cache=${XDG_CACHE_HOME:-$HOME/.cache}/tactus
export CCACHE_DIR=${CCACHE_DIR:-$tactus_cache/ccache}
export CCACHE_MAXSIZE=${CCACHE_MAXSIZE:-5G}
# A clone in another folder hits the same cache entries.
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
# The arm64 root that CMake and qemu look into, see sysroot.sh.
export TACTUS_SYSROOT=${TACTUS_SYSROOT:-$tactus_cache/sysroot-arm64}

jobs=$(nproc)

# build PRESET [TARGET...]: configures and builds; warnings are errors where WERROR=ON.
build() {
  local preset=$1
  shift
  cmake --preset "$preset" -DTACTUS_WERROR="${WERROR:-OFF}" >"build/$preset.configure.log" 2>&1 || {
    cat "build/$preset.configure.log"
    return 1
  }
  cmake --build --preset "$preset" -j "$jobs" ${1:+--target "$@"}
}
