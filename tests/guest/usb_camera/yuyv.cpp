#include "tests/guest/usb_camera/yuyv.hpp"

#include "rt/assert.hpp"

namespace tactus::guest {
namespace {

// Rows of the matrix times 2^16: 0.257 0.504 0.098, -0.148 -0.291 0.439, 0.439 -0.368 -0.071. Those of chroma add up to 0.
std::uint8_t luma(int r, int g, int b) {
  return static_cast<std::uint8_t>((16829 * r + 33039 * g + 6416 * b + (16 << 16) + (1 << 15)) >> 16);
}

// Sums of two pixels each, hence one bit more.
std::uint8_t blueness(int r, int g, int b) {
  return static_cast<std::uint8_t>((-9714 * r - 19070 * g + 28784 * b + (128 << 17) + (1 << 16)) >> 17);
}

std::uint8_t redness(int r, int g, int b) {
  return static_cast<std::uint8_t>((28784 * r - 24103 * g - 4681 * b + (128 << 17) + (1 << 16)) >> 17);
}

}  // namespace

void to_yuyv(std::span<const std::uint8_t> rgb, std::span<std::uint8_t> yuyv) {
  TACTUS_ASSERT(rgb.size() % 6 == 0 && yuyv.size() == rgb.size() / 6 * 4);
  for (std::size_t pair = 0; pair < rgb.size() / 6; ++pair) {
    const std::uint8_t* in = rgb.data() + 6 * pair;
    std::uint8_t* out = yuyv.data() + 4 * pair;
    const int r = in[0] + in[3], g = in[1] + in[4], b = in[2] + in[5];
    out[0] = luma(in[0], in[1], in[2]);
    out[1] = blueness(r, g, b);
    out[2] = luma(in[3], in[4], in[5]);
    out[3] = redness(r, g, b);
  }
}

}  // namespace tactus::guest
