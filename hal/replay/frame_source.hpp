// One stream of image files: takes the list's entries in order and turns each into pixels or a counted
// rejection.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hal/camera.hpp"
#include "hal/frames/frame_outcome.hpp"
#include "hal/replay/image_header.hpp"
#include "hal/replay/lists.hpp"

namespace tactus::hal::replay {

using frames::FrameOutcome;

/// Pixel is uint16 (depth) or uint8 (colour, 3 per pixel). Thread-bound; may allocate.
template <typename PixelType>
class FrameSource {
 public:
  using Pixel = PixelType;
  struct Config {
    std::filesystem::path directory;  // entries' paths are relative to it
    FrameList list;
    std::size_t first = 0, end = 0;  // entries [first, end) are played
    int width = 0, height = 0;
  };

  explicit FrameSource(Config config) : config_(std::move(config)), next_(config_.first) {}

  /// Decodes the next frame into `pixels`. Depth: 65535 becomes 0.
  void next(std::span<Pixel> pixels, FrameOutcome& outcome);
  /// What next() will say of the frame, as far as the list tells; a line that names no file is passed over.
  void peek(FrameOutcome& outcome);
  [[nodiscard]] std::size_t pixels_count() const;

 private:
  bool find_next(FrameOutcome& outcome);

  Config config_;
  std::size_t next_ = 0;
  std::string bytes_;
};

extern template class FrameSource<std::uint16_t>;
extern template class FrameSource<std::uint8_t>;

}  // namespace tactus::hal::replay
