// What a thread did when: a ring of fixed records, the newest kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/assert.hpp"
#include "rt/slice.hpp"
#include "rt/time.hpp"

namespace tactus::rt {

enum class TraceKind : std::uint8_t {
  span,     ///< something that took time
  counter,  ///< a value from now on
  instant   ///< something that happened
};

struct TraceRecord {
  const char* name = "";  ///< a string literal
  HostTime start;
  Duration duration;  ///< spans
  std::int64_t value =
      0;  ///< counters: the value; spans and instants: a frame number or a Status, by the name
  TraceKind kind = TraceKind::span;
};

/// One per thread. When full the oldest record is overwritten, and counted. Unbound, it swallows everything:
/// tracing off. bind(): boot. record(): step, the owning thread, wait-free, 40 bytes written. Reading: after
/// the thread was joined; it is no edge and nothing here synchronises.
class TraceRing {
 public:
  static constexpr std::size_t bytes_needed(std::size_t records_count) {
    return bytes_of<TraceRecord>(records_count);
  }
  void bind(Slice& memory, std::size_t records_count) {
    TACTUS_ASSERT(records_count > 0 && records_.empty());
    records_ = memory.take<TraceRecord>(records_count);
  }

  void record(const TraceRecord& record) noexcept {
    if (records_.empty()) return;
    records_[next_] = record;
    next_ = next_ + 1 == records_.size() ? 0 : next_ + 1;
    ++recorded_count_;
  }
  void span(const char* name, HostTime start, Duration duration, std::int64_t value = 0) noexcept {
    record({name, start, duration, value, TraceKind::span});
  }
  void counter(const char* name, HostTime when, std::int64_t value) noexcept {
    record({name, when, {}, value, TraceKind::counter});
  }
  void instant(const char* name, HostTime when, std::int64_t value = 0) noexcept {
    record({name, when, {}, value, TraceKind::instant});
  }

  [[nodiscard]] std::uint64_t recorded_count() const { return recorded_count_; }
  [[nodiscard]] std::uint64_t overwritten_count() const { return recorded_count_ - size(); }
  [[nodiscard]] std::size_t size() const {
    return recorded_count_ < records_.size() ? static_cast<std::size_t>(recorded_count_) : records_.size();
  }

  /// Oldest first.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    const std::size_t oldest = size() < records_.size() ? 0 : next_;
    for (std::size_t i = 0; i < size(); ++i) visit(records_[(oldest + i) % records_.size()]);
  }

 private:
  std::span<TraceRecord> records_;
  std::size_t next_ = 0;
  std::uint64_t recorded_count_ = 0;
};

}  // namespace tactus::rt
