// The checksum of recordings: CRC-32C (Castagnoli; RFC 3720, appendix B.4).
#pragma once

#include <cstdint>
#include <span>

namespace tactus::hal::record {

/// Of bytes that come in pieces: hand the answer for what came before to the next call. By the processor's own
/// instruction where it has one (8 bytes in 3 cycles), else by tables (8 bytes in about 8); the same answer either way.
/// Any thread, no heap.
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t before = 0);

/// By tables alone: what other processors compute.
std::uint32_t crc32c_by_tables(std::span<const std::uint8_t> bytes, std::uint32_t before = 0);

/// Whether crc32c() uses the processor's instruction here.
bool has_crc32c_instruction();

}  // namespace tactus::hal::record
