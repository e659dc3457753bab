// Filters and packing: whatever goes in comes back byte for byte, and no bytes from outside do harm.
#include "hal/record/packer.hpp"

#include <gtest/gtest.h>
#include <zstd.h>

#include <cstring>
#include <random>
#include <vector>

#include "hal/frames/convert.hpp"
#include "hal/record/byte_deltas.hpp"
#include "tests/hal/record/depth_pictures.hpp"

namespace tactus::hal::record {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes as_bytes(const std::vector<std::uint16_t>& depth) {
  Bytes out(2 * depth.size());
  std::memcpy(out.data(), depth.data(), out.size());
  return out;
}

constexpr FrameSize kSizes[] = {{1, 1}, {1, 9}, {9, 1}, {16, 12}, {37, 23}, {320, 240}};

TEST(DepthRanks, EveryKindAndSizeOfImageComesBack) {
  for (const FrameSize size : kSizes)
    for (int kind = 0; kind < kDepthKinds; ++kind) {
      DepthRanks sut(size.width, size.height);
      const auto depth = depth_picture(static_cast<DepthKind>(kind), size.width, size.height, 5);
      Bytes packed(ranks_bytes_max(depth.size()));
      packed.resize(sut.pack(depth, packed));
      std::vector<std::uint16_t> back(depth.size(), 77);
      ASSERT_TRUE(sut.unpack(packed, back)) << size.width << " kind " << kind;
      ASSERT_EQ(back, depth) << size.width << " kind " << kind;
    }
}

TEST(DepthRanks, AllValuesAtOnceStayWithinTheBound) {
  constexpr int kWidth = 256, kHeight = 512;  // each value twice, jumping from end to end
  std::vector<std::uint16_t> depth(kWidth * kHeight), back(depth.size());
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = static_cast<std::uint16_t>(i * 40503);
  DepthRanks sut(kWidth, kHeight);
  Bytes packed(ranks_bytes_max(depth.size()));
  packed.resize(sut.pack(depth, packed));
  ASSERT_TRUE(sut.unpack(packed, back));
  EXPECT_EQ(back, depth);
}

/// The form of version 1, written by hand.
TEST(DepthRanks, KnownImageHasTheKnownBytes) {
  const std::vector<std::uint16_t> depth{0, 1000, 1002, 1000, 1000, 0, 5000, 1000};
  const Bytes expected{3,   0,    0, 0,              // three values:
                       232, 7,    2, 158, 31,        // 1000, 2 more, 3998 more
                       1,   4,    1, 2,              // a hole, four values, a hole, two values
                       2,   2,    1,                 // ranks 1 2 1 after 0 1 2: +1 +1 -1
                       2,   4,    1};                // 1 below 0: +1; 3 between 1 and 2: +2; 1 between 3 and 1: -1
  DepthRanks sut(4, 2);
  Bytes packed(ranks_bytes_max(depth.size()));
  packed.resize(sut.pack(depth, packed));
  std::vector<std::uint16_t> back(depth.size());
  ASSERT_TRUE(sut.unpack(packed, back));
  EXPECT_EQ(back, depth);
  EXPECT_EQ(packed, expected);
}

TEST(DepthRanks, DamagedBytesAreRefusedOrGiveSomeImage) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  DepthRanks sut(37, 23);
  const auto depth = depth_picture(DepthKind::disparity, 37, 23, 1);
  Bytes packed(ranks_bytes_max(depth.size()));
  packed.resize(sut.pack(depth, packed));
  std::vector<std::uint16_t> back(depth.size());
  for (std::size_t cut = 0; cut < packed.size(); ++cut)
    ASSERT_FALSE(sut.unpack(std::span(packed).first(cut), back)) << "seed " << kSeed;
  int refused_count = 0;
  for (int i = 0; i < 20000; ++i) {
    Bytes damaged = packed;
    for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
    refused_count += sut.unpack(damaged, back) ? 0 : 1;
  }
  EXPECT_GT(refused_count, 0);
  packed.push_back(0);
  EXPECT_FALSE(sut.unpack(packed, back)) << "a byte too many";
}

TEST(ByteDeltas, EveryFormatComesBack) {
  std::mt19937 random(4);
  for (const PixelFormat format : {PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12})
    for (const FrameSize size : {FrameSize{2, 2}, FrameSize{16, 12}, FrameSize{38, 24}}) {
      Bytes bytes(frames::packed_bytes(format, size.width, size.height));
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
      const auto luma_bytes = static_cast<std::size_t>(size.width * size.height);
      Bytes deltas(bytes.size());
      to_deltas(format, luma_bytes, bytes, deltas);
      EXPECT_NE(deltas, bytes);
      from_deltas(format, luma_bytes, deltas);
      ASSERT_EQ(deltas, bytes) << static_cast<int>(format) << " " << size.width;
    }
}

