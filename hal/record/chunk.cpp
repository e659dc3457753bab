#include "hal/record/chunk.hpp"

#include "hal/record/crc32c.hpp"
#include "hal/record/little_endian.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {
constexpr std::size_t kHeaderCrcAt = kChunkHeaderBytes - 4;
}

ChunkHeaderBytes encode(const ChunkHeader& header) {
  ChunkHeaderBytes bytes{};
  std::uint8_t* at = put(bytes.data(), kMark);
  at = put(at, static_cast<std::uint8_t>(header.type));
  at = put(at, static_cast<std::uint8_t>(header.format));
  at = put(at, static_cast<std::uint8_t>(header.packing));
  at = put(at, std::uint8_t{0});
  at = put(at, header.payload_bytes);
  at = put(at, header.raw_bytes);
  at = put(at, header.frame.time.ns);
  at = put(at, header.frame.sequence);
  at = put(at, header.frame.arrived.ns);
  at = put(at, header.payload_crc);
  TACTUS_ASSERT(at == bytes.data() + kHeaderCrcAt);
  put(at, crc32c(std::span(bytes).first(kHeaderCrcAt)));
  return bytes;
}

std::optional<ChunkHeader> decode_chunk_header(std::span<const std::uint8_t, kChunkHeaderBytes> bytes) {
  const std::uint8_t* at = bytes.data();
  if (take<std::uint32_t>(at) != kMark) return std::nullopt;
  const std::uint8_t* crc_at = bytes.data() + kHeaderCrcAt;
  if (take<std::uint32_t>(crc_at) != crc32c(bytes.first(kHeaderCrcAt))) return std::nullopt;
  ChunkHeader out;
  out.type = static_cast<ChunkType>(take<std::uint8_t>(at));
  out.format = static_cast<PixelFormat>(take<std::uint8_t>(at));
  out.packing = static_cast<Packing>(take<std::uint8_t>(at));
  ++at;
  out.payload_bytes = take<std::uint64_t>(at);
  out.raw_bytes = take<std::uint64_t>(at);
  out.frame.time.ns = take<std::int64_t>(at);
  out.frame.sequence = take<std::uint64_t>(at);
  out.frame.arrived.ns = take<std::int64_t>(at);
  out.payload_crc = take<std::uint32_t>(at);
  return out;
}

std::array<std::uint8_t, kEndPayloadBytes> encode(const EndCounts& counts) {
  std::array<std::uint8_t, kEndPayloadBytes> bytes{};
  std::uint8_t* at = put(bytes.data(), counts.last_index_offset);
  at = put(at, counts.chunks_count);
  for (const EndCounts::OfStream& stream : counts.streams) {
    at = put(at, stream.written);
    at = put(at, stream.dropped);
    at = put(at, stream.refused);
  }
  TACTUS_ASSERT(at == bytes.data() + bytes.size());
  return bytes;
}

EndCounts decode_end(std::span<const std::uint8_t, kEndPayloadBytes> bytes) {
  const std::uint8_t* at = bytes.data();
  EndCounts out;
  out.last_index_offset = take<std::uint64_t>(at);
  out.chunks_count = take<std::uint64_t>(at);
  for (EndCounts::OfStream& stream : out.streams) {
    stream.written = take<std::uint64_t>(at);
    stream.dropped = take<std::uint64_t>(at);
    stream.refused = take<std::uint64_t>(at);
  }
  return out;
}

}  // namespace tactus::hal::record
