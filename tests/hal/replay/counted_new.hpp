// Counts this thread's calls of operator new, in a test binary that links counted_new.cpp.
#pragma once

#include <cstdint>

namespace tactus::test {

std::uint64_t heap_calls_count();

}  // namespace tactus::test
