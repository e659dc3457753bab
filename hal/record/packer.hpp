// A frame's bytes to a chunk's payload and back: filter, then zstd.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hal/raw_frame.hpp"
#include "hal/record/chunk.hpp"
#include "hal/record/depth_ranks.hpp"

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace tactus::hal::record {

/// The size of one stream's frames.
struct FrameSize {
  int width = 0, height = 0;  // pixels
};

struct Packed {
  Packing packing = Packing::none;
  std::span<const std::uint8_t> payload;  // valid until the next call; the bytes themselves when nothing made them smaller
};

/// Lossless in every format. One thread at a time.
class Packer {
 public:
  explicit Packer(FrameSize size);
  ~Packer();
  Packer(const Packer&) = delete;
  Packer& operator=(const Packer&) = delete;

  /// A whole frame without padding (frames::packed_bytes; mjpeg stays as it is).
  Packed pack(PixelFormat format, std::span<const std::uint8_t> bytes);
  /// Bytes of no form, such as label images, at most width * height * 3 of them.
  Packed pack(std::span<const std::uint8_t> bytes);
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  Packed compressed(Packing packing, std::span<const std::uint8_t> filtered, std::span<const std::uint8_t> bytes);

  FrameSize size_;
  DepthRanks ranks_;
  std::vector<std::uint16_t> depth_;
  std::vector<std::uint8_t> filtered_, out_;
  std::unique_ptr<ZSTD_CCtx_s, void (*)(ZSTD_CCtx_s*)> zstd_;
};

/// The way back. No heap after it is made. One thread at a time.
class Unpacker {
 public:
  explicit Unpacker(FrameSize size);
  ~Unpacker();
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  /// Fills `bytes` exactly; false when the payload is not that many bytes of this form. Safe on any payload.
  bool unpack(Packing packing, PixelFormat format, std::span<const std::uint8_t> payload, std::span<std::uint8_t> bytes);

 private:
  FrameSize size_;
  DepthRanks ranks_;
  std::vector<std::uint16_t> depth_;
  std::vector<std::uint8_t> filtered_;
  std::unique_ptr<ZSTD_DCtx_s, void (*)(ZSTD_DCtx_s*)> zstd_;
};

}  // namespace tactus::hal::record
