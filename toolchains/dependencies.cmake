# Third parties, all from Debian 12. toolchains/packages.sh lists the packages.
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_path(TOMLPLUSPLUS_INCLUDE_DIR toml++/toml.h REQUIRED)
find_path(BOOST_INCLUDE_DIR boost/math/distributions/fisher_f.hpp REQUIRED)  # headers alone, on the system's path
pkg_check_modules(HWY REQUIRED IMPORTED_TARGET libhwy)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)
  # NEON alone: vectors whose size is only known at run time (SVE) cannot be members, and headsets do not have them.
  target_compile_definitions(PkgConfig::HWY INTERFACE "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
pkg_check_modules(ODE REQUIRED IMPORTED_TARGET ode)
pkg_check_modules(FLATBUFFERS REQUIRED IMPORTED_TARGET flatbuffers)
pkg_check_modules(EGL REQUIRED IMPORTED_TARGET egl)
pkg_check_modules(GLES REQUIRED IMPORTED_TARGET glesv2)
pkg_check_modules(PNG REQUIRED IMPORTED_TARGET libpng)
pkg_check_modules(JPEG REQUIRED IMPORTED_TARGET libjpeg)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
# Cameras; where a library is not there, the program says so instead.
pkg_check_modules(OPENNI2 IMPORTED_TARGET libopenni2)
pkg_check_modules(LIBCAMERA IMPORTED_TARGET libcamera)
# From 1.7 on a program survives the loss of its X server.
pkg_check_modules(X11 REQUIRED IMPORTED_TARGET x11>=1.7)
# Where they are not there, the program has no display without a window system.
pkg_check_modules(KMS IMPORTED_TARGET libdrm gbm)
pkg_check_modules(OPENAL REQUIRED IMPORTED_TARGET openal)
# Where it is not there, as on a headset, the program says so instead of writing video.mp4.
pkg_check_modules(LIBAV IMPORTED_TARGET libavformat "libavcodec>=59.24" libavutil libswscale)
find_library(XNNPACK_LIBRARY XNNPACK REQUIRED)
find_library(PTHREADPOOL_LIBRARY pthreadpool REQUIRED)

# OpenCV's three modules are found one by one: its CMake package insists on all forty of them, down to VTK and Java.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc imgcodecs)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  add_library(opencv_${module} UNKNOWN IMPORTED)
  set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION ${OPENCV_${module}_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
endforeach()
set_property(TARGET opencv_imgproc PROPERTY INTERFACE_LINK_LIBRARIES opencv_core)
set_property(TARGET opencv_imgcodecs PROPERTY INTERFACE_LINK_LIBRARIES opencv_imgproc)

if(TACTUS_BUILD_TESTS)
  find_package(GTest REQUIRED)
  # A hand on keyboard and mouse; without it the window's tests are left out.
  pkg_check_modules(XTST IMPORTED_TARGET xtst)
  include(GoogleTest)
endif()
