// One stream of image files: takes the list's entries in order and turns each into pixels or a counted
// rejection.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hal/camera.hpp"
#include "hal/replay/image_header.hpp"
#include "hal/replay/lists.hpp"

namespace tactus::hal::replay {

/// Room for one sentence about a rejected frame; longer ones are cut.
inline constexpr std::size_t kSentenceBytes = 512;

/// What became of one read: at most one frame, and the entries passed over before it.
struct FrameOutcome {
  rt::Status status = rt::Status::end_of_stream;  // ok | corrupt | end_of_stream
  FrameHeader header;
  std::uint64_t timestamps_rejected = 0;
  std::array<char, kSentenceBytes> sentence{};  // the first rejection among them; empty when none
};

/// Adds an outcome to the counters. No heap call once `first_rejection` has reserved kSentenceBytes.
void count(const FrameOutcome& outcome, CameraCounters& counters);

/// Pixel is uint16 (depth) or uint8 (colour, 3 per pixel). Thread-bound; may allocate.
template <typename Pixel>
class FrameSource {
 public:
  struct Config {
    std::filesystem::path directory;  // entries' paths are relative to it
    FrameList list;
    std::size_t first = 0, end = 0;  // entries [first, end) are played
    int width = 0, height = 0;
  };

  explicit FrameSource(Config config) : config_(std::move(config)), next_(config_.first) {}

  /// Decodes the next frame into `pixels`. Depth: 65535 becomes 0.
  void next(std::span<Pixel> pixels, FrameOutcome& outcome);
  [[nodiscard]] std::size_t pixels_count() const;

 private:
  Config config_;
  std::size_t next_ = 0;
  std::string bytes_;
};

extern template class FrameSource<std::uint16_t>;
extern template class FrameSource<std::uint8_t>;

}  // namespace tactus::hal::replay
