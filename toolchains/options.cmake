# Flags for every target, and the two functions that every folder uses to declare itself.

# Same IEEE operations in the same order on every machine: no contraction to FMA, no fast-math (README, determinism).
add_compile_options(-ffp-contract=off -fno-math-errno)
# Paths in messages and debug information start at the root of the repository, on every machine and in every clone.
# The compiler cache hands the compiler paths relative to the build folder, hence the second map.
file(RELATIVE_PATH source_from_build ${PROJECT_BINARY_DIR} ${PROJECT_SOURCE_DIR})
cmake_path(APPEND source_from_build "")
add_compile_options(-ffile-prefix-map=${PROJECT_SOURCE_DIR}/= -ffile-prefix-map=${source_from_build}=)
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  # Tables of logarithms are computed by the compiler; clang stops after a million steps, GCC after 33 million.
  add_compile_options(-fconstexpr-steps=33554432)
endif()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(tactus_warnings INTERFACE)
target_compile_options(
  tactus_warnings
  INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wundef
            -Wimplicit-fallthrough -Wvla)
if(TACTUS_WERROR)
  target_compile_options(tactus_warnings INTERFACE -Werror)
endif()
if(TACTUS_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # GCC's own <regex> trips it once the sanitizers have rewritten the code; the other builds keep it.
  target_compile_options(tactus_warnings INTERFACE -Wno-maybe-uninitialized)
endif()

if(TACTUS_SANITIZE)
  string(REPLACE ";" "," sanitizers "${TACTUS_SANITIZE}")
  # No vptr check: rt and pipeline are compiled without RTTI, and the linker may keep their copy of a shared template.
  add_compile_options(-fsanitize=${sanitizers} -fno-sanitize=vptr -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${sanitizers})
endif()
if(TACTUS_BUILD_FUZZERS)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
    message(FATAL_ERROR "TACTUS_BUILD_FUZZERS needs clang++; use the preset fuzz")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=address,undefined)
endif()

# Code that a sanitizer build runs little of, the tests' own and the command line's: unoptimised it compiles in half the
# time, which is most of what such a build takes.
set(TACTUS_COLD_OPTIONS "")
if(TACTUS_SANITIZE)
  set(TACTUS_COLD_OPTIONS -O0)
endif()

# Step code runs on threads whose stacks are planned: a frame of more than 16 KiB belongs into planned memory instead.
# Sanitizers pad frames, so the limit holds where none is on.
set(TACTUS_FRAME_LIMIT "")
if(NOT TACTUS_SANITIZE AND NOT TACTUS_BUILD_FUZZERS)
  set(TACTUS_FRAME_LIMIT -Wframe-larger-than=16384)
endif()

# tactus_library(NAME [FREESTANDING] LIBS ...): all .cpp files of the current folder. FREESTANDING: compiled without
# exceptions and RTTI and with the frame limit, the rule for rt and pipeline; third-party throws are caught at the hal
# edge.
function(tactus_library name)
  cmake_parse_arguments(arg "FREESTANDING" "" "LIBS;PRIVATE_LIBS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  if(sources)
    add_library(${name} STATIC ${sources})
    target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} PUBLIC ${arg_LIBS} PRIVATE ${arg_PRIVATE_LIBS} tactus_warnings)
    if(arg_FREESTANDING)
      target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti ${TACTUS_FRAME_LIMIT})
    endif()
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} INTERFACE ${arg_LIBS})
  endif()
endfunction()

# What toolchains/test.sh builds under sanitizers (all but the slow and the latency tests), under qemu (label smoke) and
# with clang (the fuzzers), without naming single tests.
add_custom_target(tactus_fast_tests)
add_custom_target(tactus_smoke_tests)
add_custom_target(tactus_fuzzers)

# tactus_test(NAME LIBS ... [LABELS ...] [SOURCES ...] [TIMEOUT s]): one GoogleTest binary from all *_test.cpp files of the
# current folder; each case is a ctest test of its own. Labels that mean something: slow (not under sanitizers), smoke
# (also under qemu), latency (only on demand, alone), memory.
function(tactus_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "LIBS;LABELS;SOURCES" ${ARGN})
  if(NOT TACTUS_BUILD_TESTS)
    return()
  endif()
  if(NOT arg_SOURCES)
    file(GLOB arg_SOURCES CONFIGURE_DEPENDS *_test.cpp)
  endif()
  if(NOT arg_SOURCES)
    return()
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} tactus_test_support GTest::gtest_main tactus_warnings)
  target_compile_options(${name} PRIVATE ${TACTUS_COLD_OPTIONS})
  # Cases are listed when ctest starts, not when the binary is linked: under qemu listing takes seconds.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}")
  if(NOT "slow" IN_LIST arg_LABELS AND NOT "latency" IN_LIST arg_LABELS)
    add_dependencies(tactus_fast_tests ${name})
  endif()
  if("smoke" IN_LIST arg_LABELS)
    add_dependencies(tactus_smoke_tests ${name})
  endif()
endfunction()

# tactus_fuzzer(NAME LIBS ... [SOURCES ...] [SEEDS folder]): one libFuzzer binary, by default from NAME.cpp, and a ctest
# test of label fuzz that runs it for TACTUS_FUZZ_SECONDS (environment, default 40). SEEDS: inputs to start from; what the
# fuzzer finds goes to the build folder. Does nothing unless TACTUS_BUILD_FUZZERS is on.
function(tactus_fuzzer name)
  cmake_parse_arguments(arg "" "SEEDS" "LIBS;SOURCES" ${ARGN})
  if(NOT TACTUS_BUILD_FUZZERS)
    return()
  endif()
  if(NOT arg_SOURCES)
    set(arg_SOURCES ${name}.cpp)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} tactus_test_support tactus_warnings)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(tactus_fuzzers ${name})
  set(corpus ${CMAKE_CURRENT_BINARY_DIR}/${name}_corpus)
  file(MAKE_DIRECTORY ${corpus})
  set(seeds "")
  if(arg_SEEDS)
    get_filename_component(seeds ${arg_SEEDS} ABSOLUTE)
  endif()
  add_test(NAME fuzz.${name}
           COMMAND sh -c "exec \"$0\" -max_total_time=\"\${TACTUS_FUZZ_SECONDS:-40}\" -timeout=10 -rss_limit_mb=2048 \
-print_final_stats=1 -verbosity=0 \"$@\"" $<TARGET_FILE:${name}> ${corpus} ${seeds})
  set_tests_properties(fuzz.${name} PROPERTIES LABELS fuzz TIMEOUT 900)
endfunction()
