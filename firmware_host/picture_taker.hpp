// The pictures of a report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware_host/run_result.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/clock.hpp"

namespace tactus::firmware {

/// Chooses and keeps the pictures of a report: the moment when real things hide most of a virtual one (but
/// not all), the labels over the video, and evenly spread views. Present thread.
class PictureTaker {
 public:
  explicit PictureTaker(std::uint64_t frames_expected);
  /// After each contact round: draws when this frame is worth it.
  void consider(Pipeline& pipeline, rt::Clock clock, std::uint64_t frame);
  /// The pictures kept, the best occlusion first.
  [[nodiscard]] std::vector<Picture> take();

 private:
  [[nodiscard]] static Picture grab(Pipeline& pipeline, rt::Clock clock, float overlay,
                                    const std::string& title, const std::string& caption);
  std::uint64_t every_;
  float best_hidden_ = 0;
  Picture hidden_;
  std::vector<Picture> spread_;
};

}  // namespace tactus::firmware
