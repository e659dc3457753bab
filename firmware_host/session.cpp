#include "firmware_host/session.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "firmware_host/machine.hpp"
#include "firmware_host/presenter.hpp"
#include "firmware_host/run_session.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::firmware {
namespace {

constexpr std::array<std::string_view, 3> kAppNames = {"none", "shooting", "plates"};

/// Which of the names; they are checked by the command line.
template <typename Enum, std::size_t kCount>
Enum choice(const std::array<std::string_view, kCount>& names, const std::string& name) {
  return static_cast<Enum>(std::find(names.begin(), names.end(), name) - names.begin());
}

bool has_window_system() {
  const char* name = std::getenv("DISPLAY");
  return name != nullptr && *name != '\0';
}

}  // namespace

interact::App app_of(const RunOptions& options) { return choice<interact::App>(kAppNames, options.app); }

/// A window or, without a window system, the whole screen that was asked for and cannot be had is an error; pictures that
/// cannot be drawn are a warning.
rt::Result<void> Session::open_screen(const hal::Intrinsics& camera) {
  const hal::DisplayFormat format{camera.width, camera.height};
  if (request_.options.display == "window" && !has_window_system()) {
    auto whole = hal::egl::KmsDisplay::create(format);
    if (!whole)
      return rt::Error{whole.error().code,
                       "no window can be opened, as DISPLAY is not set, and " + whole.error().message};
    display_ = &whole_screen_.emplace(std::move(*whole));
    notes_.push_back({Note::Kind::note,
                      "DISPLAY is not set, so pictures were shown on the whole screen; Ctrl-C ends such a run."});
  } else if (request_.options.display == "window") {
    auto window = hal::egl::WindowDisplay::create(format);
    if (!window) return window.error();
    display_ = &window_.emplace(std::move(*window));
  } else if (request_.draws) {
    auto created = hal::egl::OffscreenDisplay::create(format);
    if (created)
      display_ = &offscreen_.emplace(std::move(*created));
    else
      notes_.push_back({Note::Kind::warning, "No pictures were drawn: " + created.error().message});
  }
  return {};
}

/// A film has its sound; a window is heard, too.
void Session::open_mixer() {
  if (request_.movie.empty() && request_.sound.empty() && !is_seen()) return;
  auto created = hal::openal::LoopbackMixer::create();
  if (!created) {
    notes_.push_back({Note::Kind::warning, "No sound: " + created.error().message});
    return;
  }
  mixer_.emplace(std::move(*created));
  if (!mixer_->has_hrtf()) notes_.push_back({Note::Kind::note, "Sound is panned: OpenAL has no HRTF here."});
}

/// Frames of a session that waits for nobody may be dropped by the recording, too; one in lockstep is recorded whole.
rt::Result<void> Session::begin_recording() {
  const RunOptions& options = request_.options;
  if (options.record.empty()) return {};
  hal::record::TacOptions how;
  if (options.record_color == "jpeg") how.color = hal::record::TacColor::jpeg;
  how.waits_when_full = options.runner == "lockstep";
  std::string changes;
  for (const std::string& setting : options.settings) changes += (changes.empty() ? "" : " ") + setting;
  const hal::record::TacInfo info{{{"source", options.source},
                                   {"command", options.command},
                                   {"profile", options.profile},
                                   {"settings", changes},
                                   {"revision", revision()}}};
  hal::Sensor& sensor = source_.sensor;
  auto created = hal::record::TacWriter::create(options.record, sensor, info, how);
  if (!created) return created.error();
  tac_ = std::move(*created);
  sensor.depth->set_tap(tac_.get());
  if (sensor.color) sensor.color->set_tap(tac_.get());
  sensor.buffers_bytes += tac_->buffers_bytes();
  return {};
}

void Session::end_recording() {
  if (tac_ == nullptr) return;
  hal::Sensor& sensor = source_.sensor;
  sensor.depth->set_tap(nullptr);
  if (sensor.color) sensor.color->set_tap(nullptr);
  recording_closed_ = tac_->close();
  const hal::record::TacWriter::Counts counts = tac_->was();
  const auto of = [&](hal::Stream stream) {
    const auto& one = counts.streams[static_cast<std::size_t>(stream)];
    return RecordedStream{one.written, one.dropped + one.refused};
  };
  recording_ = {request_.options.record.string(), counts.file_bytes, of(hal::Stream::depth), of(hal::Stream::color)};
  if (!recording_closed_) notes_.push_back({Note::Kind::warning, recording_closed_.error().message});
  if (const std::uint64_t dropped = recording_->depth.dropped + recording_->color.dropped; dropped > 0)
    notes_.push_back({Note::Kind::warning, std::to_string(dropped) + " frames are missing in " + recording_->file +
                                               ": the disk or the processor was behind."});
}

