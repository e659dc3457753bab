// Latencies in fixed buckets: percentiles without keeping the samples.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "rt/assert.hpp"
#include "rt/time.hpp"

namespace tactus::rt {

/// Log-linear buckets (as HdrHistogram): every power of two is cut into 64 equal parts, so a bucket is at
/// most 1/64 = 1.6 % of its value wide, from 1 ns (exact below 64 ns) to 68 s; longer goes into the last
/// bucket. 7.9 KB. Minimum and maximum are exact. record(): step, one thread, wait-free. The rest when that
/// thread rests.
class Histogram {
 public:
  void record(Duration duration) noexcept {
    const std::int64_t ns = duration.ns > 0 ? duration.ns : 0;
    ++counts_[index_of(static_cast<std::uint64_t>(ns))];
    ++count_;
    sum_ns_ += ns;
    if (ns < min_ns_ || count_ == 1) min_ns_ = ns;
    if (ns > max_ns_) max_ns_ = ns;
  }

  void merge(const Histogram& other) noexcept {
    if (other.count_ == 0) return;
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
    if (other.min_ns_ < min_ns_ || count_ == 0) min_ns_ = other.min_ns_;
    if (other.max_ns_ > max_ns_) max_ns_ = other.max_ns_;
    count_ += other.count_;
    sum_ns_ += other.sum_ns_;
  }

  /// The smallest value that at least `share` (0..1) of the samples do not exceed (nearest rank), up to 1.6 %
  /// too high. Zero when there are no samples.
  [[nodiscard]] Duration percentile(double share) const noexcept {
    TACTUS_ASSERT(share >= 0 && share <= 1);
    if (count_ == 0) return {};
    const double exact_rank = share * static_cast<double>(count_);
    auto rank = static_cast<std::uint64_t>(exact_rank);
    if (static_cast<double>(rank) < exact_rank || rank == 0) ++rank;
    std::uint64_t seen = 0;
    std::size_t i = 0;
    while ((seen += counts_[i]) < rank) ++i;
    const std::int64_t upper = static_cast<std::int64_t>(upper_edge(i));
    return {upper > max_ns_ || i == counts_.size() - 1 ? max_ns_ : upper < min_ns_ ? min_ns_ : upper};
  }
  [[nodiscard]] Duration p50() const noexcept { return percentile(0.5); }
  [[nodiscard]] Duration p99() const noexcept { return percentile(0.99); }
  [[nodiscard]] Duration min() const noexcept { return {min_ns_}; }
  [[nodiscard]] Duration max() const noexcept { return {max_ns_}; }
  [[nodiscard]] Duration sum() const noexcept { return {sum_ns_}; }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

 private:
  static constexpr int kPartsBits = 6;
  static constexpr std::uint64_t kParts = 1U << kPartsBits;
  static constexpr int kValueBits = 36;  // 2^36 ns = 68.7 s
  static constexpr std::size_t kBucketsCount = kParts * (kValueBits - kPartsBits + 1);

  static constexpr std::size_t index_of(std::uint64_t ns) {
    if (ns < kParts) return ns;
    if (ns >> kValueBits != 0) return kBucketsCount - 1;
    // ns = (64 + part) * 2^shift + rest
    const int shift = static_cast<int>(std::bit_width(ns)) - 1 - kPartsBits;
    return (static_cast<std::size_t>(shift) + 1) * kParts + ((ns >> shift) - kParts);
  }
  static constexpr std::uint64_t upper_edge(std::size_t index) {
    if (index < kParts) return index;
    const std::size_t shift = index / kParts - 1;
    return ((kParts + index % kParts + 1) << shift) - 1;
  }

  std::array<std::uint32_t, kBucketsCount> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t sum_ns_ = 0;
  std::int64_t min_ns_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace tactus::rt
