// How often a stage answered what.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "rt/status.hpp"

namespace tactus::rt {

/// One per stage. Any thread, wait-free. Relaxed: counts for reports, they order nothing.
class StatusCounters {
 public:
  void count(Status status) noexcept { counts_[index_of(status)].fetch_add(1, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t was(Status status) const noexcept {
    return counts_[index_of(status)].load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t was_total() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& count : counts_) sum += count.load(std::memory_order_relaxed);
    return sum;
  }

 private:
  static std::size_t index_of(Status status) noexcept {
    const auto index = static_cast<std::size_t>(status);
    TACTUS_ASSERT(index < kStatusCount);
    return index;
  }
  std::array<std::atomic<std::uint64_t>, kStatusCount> counts_{};
};

}  // namespace tactus::rt
