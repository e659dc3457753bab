// One session of the product from its options to the end of the source: what `tactus run` does before it
// writes its files, and what the user study's commands do once a condition.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "firmware_host/boot.hpp"
#include "firmware_host/options.hpp"
#include "firmware_host/recorder.hpp"
#include "firmware_host/run_result.hpp"
#include "firmware_host/run_settings.hpp"
#include "hal/egl/kms_display.hpp"
#include "hal/egl/offscreen.hpp"
#include "hal/egl/x11_window.hpp"
#include "hal/faults/faults.hpp"
#include "hal/openal/loopback_mixer.hpp"
#include "hal/record/tac_writer.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

struct SessionRequest {
  RunOptions options;                      // what of it names files and formats of outputs is not looked at
  std::optional<interact::Script> script;  // instead of the options' or the app's own
  bool draws = false;                      // without a window, too; a window always does
  bool takes_pictures = false;             // for a report
  std::filesystem::path movie, sound;      // empty: not written
};

/// interact::App by the name on the command line, which has checked it.
interact::App app_of(const RunOptions& options);

/// Everything a session holds; not movable, the parts point to each other. One at a time in a process: ODE's
/// memory is the process's.
class Session {
 public:
  /// Configuration, source, screen, sound, memory, in this order; nothing is written yet. Errors: one
  /// sentence. Boot.
  static rt::Result<std::unique_ptr<Session>> open(SessionRequest request);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Creates the film's files and plays to the source's end, or until SIGINT or SIGTERM. An error: nothing
  /// was played. Once.
  rt::Result<void> play();

  /// Whether film and sound could be written to their end.
  [[nodiscard]] const rt::Result<void>& recorded() const { return recorded_; }
  [[nodiscard]] std::uint64_t pictures_recorded() const {
    return recorder_ ? recorder_->pictures_written() : 0;
  }
  /// Whether the film has pictures; without, notes() says why.
  [[nodiscard]] bool has_film() const { return recorder_ && recorder_->has_pictures(); }
  /// Files of the film and of its sound that are whole; empty where there are none.
  [[nodiscard]] std::string film_name() const {
    return has_film() && recorded_ ? request_.movie.filename().string() : std::string();
  }
  [[nodiscard]] std::string sound_name() const {
    return mixer_ && recorded_ ? request_.sound.filename().string() : std::string();
  }
  /// What --record left; nothing without. Whether all of it could be written.
  [[nodiscard]] const std::optional<RecordingResult>& recording() const { return recording_; }
  [[nodiscard]] const rt::Result<void>& recording_closed() const { return recording_closed_; }
  [[nodiscard]] double wall_s() const { return wall_s_; }
  [[nodiscard]] std::vector<Note>& notes() { return notes_; }
  [[nodiscard]] std::vector<Picture>& pictures() { return pictures_; }

  [[nodiscard]] const RunOptions& options() const { return request_.options; }
  [[nodiscard]] const RunSettings& settings() const { return settings_; }
  [[nodiscard]] const OpenedSource& source() const { return source_; }
  /// What was done to the cameras on purpose; null: nothing was asked for.
  [[nodiscard]] const hal::faults::FaultCounts* faults() const { return faults_.get(); }
  [[nodiscard]] BootedPipeline& booted() { return *booted_; }
  [[nodiscard]] const Pipeline& pipeline() const { return *booted_->pipeline; }

 private:
  Session() = default;
  [[nodiscard]] bool is_seen() const { return window_ || whole_screen_; }
  rt::Result<void> open_screen(const hal::Intrinsics& camera);
  void open_mixer();
  rt::Result<void> make_recorder();
  rt::Result<void> begin_recording();
  void end_recording();

  SessionRequest request_;
  RunSettings settings_;
  std::unique_ptr<hal::record::TacWriter> tac_;  // outlives the cameras, whose tap it is
  OpenedSource source_;
  std::shared_ptr<const hal::faults::FaultCounts> faults_;
  std::optional<hal::egl::OffscreenDisplay> offscreen_;
  std::optional<hal::egl::WindowDisplay> window_;
  std::optional<hal::egl::KmsDisplay> whole_screen_;  // without a window system; nobody gives orders there
  std::optional<hal::openal::LoopbackMixer> mixer_;
  hal::Display* display_ = nullptr;  // one of the three, or none
  hal::Intrinsics camera_;           // of the pictures
  std::optional<BootedPipeline> booted_;
  std::unique_ptr<Recorder> recorder_;
  rt::Result<void> recorded_;
  std::optional<RecordingResult> recording_;
  rt::Result<void> recording_closed_;
  double wall_s_ = 0;
  std::vector<Picture> pictures_;
  std::vector<Note> notes_;
};

}  // namespace tactus::firmware
