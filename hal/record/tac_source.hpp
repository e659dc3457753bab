// One stream of a recording: takes its chunks in order and turns each into pixels or a counted rejection.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hal/frames/decoded_stream.hpp"
#include "hal/record/packer.hpp"
#include "hal/record/tac_file.hpp"

namespace tactus::hal::record {

/// Pixel is uint16 (depth) or uint8 (colour, 3 per pixel). Thread-bound. No heap after it is made, but for libjpeg's.
template <typename PixelType>
class TacSource {
 public:
  using Pixel = PixelType;
  /// `entries` are played, in this order.
  TacSource(std::shared_ptr<const TacFile> file, std::vector<IndexEntry> entries, FrameSize size);

  void next(std::span<Pixel> pixels, frames::RawForm& raw, frames::FrameOutcome& outcome);
  void peek(frames::FrameOutcome& outcome);
  [[nodiscard]] std::size_t pixels_count() const;
  [[nodiscard]] std::size_t raw_bytes_max() const { return raw_bytes_max_; }
  /// Of chunk and scratch.
  [[nodiscard]] std::size_t memory_bytes() const { return buffer_.size(); }

 private:
  bool find_next(frames::FrameOutcome& outcome);
  const char* decode(const IndexEntry& entry, std::span<Pixel> pixels, frames::RawForm& raw);

  std::shared_ptr<const TacFile> file_;
  std::vector<IndexEntry> entries_;
  FrameSize size_;
  std::size_t next_ = 0, raw_bytes_max_ = 0;
  const IndexEntry* delivered_ = nullptr;  // the last whose time and number fitted
  std::vector<std::uint8_t> buffer_;
  std::unique_ptr<Unpacker> unpacker_;
};

extern template class TacSource<std::uint16_t>;
extern template class TacSource<std::uint8_t>;

}  // namespace tactus::hal::record
