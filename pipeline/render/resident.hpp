// How much memory the process holds: the only fence there is around a graphics driver.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tactus::render {

/// Resident set of this process, from /proc/self/statm; nothing where there is no such file. No heap. Any
/// phase but a step (it reads a file).
std::optional<std::size_t> resident_bytes() noexcept;

/// Draws `frames_count` pictures with draw() and answers by how much the resident set grew meanwhile
/// (negative: it shrank). Warm up first: what a driver takes at its first pictures is no growth. Tests and
/// benches.
template <typename Draw>
std::optional<std::int64_t> resident_growth_bytes(int frames_count, Draw&& draw) {
  const auto before = resident_bytes();
  for (int i = 0; i < frames_count; ++i) draw();
  const auto after = resident_bytes();
  if (!before || !after) return std::nullopt;
  return static_cast<std::int64_t>(*after) - static_cast<std::int64_t>(*before);
}

}  // namespace tactus::render
