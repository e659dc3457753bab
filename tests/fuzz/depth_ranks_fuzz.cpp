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
  if (bytes < 2) return 0;
  const int width = 1 + data[0] % 16, height = 1 + data[1] % 16;
  const std::span<const std::uint8_t> input(data + 2, bytes - 2);
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::uint16_t> depth(count), back(count);
  DepthRanks ranks(width, height);
  (void)ranks.unpack(input, depth);

  std::memcpy(depth.data(), input.data(), std::min(input.size(), 2 * count));
  std::vector<std::uint8_t> packed(ranks_bytes_max(count));
  packed.resize(ranks.pack(depth, packed));
  TACTUS_ASSERT(ranks.unpack(packed, back) && back == depth);

  Unpacker unpacker({width, height});
  for (int packing = 0; packing < 5; ++packing) {
    std::vector<std::uint8_t> raw(2 * count);
    (void)unpacker.unpack(static_cast<Packing>(packing), hal::PixelFormat::depth16, input, raw);
    raw.resize(3 * count);
    (void)unpacker.unpack(static_cast<Packing>(packing), hal::PixelFormat::rgb24, input, raw);
  }
  return 0;
}