TEST(Packer, EveryFormatComesBackByteForByteAndSmoothImagesGetSmaller) {
  std::mt19937 random(6);
  for (const FrameSize size : kSizes) {
    Packer packer(size);
    Unpacker unpacker(size);
    for (const PixelFormat format :
         {PixelFormat::depth16, PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::mjpeg}) {
      const bool has_pairs = format == PixelFormat::yuyv || format == PixelFormat::nv12;
      if (has_pairs && (size.width % 2 != 0 || size.height % 2 != 0)) continue;
      for (const bool is_smooth : {true, false}) {
        Bytes bytes(format == PixelFormat::mjpeg ? 500 : frames::packed_bytes(format, size.width, size.height));
        for (std::size_t i = 0; i < bytes.size(); ++i)
          bytes[i] = static_cast<std::uint8_t>(is_smooth ? i / 200 : random());
        const Packed packed = packer.pack(format, bytes);
        EXPECT_LE(packed.payload.size(), bytes.size()) << "never larger";
        if (is_smooth && size.width == 320 && format != PixelFormat::mjpeg) {
          EXPECT_LT(packed.payload.size(), bytes.size() / 2) << static_cast<int>(format);
        }
        Bytes back(bytes.size(), 9);
        ASSERT_TRUE(unpacker.unpack(packed.packing, format, packed.payload, back));
        ASSERT_EQ(back, bytes) << static_cast<int>(format) << " " << size.width;
      }
    }
    const Bytes ids(static_cast<std::size_t>(size.width * size.height), 7);
    const Packed packed = packer.pack(ids);
    Bytes back(ids.size());
    ASSERT_TRUE(unpacker.unpack(packed.packing, PixelFormat::depth16, packed.payload, back));
    EXPECT_EQ(back, ids);
  }
}

TEST(Packer, DepthKindsComeBack) {
  for (int kind = 0; kind < kDepthKinds; ++kind) {
    Packer packer({320, 240});
    Unpacker unpacker({320, 240});
    const Bytes bytes = as_bytes(depth_picture(static_cast<DepthKind>(kind), 320, 240, 8));
    const Packed packed = packer.pack(PixelFormat::depth16, bytes);
    Bytes back(bytes.size());
    ASSERT_TRUE(unpacker.unpack(packed.packing, PixelFormat::depth16, packed.payload, back)) << kind;
    ASSERT_EQ(back, bytes) << kind;
  }
}

TEST(Unpacker, WrongSizesFormsAndDamageAreRefused) {
  const FrameSize size{16, 12};
  Packer packer(size);
  Unpacker sut(size);
  const Bytes bytes = as_bytes(depth_picture(DepthKind::disparity, size.width, size.height, 2));
  const Packed packed = packer.pack(PixelFormat::depth16, bytes);
  ASSERT_EQ(packed.packing, Packing::ranks_zstd);
  const Bytes payload(packed.payload.begin(), packed.payload.end());
  Bytes back(bytes.size());
  EXPECT_TRUE(sut.unpack(Packing::ranks_zstd, PixelFormat::depth16, payload, back));
  EXPECT_FALSE(sut.unpack(Packing::ranks_zstd, PixelFormat::rgb24, payload, back));
  EXPECT_FALSE(sut.unpack(Packing::deltas_zstd, PixelFormat::depth16, payload, back));
  EXPECT_FALSE(sut.unpack(Packing::none, PixelFormat::depth16, payload, back));
  EXPECT_FALSE(sut.unpack(static_cast<Packing>(200), PixelFormat::depth16, payload, back));
  EXPECT_FALSE(sut.unpack(Packing::ranks_zstd, PixelFormat::depth16, payload, std::span(back).first(100)));
  for (std::size_t cut = 0; cut < payload.size(); ++cut)
    ASSERT_FALSE(sut.unpack(Packing::ranks_zstd, PixelFormat::depth16, std::span(payload).first(cut), back));
  // A frame that unpacks to far more than the image: bounded by the image's own memory.
  const Bytes many(std::size_t{8} << 20, 0);
  Bytes bomb(ZSTD_compressBound(many.size()));
  bomb.resize(ZSTD_compress(bomb.data(), bomb.size(), many.data(), many.size(), 1));
  for (const Packing packing : {Packing::zstd, Packing::ranks_zstd, Packing::deltas_zstd})
    EXPECT_FALSE(sut.unpack(packing, PixelFormat::depth16, bomb, back));
}

}  // namespace
}  // namespace tactus::hal::record
