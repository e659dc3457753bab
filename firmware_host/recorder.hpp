// What a session leaves of its pictures and sounds: a film, a WAV file, and the loudspeaker while it runs.
//
// The present thread offers pictures and never waits: a slot is free or the picture is left out and counted. The record
// thread encodes and mixes, both of which allocate and write files. Sound follows the pictures: when picture i is taken,
// all sound until the end of picture i is mixed, so that film and sound stay together whatever was left out.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "firmware_host/run_result.hpp"
#include "hal/movie/movie_writer.hpp"
#include "hal/openal/playback.hpp"
#include "hal/wav/wav_writer.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/spsc_ring.hpp"

namespace tactus::firmware {

struct RecorderConfig {
  std::filesystem::path movie, sound;  // files; empty: not written
  int width_px = 0, height_px = 0;
  double frame_rate_hz = 30;
  bool has_pictures = false;     // somebody draws
  bool has_sound = false;        // somebody mixes; the film's sound, too
  bool plays = false;            // through the loudspeaker, where there is one
};

class Recorder {
 public:
  /// Boot. What cannot be had (no encoder, no sound card) is a note and left out; an error is a file that cannot be made.
  static rt::Result<std::unique_ptr<Recorder>> create(const RecorderConfig& config);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Copies the picture of frame `index` (0 is the session's first) for the record thread. Without pictures, the moment
  /// alone counts. False when all slots wait: counted. Present thread, wait-free.
  bool offer(std::uint64_t index, std::span<const std::uint8_t> rgb) noexcept;
  /// Takes one offered picture: mixes the sound until its end, writes both. False when none waits. Record thread.
  bool round(Pipeline& pipeline, rt::Clock clock);
  /// Takes all that waits and closes the files; the first failure is the answer. Exit.
  rt::Result<void> close(Pipeline& pipeline, rt::Clock clock);

  [[nodiscard]] bool has_pictures() const { return movie_.has_value(); }
  [[nodiscard]] std::uint64_t pictures_left_out() const { return pictures_left_out_; }
  [[nodiscard]] std::uint64_t pictures_written() const { return pictures_written_; }
  [[nodiscard]] std::vector<Note>& notes() { return notes_; }

 private:
  Recorder() = default;
  void mix_until(std::uint64_t sample_frame, Pipeline& pipeline, rt::Clock clock);

  static constexpr std::size_t kSlots = 4;  // one being filled, one being written, two wait: 66 ms for a slow encoder
  struct Offer {
    std::uint64_t index = 0;
    std::uint32_t slot = 0;
  };
  using OfferRing = rt::SpscRing<Offer, kSlots>;
  using FreeRing = rt::SpscRing<std::uint32_t, kSlots>;

  RecorderConfig config_;
  std::optional<hal::MovieWriter> movie_;
  std::optional<hal::WavFile> wav_;
  std::optional<hal::openal::Playback> playback_;
  std::array<std::vector<std::uint8_t>, kSlots> pictures_;
  OfferRing offered_;
  FreeRing free_;
  std::optional<OfferRing::Producer> offered_in_;
  std::optional<OfferRing::Consumer> offered_out_;
  std::optional<FreeRing::Producer> free_in_;
  std::optional<FreeRing::Consumer> free_out_;
  std::vector<float> block_;            // two samples a sample frame
  std::uint64_t sample_frames_mixed_ = 0;
  std::uint64_t pictures_left_out_ = 0;  // present thread
  std::uint64_t pictures_written_ = 0;   // record thread
  std::vector<Note> notes_;
};

}  // namespace tactus::firmware
