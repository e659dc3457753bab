// The records that an .oni file is made of, as OpenNI 2.2 writes and reads them (format 1.0.1.0; all little-endian).
//
// header, then records: each a head (magic, type, node, bytes of head and fields, bytes of payload, position of the record
// that undoes it), its fields, its payload. Before 1.0.1.0 the undo position has 32 bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tactus::hal::openni2 {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "records are copied as they stand in memory");

inline constexpr std::size_t kFileHeaderBytes = 24;
inline constexpr std::size_t kRecordHeadBytes = 28;
inline constexpr std::size_t kOldRecordHeadBytes = 24;
inline constexpr std::uint32_t kRecordMagic = 0x0052494E;
inline constexpr std::uint32_t kNoNode = 0xFFFFFFFF;

enum class OniRecord : std::uint32_t {
  node_added_1_0_0_4 = 0x02,
  int_property = 0x03,
  real_property = 0x04,
  string_property = 0x05,
  general_property = 0x06,
  node_removed = 0x07,
  data_begin = 0x08,
  state_ready = 0x09,
  new_data = 0x0A,
  end = 0x0B,
  node_added_1_0_0_5 = 0x0C,
  node_added = 0x0D,
  seek_table = 0x0E,
};

enum class OniNode : std::uint32_t { device = 1, depth = 2, image = 3, infrared = 5 };

constexpr std::uint32_t four_letters(char a, char b, char c, char d) {
  const auto byte = [](char letter) { return static_cast<std::uint32_t>(static_cast<unsigned char>(letter)); };
  return byte(a) | byte(b) << 8 | byte(c) << 16 | byte(d) << 24;
}
inline constexpr std::uint32_t kCodecNone = four_letters('N', 'O', 'N', 'E');
inline constexpr std::uint32_t kCodecJpeg = four_letters('J', 'P', 'E', 'G');
inline constexpr std::uint32_t kCodec16z = four_letters('1', '6', 'z', 'P');
inline constexpr std::uint32_t kCodec16zTables = four_letters('1', '6', 'z', 'T');

// OniPixelFormat's values, which the files keep.
inline constexpr std::uint64_t kOniDepth1mm = 100, kOniDepth100um = 101, kOniRgb888 = 200;

/// The library decodes into memory for a frame of 1600 x 1200 RGB pixels, and does not look whether it is enough.
inline constexpr std::size_t kOniFrameBytesMax = std::size_t{1600} * 1200 * 3;

}  // namespace tactus::hal::openni2
