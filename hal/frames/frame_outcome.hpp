// What a decoder says of one frame, without a heap call for whoever counts it.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/camera.hpp"

namespace tactus::hal::frames {

/// Room for one sentence about a rejected frame; longer ones are cut.
inline constexpr std::size_t kSentenceBytes = 512;

/// What became of one read: at most one frame, and the entries passed over before it.
struct FrameOutcome {
  rt::Status status = rt::Status::end_of_stream;  // ok | corrupt | end_of_stream
  FrameHeader header;
  std::uint64_t timestamps_rejected = 0;
  std::array<char, kSentenceBytes> sentence{};  // the first rejection among them; empty when none
};

/// Adds what was passed over before the frame to the counters.
void count_passed_over(const FrameOutcome& outcome, CameraCounters& counters);

/// Adds an outcome to the counters. No heap call once `first_rejection` has reserved kSentenceBytes.
void count(const FrameOutcome& outcome, CameraCounters& counters);

/// Keeps the first sentence, cut to kSentenceBytes.
void say(FrameOutcome& outcome, std::string_view sentence);

}  // namespace tactus::hal::frames
