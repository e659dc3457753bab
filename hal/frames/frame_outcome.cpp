#include "hal/frames/frame_outcome.hpp"

#include <algorithm>
#include <cstring>

namespace tactus::hal::frames {

void say(FrameOutcome& outcome, std::string_view sentence) {
  if (outcome.sentence[0] != '\0') return;
  const std::size_t bytes = std::min(sentence.size(), outcome.sentence.size() - 1);
  std::memcpy(outcome.sentence.data(), sentence.data(), bytes);
  outcome.sentence[bytes] = '\0';
}

void count_passed_over(const FrameOutcome& outcome, CameraCounters& counters) {
  counters.timestamps_rejected += outcome.timestamps_rejected;
  if (counters.first_rejection.empty() && outcome.sentence[0] != '\0')
    counters.first_rejection.assign(outcome.sentence.data());
}

void count(const FrameOutcome& outcome, CameraCounters& counters) {
  count_passed_over(outcome, counters);
  if (outcome.status == rt::Status::ok) ++counters.frames_delivered;
  if (outcome.status == rt::Status::corrupt) ++counters.frames_rejected;
}

}  // namespace tactus::hal::frames
