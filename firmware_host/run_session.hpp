// One session of the pipeline under either runner, and the pictures taken on the way.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "firmware_host/run_result.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/clock.hpp"

namespace tactus::firmware {

/// Set by SIGINT and SIGTERM: the session ends after the frame at hand.
extern std::atomic<bool> interrupted;
void catch_signals();

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

/// One thread, fixed order, nothing dropped; virtual time advances by the sensor's frame interval. Returns
/// wall seconds.
double run_lockstep(Pipeline& pipeline, double frame_rate_hz, std::uint64_t frames_expected,
                    PictureTaker* pictures);

/// Four threads; recordings are paced by their own timestamps and drop what comes too late.
rt::Result<double> run_realtime(Pipeline& pipeline, double frame_rate_hz, bool is_live,
                                std::uint64_t frames_expected, hal::Display* display, PictureTaker* pictures);

}  // namespace tactus::firmware
