// Depth images of the kinds that decide how a codec does, from a seed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace tactus::hal::record {

enum class DepthKind : std::uint8_t { empty, constant, noise, disparity, every_millimetre, stripes, saturated };
inline constexpr int kDepthKinds = 7;

inline std::vector<std::uint16_t> depth_picture(DepthKind kind, int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint16_t> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::size_t i = 0;
  for (auto& value : out) {
    const std::size_t x = i % static_cast<std::size_t>(width), y = i / static_cast<std::size_t>(width);
    switch (kind) {
      case DepthKind::empty:
        break;
      case DepthKind::constant:
        value = 1234;
        break;
      case DepthKind::noise:
        value = static_cast<std::uint16_t>(random());
        break;
      case DepthKind::disparity: {  // a slanted wall in eighths of a pixel of disparity, with holes
        const auto disparity = 200 + x / 3 + y / 5 + random() % 3;
        value = static_cast<std::uint16_t>(random() % 40 == 0 ? 0 : 1'740'000 / disparity);
        break;
      }
      case DepthKind::every_millimetre:
        value = static_cast<std::uint16_t>(1000 + x + 2 * y + random() % 9);
        break;
      case DepthKind::stripes:
        value = static_cast<std::uint16_t>((x & 1) != 0 ? 0 : (x & 2) != 0 ? 65535 : 1);
        break;
      case DepthKind::saturated:
        value = static_cast<std::uint16_t>(random() % 3 == 0 ? 65535 : 500 + random() % 4);
        break;
    }
    ++i;
  }
  return out;
}

}  // namespace tactus::hal::record
