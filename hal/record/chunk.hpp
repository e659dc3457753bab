// The form of a recording (.tac), version 1; everything is little-endian.
//
//   file    16 bytes: kMagic with the version in its last four; then chunks, one after the other
//   chunk   56 bytes of header (ChunkHeader), then payload_bytes of payload, each with a CRC-32C of its own: the headers
//           alone tell what a file holds, so that one without an index is scanned without reading its pixels
//   order   header (what it is, TOML), truth; frames and labels as they came, an index after each kIndexEntries of
//           them; at a regular end the last index and `end`, which is always the last kEndChunkBytes of the file
//
// A file that was cut off anywhere is read up to its last whole chunk. Behind a damaged header reading goes on at the next
// kMark whose header's checksum fits. Chunks of a type that the reader does not know are passed over.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/raw_frame.hpp"

namespace tactus::hal::record {

/// As PNG's: the high bit shows channels of 7 bits, the line ends a transfer as text, 0x1A stops a listing.
inline constexpr std::array<std::uint8_t, 16> kMagic{0x89, 't',  'a',  'c', 't', 'u', 's', 0x0D,
                                                     0x0A, 0x1A, 0x0A, 0,   1,   0,   0,   0};
inline constexpr std::size_t kMagicBytes = kMagic.size(), kVersionAt = 12;
inline constexpr std::uint32_t kVersion = 1;
inline constexpr std::uint32_t kMark = 0xB5434154;  // "TAC" and a byte that is no letter

/// What a chunk holds. Values never change their meaning.
enum class ChunkType : std::uint8_t {
  header = 1,  // TOML (file_header.hpp)
  depth = 2,   // a frame
  color = 3,   // a frame
  labels = 4,  // material ids of the depth frame `sequence`, width * height bytes
  truth = 5,   // poses of kPoseBytes each: int64 time_ns, then rotation (row-major) and translation, 12 doubles
  index = 6,   // uint64: where the index before this one starts, 0: nowhere; then entries of kIndexEntryBytes
  end = 7,     // EndCounts
};

/// How the payload was made smaller. Values never change their meaning.
enum class Packing : std::uint8_t {
  none = 0,
  zstd = 1,
  ranks_zstd = 2,   // depth_ranks.hpp, then zstd
  deltas_zstd = 3,  // byte_deltas.hpp, then zstd
};

struct ChunkHeader {
  ChunkType type = ChunkType::header;
  PixelFormat format = PixelFormat::depth16;  // of frames; else 0
  Packing packing = Packing::none;
  std::uint64_t payload_bytes = 0;  // as it is in the file
  std::uint64_t raw_bytes = 0;      // unpacked; a frame's rows stand without padding
  FrameHeader frame = {};           // of frames and labels; else 0
  std::uint32_t payload_crc = 0;
};

inline constexpr std::size_t kChunkHeaderBytes = 56;
using ChunkHeaderBytes = std::array<std::uint8_t, kChunkHeaderBytes>;
/// Mark, fields in the order above (one byte of 0 after packing), then the checksum of the 52 bytes before it.
ChunkHeaderBytes encode(const ChunkHeader& header);
/// Nothing when mark or checksum do not fit. The type may be one that is not known here.
std::optional<ChunkHeader> decode_chunk_header(std::span<const std::uint8_t, kChunkHeaderBytes> bytes);

/// Where a chunk starts, then its header once more.
struct IndexEntry {
  std::uint64_t offset = 0;
  ChunkHeader header;
};
inline constexpr std::size_t kIndexEntryBytes = 8 + kChunkHeaderBytes;
inline constexpr std::size_t kIndexEntries = 2048;  // 17 s of two streams in one; the writer keeps only these 131 kB
inline constexpr std::size_t kPoseBytes = 8 + 12 * 8;

/// A regular end.
struct EndCounts {
  struct OfStream {
    std::uint64_t written = 0;
    std::uint64_t dropped = 0;  // the writer was behind, or had stopped
    std::uint64_t refused = 0;  // not whole, or of another size than the calibration's
    friend bool operator==(const OfStream&, const OfStream&) = default;
  };
  std::uint64_t last_index_offset = 0;  // 0: none
  std::uint64_t chunks_count = 0;       // before this one, indices included
  std::array<OfStream, 2> streams;      // by Stream
};
inline constexpr std::size_t kEndPayloadBytes = 64, kEndChunkBytes = kChunkHeaderBytes + kEndPayloadBytes;
std::array<std::uint8_t, kEndPayloadBytes> encode(const EndCounts& counts);
EndCounts decode_end(std::span<const std::uint8_t, kEndPayloadBytes> bytes);

/// Frames and labels beyond this are refused: 16 Mpixel of RGB is 48 MiB.
inline constexpr std::size_t kPayloadBytesMax = std::size_t{64} << 20;

}  // namespace tactus::hal::record
