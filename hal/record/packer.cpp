#include "hal/record/packer.hpp"

#include <zstd.h>

#include <cstring>

#include "hal/record/byte_deltas.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {

/// 2 and 3 change the size by -3 to +2 % for up to a tenth more time, -1 makes it a tenth to a fifth larger
/// (depth_codec_bench).
constexpr int kZstdLevel = 1;

std::size_t pixels_of(FrameSize size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}

void free_compressor(ZSTD_CCtx* context) { ZSTD_freeCCtx(context); }
void free_decompressor(ZSTD_DCtx* context) { ZSTD_freeDCtx(context); }

}  // namespace

Packer::Packer(FrameSize size)
    : size_(size),
      ranks_(size.width, size.height),
      depth_(pixels_of(size)),
      filtered_(ranks_bytes_max(pixels_of(size))),
      out_(ZSTD_compressBound(filtered_.size())),
      zstd_(ZSTD_createCCtx(), free_compressor) {
  TACTUS_ASSERT(zstd_ != nullptr);
  // The context takes its memory with the first image: here, so that memory_bytes() is the truth.
  ZSTD_compressCCtx(zstd_.get(), out_.data(), out_.size(), filtered_.data(), filtered_.size(), kZstdLevel);
}
Packer::~Packer() = default;

std::size_t Packer::memory_bytes() const {
  return ranks_.memory_bytes() + 2 * depth_.size() + filtered_.size() + out_.size() + ZSTD_sizeof_CCtx(zstd_.get());
}

Packed Packer::compressed(Packing packing, std::span<const std::uint8_t> filtered, std::span<const std::uint8_t> bytes) {
  const std::size_t count =
      ZSTD_compressCCtx(zstd_.get(), out_.data(), out_.size(), filtered.data(), filtered.size(), kZstdLevel);
  if (ZSTD_isError(count) != 0 || count >= bytes.size()) return {Packing::none, bytes};
  return {packing, std::span(out_).first(count)};
}

Packed Packer::pack(PixelFormat format, std::span<const std::uint8_t> bytes) {
  if (format == PixelFormat::mjpeg) return {Packing::none, bytes};
  if (format == PixelFormat::depth16) {
    TACTUS_ASSERT(bytes.size() == 2 * depth_.size());
    std::memcpy(depth_.data(), bytes.data(), bytes.size());
    return compressed(Packing::ranks_zstd, std::span(filtered_).first(ranks_.pack(depth_, filtered_)), bytes);
  }
  TACTUS_ASSERT(bytes.size() <= filtered_.size());
  const auto filtered = std::span(filtered_).first(bytes.size());
  to_deltas(format, pixels_of(size_), bytes, filtered);
  return compressed(Packing::deltas_zstd, filtered, bytes);
}

Packed Packer::pack(std::span<const std::uint8_t> bytes) {
  TACTUS_ASSERT(bytes.size() <= filtered_.size());
  return compressed(Packing::zstd, bytes, bytes);
}

Unpacker::Unpacker(FrameSize size)
    : size_(size),
      ranks_(size.width, size.height),
      depth_(pixels_of(size)),
      filtered_(ranks_bytes_max(pixels_of(size))),
      zstd_(ZSTD_createDCtx(), free_decompressor) {
  TACTUS_ASSERT(zstd_ != nullptr);
}
Unpacker::~Unpacker() = default;

bool Unpacker::unpack(Packing packing, PixelFormat format, std::span<const std::uint8_t> payload,
                      std::span<std::uint8_t> bytes) {
  if (packing == Packing::none) {
    if (payload.size() != bytes.size()) return false;
    if (!bytes.empty()) std::memcpy(bytes.data(), payload.data(), bytes.size());
    return true;
  }
  const auto decompress = [&](std::span<std::uint8_t> out) {
    return ZSTD_decompressDCtx(zstd_.get(), out.data(), out.size(), payload.data(), payload.size());
  };
  if (packing == Packing::ranks_zstd) {
    if (format != PixelFormat::depth16 || bytes.size() != 2 * depth_.size()) return false;
    const std::size_t count = decompress(filtered_);
    if (ZSTD_isError(count) != 0 || !ranks_.unpack(std::span(filtered_).first(count), depth_)) return false;
    std::memcpy(bytes.data(), depth_.data(), bytes.size());
    return true;
  }
  if (packing != Packing::zstd && packing != Packing::deltas_zstd) return false;
  const std::size_t count = decompress(bytes);
  if (ZSTD_isError(count) != 0 || count != bytes.size()) return false;
  if (packing == Packing::zstd) return true;
  if (format != PixelFormat::rgb24 && format != PixelFormat::yuyv && format != PixelFormat::nv12) return false;
  from_deltas(format, pixels_of(size_), bytes);
  return true;
}

}  // namespace tactus::hal::record
