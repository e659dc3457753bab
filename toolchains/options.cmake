# Flags for every target, and the two functions that every folder uses to declare itself.

# Same IEEE operations in the same order on every machine: no contraction to FMA, no fast-math (README, determinism).
add_compile_options(-ffp-contract=off -fno-math-errno)

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

if(TACTUS_SANITIZE)
  string(REPLACE ";" "," sanitizers "${TACTUS_SANITIZE}")
  add_compile_options(-fsanitize=${sanitizers} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${sanitizers})
endif()

# tactus_library(NAME [FREESTANDING] LIBS ...): all .cpp files of the current folder. FREESTANDING: compiled without
# exceptions and RTTI, the rule for rt and pipeline; third-party throws are caught at the hal edge.
function(tactus_library name)
  cmake_parse_arguments(arg "FREESTANDING" "" "LIBS;PRIVATE_LIBS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  if(sources)
    add_library(${name} STATIC ${sources})
    target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} PUBLIC ${arg_LIBS} PRIVATE ${arg_PRIVATE_LIBS} tactus_warnings)
    if(arg_FREESTANDING)
      target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti)
    endif()
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} INTERFACE ${arg_LIBS})
  endif()
endfunction()

# tactus_test(NAME LIBS ... [LABELS ...] [TIMEOUT s]): one GoogleTest binary from all *_test.cpp files of the current
# folder; each case is a ctest test of its own.
function(tactus_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "LIBS;LABELS;SOURCES" ${ARGN})
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
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}")
endfunction()
