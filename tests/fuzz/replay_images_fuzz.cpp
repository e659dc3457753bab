// PNG and JPEG headers, and the decoders behind them: the header check bounds what a decoder may be asked
// for.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hal/replay/image_codec.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "rt/assert.hpp"

using namespace tactus;
using hal::replay::ImageUse;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view image(reinterpret_cast<const char*>(data), bytes);
  const auto header = hal::replay::parse_image_header(image);
  if (!header) {
    TACTUS_ASSERT(!header.error().message.empty());
    return 0;
  }
  for (const ImageUse use : {ImageUse::depth, ImageUse::label, ImageUse::color})
    if (hal::replay::fault_of(header.value(), use, 0, 0).empty())
      TACTUS_ASSERT(header.value().width * header.value().height <= hal::replay::kImagePixelsMax);
  // The seeds are of this size; the decoders refuse any other before they start.
  constexpr int kWidth = 8, kHeight = 6;
  std::array<std::uint16_t, kWidth * kHeight> depth{};
  std::array<std::uint8_t, kWidth * kHeight> label{};
  std::array<std::uint8_t, kWidth * kHeight * 3> rgb{};
  const bool is_depth = hal::replay::decode_depth(image, kWidth, kHeight, depth).empty();
  const bool is_label = hal::replay::decode_label(image, kWidth, kHeight, label).empty();
  const bool is_color = hal::replay::decode_color(image, kWidth, kHeight, rgb).empty();
  TACTUS_ASSERT(!(is_depth && (is_label || is_color)));
  return 0;
}
