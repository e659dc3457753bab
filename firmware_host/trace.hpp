// trace.json: the trace-event format that Perfetto and chrome://tracing open.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "rt/status.hpp"

namespace tactus::firmware {

struct TraceRecord {
  enum class Kind : std::uint8_t {
    span,     // something that took time
    counter,  // a value from now on
    instant   // something that happened
  };
  Kind kind = Kind::span;
  const char* name = "";         // must outlive the writing
  std::uint32_t thread = 0;      // index into thread_names
  std::int64_t start_ns = 0;     // any one clock
  std::int64_t duration_ns = 0;  // spans
  double value = 0;              // counters
  std::uint64_t frame = 0;       // spans and instants: shown as an argument
};

/// Times are written in microseconds with three decimals, counted from the earliest record. Threads are
/// numbered from 1 and listed in the order of `thread_names`.
rt::Result<void> write_trace(const std::filesystem::path& file, std::span<const TraceRecord> records,
                             std::span<const std::string> thread_names);

}  // namespace tactus::firmware
