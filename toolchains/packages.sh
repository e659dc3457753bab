# Which Debian 12 packages tactus needs and why; sourced by run.sh, test.sh and sysroot.sh, never run by itself.
# toolchains/dependencies.cmake is the other half: what is found there is named here.

# Enough to build the program and run it.
packages_run=(
  # Compiler and build. ca-certificates: apt mirrors over https. ccache: a second build is quick.
  g++ cmake ninja-build pkg-config ccache ca-certificates
  # Header-only or nearly: matrices, SIMD, command line, JSON, TOML, nearest neighbours (evaluation), distributions of the user
  # study's statistics (Boost.Math).
  libeigen3-dev libhwy-dev libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libnanoflann-dev libboost-dev
  # Images. The three modules used, not libopencv-dev, which also pulls in VTK, a Java runtime and ffmpeg. libpng and libjpeg
  # directly where a damaged file must be refused, or a picture written without exceptions.
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libpng-dev libjpeg62-turbo-dev
  # Recordings: zstd. Cameras: OpenNI2, libcamera with its UVC and simple pipelines; V4L2 needs the kernel's headers alone.
  libzstd-dev libopenni2-dev libcamera-dev libcamera-ipa
  # Contacts between bodies.
  libode-dev
  # The int8 network: file reader and its generator, kernels, thread pool, processor detection.
  libflatbuffers-dev flatbuffers-compiler libxnnpack-dev libpthreadpool-dev libcpuinfo-dev
  # Rendering without a window: headers, and Mesa's software driver, which EGL loads at run time.
  libegl-dev libgles-dev libegl1 libgles2 libegl-mesa0 libgl1-mesa-dri
  # A window, when there is a screen; the screen itself, where no window system has it.
  libx11-dev libdrm-dev libgbm-dev
  # Sound in space (OpenAL Soft, HRTF), with or without a sound card; video.mp4 with its sound.
  libopenal-dev libasound2 libavformat-dev libavcodec-dev libavutil-dev libswscale-dev
)

# The tests on this machine: GoogleTest, and clang with its libFuzzer and sanitizer runtimes.
packages_test=(
  libgtest-dev clang libclang-rt-14-dev llvm binutils
  # The other two codecs of the recorder's comparison are in zstd and here.
  liblz4-dev
  # A guest kernel with cameras (guest-test.sh): the machine, its first root, Debian's modules, cameras by libcamera's udev.
  qemu-system-x86 busybox-static cpio kmod udev
  # A screen for the window's tests and a person's hand on it; a browser for the questionnaire's.
  xvfb libxtst-dev chromium
)

# Nothing needs these: peers that tests/bench runs beside ours where they are installed. PCL: the CRF of the paper's authors.
packages_peer=(libpcl-dev)

# The same tests as an arm64 device sees them: compiler, user-mode emulator, and what makes the sysroot.
packages_cross=(g++-aarch64-linux-gnu qemu-user-static mmdebstrap)

# What the arm64 sysroot holds: packages_run less tools, the renderer's driver (llvmpipe under qemu would be
# minutes a frame) and the video encoder (a headset shows its pictures, its 90 libraries would double the sysroot), plus the C and C++ libraries and GoogleTest.
packages_sysroot=(
  libc6-dev libstdc++-12-dev
  libeigen3-dev libhwy-dev libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libnanoflann-dev libboost-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libpng-dev libjpeg62-turbo-dev
  libzstd-dev libode-dev
  libflatbuffers-dev libxnnpack-dev libpthreadpool-dev libcpuinfo-dev
  libegl-dev libgles-dev libx11-dev libopenal-dev
  libgtest-dev
)

# Training the network (toolchains/model); neither the program nor its tests need them. OpenBLAS: torch's 1x1 convolutions
# are matrix products on one thread, 18 times slower with the reference BLAS.
packages_model=(
  python3-torch python3-numpy python3-scipy python3-pil python3-flatbuffers flatbuffers-compiler libopenblas0-pthread
)

# install_packages NAME...: installs what is missing and says what; asks nothing.
install_packages() {
  local missing=() package
  for package in "$@"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then
    echo "packages: all $# are installed"
    return
  fi
  echo "packages: installing ${missing[*]}"
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "packages: not root and no sudo here; as root run: apt-get install --no-install-recommends ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  local log
  log=$(mktemp)
  if ! { "${as_root[@]}" apt-get update &&
         "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
           "${missing[@]}"; } </dev/null >"$log" 2>&1; then
    tail -n 30 "$log" >&2
    rm -f "$log"
    echo "packages: apt-get failed, its last lines are above" >&2
    return 1
  fi
  rm -f "$log"
}
