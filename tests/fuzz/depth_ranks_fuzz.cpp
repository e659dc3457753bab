// Packed depth images: any bytes are refused or give an image, and an image comes back as it was.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "hal/record/depth_ranks.hpp"
#include "hal/record/packer.hpp"
#include "rt/assert.hpp"

using namespace tactus;
using namespace tactus::hal::record;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  constexpr int kWidth = 12, kHeight = 10;
  constexpr std::size_t kCount = kWidth * kHeight;
  static DepthRanks ranks(kWidth, kHeight);
  static Unpacker unpacker({kWidth, kHeight});
  const std::span<const std::uint8_t> input(data, bytes);
  std::vector<std::uint16_t> depth(kCount), back(kCount);
  (void)ranks.unpack(input, depth);

  if (bytes > 0) std::memcpy(depth.data(), data, std::min(bytes, 2 * kCount));
  std::vector<std::uint8_t> packed(ranks_bytes_max(kCount));
  packed.resize(ranks.pack(depth, packed));
  TACTUS_ASSERT(ranks.unpack(packed, back) && back == depth);

  for (int packing = 0; packing < 5; ++packing) {
    std::vector<std::uint8_t> raw(2 * kCount);
    (void)unpacker.unpack(static_cast<Packing>(packing), hal::PixelFormat::depth16, input, raw);
    raw.resize(3 * kCount);
    (void)unpacker.unpack(static_cast<Packing>(packing), hal::PixelFormat::rgb24, input, raw);
  }
  return 0;
}
