// Which frames a fault hits, and random numbers that belong to one frame.
#pragma once

#include <cstdint>

#include "hal/faults/faults.hpp"

namespace tactus::hal::faults {

/// splitmix64: a number of 64 mixed bits from any other.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// The same for the same four numbers, on every machine.
class FrameRandom {
 public:
  constexpr FrameRandom(std::uint64_t seed, std::uint64_t fault_index, Stream stream, std::uint64_t sequence)
      : state_(mixed(mixed(mixed(mixed(seed) + fault_index) + static_cast<std::uint64_t>(stream)) + sequence)) {}

  constexpr std::uint64_t next() { return state_ = mixed(state_); }
  /// [0, 1)
  constexpr double next_unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  /// [0, end)
  constexpr std::size_t next_below(std::size_t end) { return static_cast<std::size_t>(next() % end); }

 private:
  std::uint64_t state_;
};

constexpr bool is_of(const Fault& fault, Stream stream) {
  return stream == Stream::depth ? fault.hits_depth : fault.hits_color;
}

/// Whether `fault`, number `fault_index` of the plan, hits this frame.
constexpr bool is_hit(const Fault& fault, std::uint64_t seed, std::uint64_t fault_index, Stream stream,
                      std::uint64_t sequence) {
  if (!is_of(fault, stream) || sequence < fault.first) return false;
  const std::uint64_t since = sequence - fault.first;
  if (since % fault.every != 0 || since / fault.every >= fault.count) return false;
  return fault.probability >= 1 ||
         FrameRandom(seed, fault_index, stream, sequence).next_unit() < fault.probability;
}

}  // namespace tactus::hal::faults
