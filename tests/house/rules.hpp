// The house rules as functions from source text to findings; house_test.cpp holds the tree to them,
// rules_test.cpp shows that each can fail.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/house/source_file.hpp"

namespace tactus::house {

struct Finding {
  std::string path;
  int line;  // from 1; 0 is the file as a whole
  std::string what;
};
std::string to_string(const Finding& finding);

// A file (or a folder, when it ends in a slash) that may break a rule on one word, and why.
struct Exception {
  std::string_view path;
  std::string_view word;
  std::string_view reason;
};

// firmware_host -> pipeline -> hal interfaces -> rt -> std. Only firmware_host names a hal backend, a backend
// names no other, and stages name each other along the arrows of one table only. Quoted includes start at the
// root.
std::vector<Finding> check_include_direction(const SourceFile& file);

// Words that allocate, lock, sleep, print, throw or read a clock: banned in rt/, pipeline/ (but for
// evaluate/, which runs after the session) and the hal interfaces, since all of it can be reached from a
// step.
std::vector<Finding> check_step_words(const SourceFile& file, std::span<const Exception> exceptions);

// Inside the body of a noexcept function of rt/ and pipeline/ nothing may grow: no std::string, std::vector
// and the like.
std::vector<Finding> check_noexcept_bodies(const SourceFile& file, std::span<const Exception> exceptions);

// Words whose result differs between machines: libm's transcendental functions, hash-order containers, fused
// or approximate vector operations, intrinsics of one architecture. Banned where a session's result is
// computed.
std::vector<Finding> check_determinism_words(const SourceFile& file, std::span<const Exception> exceptions);

// No code in comments, no banner lines, no debts left as remarks, no lint switch without a reason.
std::vector<Finding> check_comments(const SourceFile& file);

// A file that publishes between threads says which access pairs with which; one that only uses relaxed
// accesses says why that is enough.
std::vector<Finding> check_atomics(const SourceFile& file);

// First line says what the file is for; then #pragma once; no using-namespace at file scope.
std::vector<Finding> check_header(const SourceFile& file);

// Every TEST body asserts something, none is disabled, and file names are snake_case.
std::vector<Finding> check_tests(const SourceFile& file);
std::vector<Finding> check_file_name(std::string_view path);

// No path of somebody's machine. Takes any text file.
std::vector<Finding> check_absolute_paths(std::string_view path, std::string_view text);

}  // namespace tactus::house
