// Assertions that stay on in every build: a broken contract is a bug, never bad input.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace tactus::rt {

/// Called with the failed expression; must not return. Tests may replace it to prove that an assertion fires.
using PanicHandler = void (*)(const char* expression, const char* file, int line);

[[noreturn]] inline void abort_with_message(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, expression);
  std::abort();
}

inline PanicHandler panic_handler = abort_with_message;

[[noreturn]] inline void panic(const char* expression, const char* file, int line) {
  panic_handler(expression, file, line);
  std::abort();
}

}  // namespace tactus::rt

#define TACTUS_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::tactus::rt::panic(#expression, __FILE__, __LINE__))
