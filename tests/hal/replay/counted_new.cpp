// In a file of its own: inlined into callers, GCC takes malloc and operator delete for a mismatched pair.
#include "tests/hal/replay/counted_new.hpp"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {
thread_local std::uint64_t calls_count = 0;
}

void* operator new(std::size_t bytes) {
  ++calls_count;
  if (void* memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

std::uint64_t tactus::test::heap_calls_count() { return calls_count; }
