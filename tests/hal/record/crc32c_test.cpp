#include "hal/record/crc32c.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <numeric>
#include <random>
#include <string_view>
#include <vector>

namespace tactus::hal::record {
namespace {

/// One bit at a time, as the polynomial is written.
std::uint32_t by_definition(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? (crc >> 1) ^ 0x82F63B78 : crc >> 1;
  }
  return ~crc;
}

struct Published {
  std::vector<std::uint8_t> bytes;
  std::uint32_t crc;
};

/// RFC 3720, appendix B.4, and the check value of the catalogue of CRCs.
std::vector<Published> published() {
  std::vector<std::uint8_t> rising(32), falling(32);
  std::iota(rising.begin(), rising.end(), std::uint8_t{0});
  std::iota(falling.rbegin(), falling.rend(), std::uint8_t{0});
  const std::string_view digits = "123456789";
  const std::array<std::uint8_t, 48> scsi_read{
      0x01, 0xC0, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
      0x14, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x14, 0x00, 0x00, 0x00, 0x18,
      0x28, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  return {{{}, 0},
          {std::vector<std::uint8_t>(32, 0), 0x8A9136AA},
          {std::vector<std::uint8_t>(32, 0xFF), 0x62A8AB43},
          {rising, 0x46DD794E},
          {falling, 0x113FDB5C},
          {{scsi_read.begin(), scsi_read.end()}, 0xD9963A56},
          {{digits.begin(), digits.end()}, 0xE3069283}};
}

TEST(Crc32c, PublishedVectorsAnswerAsPublished) {
  for (const Published& known : published()) {
    EXPECT_EQ(crc32c(known.bytes), known.crc) << known.bytes.size() << " bytes";
    EXPECT_EQ(crc32c_by_tables(known.bytes), known.crc) << known.bytes.size() << " bytes";
  }
}

TEST(Crc32c, InstructionTablesAndDefinitionAgreeAtEveryLengthAndAlignment) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  std::vector<std::uint8_t> bytes(600);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  const std::span<const std::uint8_t> all(bytes);
  for (std::size_t first = 0; first < 9; ++first)
    for (std::size_t count = 0; count < 100; ++count) {
      const std::uint32_t expected = by_definition(all.subspan(first, count));
      ASSERT_EQ(crc32c(all.subspan(first, count)), expected) << first << " " << count << " seed " << kSeed;
      ASSERT_EQ(crc32c_by_tables(all.subspan(first, count)), expected) << first << " " << count;
    }
  EXPECT_EQ(crc32c(all), by_definition(all)) << (has_crc32c_instruction() ? "instruction" : "tables");
}

TEST(Crc32c, PiecesGiveWhatTheWholeGives) {
  const std::vector<std::uint8_t> bytes = published()[5].bytes;
  const std::span<const std::uint8_t> all(bytes);
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    EXPECT_EQ(crc32c(all.subspan(cut), crc32c(all.first(cut))), 0xD9963A56);
    EXPECT_EQ(crc32c_by_tables(all.subspan(cut), crc32c_by_tables(all.first(cut))), 0xD9963A56);
  }
}

}  // namespace
}  // namespace tactus::hal::record