rt::Result<std::unique_ptr<Session>> Session::open(SessionRequest request) {
  catch_signals();
  std::unique_ptr<Session> session(new Session);
  session->request_ = std::move(request);
  const RunOptions& options = session->request_.options;
  auto settings = read_settings(options.profile, options.settings);
  if (!settings) return settings.error();
  session->settings_ = std::move(*settings);

  // A recording decodes ahead on threads of its own, so that the pipeline's never wait for a disk.
  const bool is_lockstep = options.runner == "lockstep";
  const std::size_t prefetch = is_lockstep ? 0 : 8;
  const auto inject = [&](hal::Sensor& sensor) -> rt::Result<void> {
    if (options.faults.empty()) return {};
    auto plan = hal::faults::load_faults(options.faults.string());
    if (!plan) return plan.error();
    session->faults_ =
        hal::faults::inject(*plan, sensor, is_lockstep ? std::nullopt : std::optional(rt::Clock::monotonic()));
    return {};
  };
  auto source = open_for_pipeline(
      {options.source, {options.frames, prefetch}, options.gravity, options.model}, session->settings_, inject);
  if (!source) return source.error();
  session->source_ = std::move(*source);
  if (auto begun = session->begin_recording(); !begun) return begun.error();
  const hal::RigCalibration& rig = session->source_.sensor.calibration;
  session->camera_ = rig.has_color ? rig.color : rig.depth;

  PipelineSetup setup = setup_for(session->source_, session->settings_);
  setup.collision = choice<contact::Collision>(contact::kCollisionNames, options.collision);
  if (!options.materials.empty()) {
    auto table = contact::load_material_table(options.materials.string());
    if (!table) return table.error();
    setup.materials = *table;
  }
  if (session->request_.script) {
    setup.script = *session->request_.script;
  } else if (options.script.empty()) {
    setup.script = interact::default_script(app_of(options), session->camera_.width, session->camera_.height);
  } else {
    auto script = interact::load_script(options.script.string());
    if (!script) return script.error();
    setup.script = std::move(*script);
  }

  if (auto opened = session->open_screen(session->camera_); !opened) return opened.error();
  session->open_mixer();
  setup.display = session->display_;
  setup.mixer = session->mixer_ ? &*session->mixer_ : nullptr;
  auto booted = BootedPipeline::boot(setup);
  if (!booted) return booted.error();
  session->booted_.emplace(std::move(*booted));
  return session;
}

rt::Result<void> Session::make_recorder() {
  const bool has_files = !request_.movie.empty() || !request_.sound.empty();
  if (!has_files && !is_seen()) return {};
  RecorderConfig config;
  config.movie = request_.movie;
  config.sound = request_.sound;
  config.width_px = camera_.width;
  config.height_px = camera_.height;
  config.frame_rate_hz = source_.sensor.frame_rate_hz;
  config.has_pictures = display_ != nullptr;
  config.has_sound = mixer_.has_value();
  config.plays = is_seen();
  auto created = Recorder::create(config);
  if (!created) return created.error();
  recorder_ = std::move(*created);
  return {};
}

rt::Result<void> Session::play() {
  if (auto made = make_recorder(); !made) return made.error();
  Pipeline& pipeline = *booted_->pipeline;
  const hal::Sensor& sensor = source_.sensor;
  PictureTaker pictures(sensor.frames_count);
  PresenterParts parts;
  parts.display = display_;
  parts.input = window_ ? &*window_ : nullptr;
  parts.recorder = recorder_.get();
  parts.pictures = display_ != nullptr && request_.takes_pictures ? &pictures : nullptr;
  parts.is_seen = is_seen();
  parts.draws_every_frame = is_seen() || has_film();
  parts.app = app_of(request_.options);
  parts.frame_rate_hz = sensor.frame_rate_hz;
  Presenter presenter(parts);
  rt::heap_guard::seal();
  if (request_.options.runner == "lockstep") {
    wall_s_ = run_lockstep(pipeline, sensor.frame_rate_hz, sensor.frames_count, presenter, recorder_.get());
  } else {
    auto ran =
        run_realtime(pipeline, sensor.frame_rate_hz, sensor.is_live, sensor.frames_count, presenter, recorder_.get());
    if (!ran) return ran.error();
    wall_s_ = *ran;
  }
  pipeline.finish_labels();
  rt::heap_guard::unseal();
  end_recording();
  if (recorder_ != nullptr) {
    recorded_ = recorder_->close(pipeline, rt::Clock::monotonic());
    notes_.insert(notes_.end(), recorder_->notes().begin(), recorder_->notes().end());
    if (!recorded_) notes_.push_back({Note::Kind::warning, recorded_.error().message});
  }
  notes_.insert(notes_.end(), presenter.notes().begin(), presenter.notes().end());
  if (parts.pictures != nullptr) pictures_ = pictures.take();
  return {};
}

}  // namespace tactus::firmware
