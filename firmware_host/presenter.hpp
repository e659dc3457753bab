// What the present thread does beside contact: the hand's orders, the picture, and who gets it.
#pragma once

#include <optional>

#include "firmware_host/hand.hpp"
#include "firmware_host/picture_taker.hpp"
#include "firmware_host/recorder.hpp"
#include "hal/display.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

/// The pointees outlive the presenter; null: not there.
struct PresenterParts {
  hal::Display* display = nullptr;
  hal::InputSource* input = nullptr;     // of a window
  Recorder* recorder = nullptr;
  PictureTaker* pictures = nullptr;      // of the report
  bool draws_every_frame = false;        // for a screen or a film; else only what the report takes
  bool is_seen = false;  // on a screen, by somebody: pictures are drawn for when they will be seen
  interact::App app = interact::App::none;
  double frame_rate_hz = 30;
};

/// Present thread.
class Presenter {
 public:
  explicit Presenter(const PresenterParts& parts);

  /// Before contact: what the hand wants.
  void begin_round(Pipeline& pipeline);
  /// After contact: draws the frame that came since the last round, if one did, and passes it on. A display that is lost is
  /// noted and drawn on no more; the session goes on.
  void end_round(Pipeline& pipeline, rt::Clock clock, std::uint64_t frame_number);
  /// At the end of the session, on the same thread.
  void release();

  [[nodiscard]] bool wants_to_end() const { return hand_ && hand_->wants_to_end(); }
  [[nodiscard]] const std::vector<Note>& notes() const { return notes_; }
  [[nodiscard]] std::uint64_t pictures_drawn() const { return pictures_drawn_; }

 private:
  void draw(Pipeline& pipeline, rt::Clock clock);

  PresenterParts parts_;
  std::optional<Hand> hand_;
  std::optional<rt::SensorTime> first_time_;
  std::optional<std::uint64_t> drawn_sequence_;
  bool is_lost_ = false;
  std::uint64_t pictures_drawn_ = 0;
  std::vector<Note> notes_;
};

}  // namespace tactus::firmware
