#include "firmware_host/run.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>

#include "firmware_host/first_pose.hpp"
#include "firmware_host/open_source.hpp"
#include "firmware_host/run_labels.hpp"
#include "firmware_host/run_outputs.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/run_settings.hpp"
#include "hal/egl/offscreen.hpp"
#include "hal/egl/x11_window.hpp"
#include "hal/openal/loopback_mixer.hpp"
#include "rt/arena.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::firmware {
namespace {

constexpr std::array<std::string_view, 3> kAppNames = {"none", "shooting", "plates"};

/// Which of the names; they are checked by the command line.
template <typename Enum, std::size_t kCount>
Enum choice(const std::array<std::string_view, kCount>& names, const std::string& name) {
  return static_cast<Enum>(std::find(names.begin(), names.end(), name) - names.begin());
}

/// What shows the pictures and takes a hand's orders. Neither: nothing is drawn.
struct Screen {
  std::optional<hal::egl::OffscreenDisplay> offscreen;
  std::optional<hal::egl::WindowDisplay> window;

  [[nodiscard]] hal::Display* display() {
    if (window) return &*window;
    return offscreen ? &*offscreen : nullptr;
  }
};

/// A window that was asked for and cannot be had is an error; pictures that cannot be drawn are a warning.
rt::Result<Screen> open_screen(const RunOptions& options, const hal::Intrinsics& camera, std::vector<Note>& notes) {
  Screen screen;
  const hal::DisplayFormat format{camera.width, camera.height};
  if (options.display == "window") {
    auto window = hal::egl::WindowDisplay::create(format);
    if (!window) return window.error();
    screen.window.emplace(std::move(*window));
  } else if (!options.out.empty()) {
    auto created = hal::egl::OffscreenDisplay::create(format);
    if (created)
      screen.offscreen.emplace(std::move(*created));
    else
      notes.push_back({Note::Kind::warning, "No pictures were drawn: " + created.error().message});
  }
  return screen;
}

}  // namespace

rt::Result<std::string> run(const RunOptions& options) {
  // Configuration.
  auto settings = read_settings(options.profile, options.settings);
  if (!settings) return settings.error();
  const bool is_lockstep = options.runner == "lockstep";

  // Sensor. A recording decodes ahead on threads of its own, so that the pipeline's never wait for a disk.
  SourceOptions source;
  source.frames = options.frames;
  source.prefetch = is_lockstep ? 0 : 8;
  auto sensor = open_source(options.source, source);
  if (!sensor) return sensor.error();
  if (auto supported = check_depth_size(options.source, *sensor); !supported) return supported.error();
  const auto gravity = find_gravity(options.gravity, *sensor);
  if (!gravity) return gravity.error();
  auto labels = choose_labels(options.source, options.model, *settings, *sensor);
  if (!labels) return labels.error();

  // What happens in the room.
  PipelineSetup setup;
  setup.profile = settings->profile;
  setup.sensor = &*sensor;
  setup.T_world_first = level_pose(gravity->direction_depth);
  setup.model = labels->model ? &labels->model->model : nullptr;
  setup.class_map = &labels->class_map;
  setup.labels_from_source = labels->from_source;
  setup.frames_expected = sensor->frames_count;
  setup.collision = choice<contact::Collision>(contact::kCollisionNames, options.collision);
  setup.light = settings->light;
  if (options.materials.empty()) {
    setup.materials = contact::default_material_table();
  } else {
    auto table = contact::load_material_table(options.materials.string());
    if (!table) return table.error();
    setup.materials = *table;
  }
  const hal::Intrinsics& camera =
      sensor->calibration.has_color ? sensor->calibration.color : sensor->calibration.depth;
  const auto app = choice<interact::App>(kAppNames, options.app);
  if (options.script.empty()) {
    setup.script = interact::default_script(app, camera.width, camera.height);
  } else {
    auto script = interact::load_script(options.script.string());
    if (!script) return script.error();
    setup.script = std::move(*script);
  }

  // Pictures and sounds. An app leaves a film and its sound; a window is heard, too.
  std::vector<Note> notes;
  auto screen = open_screen(options, camera, notes);
  if (!screen) return screen.error();
  setup.display = screen->display();
  const bool is_window = screen->window.has_value();
  const bool has_film = app != interact::App::none && !options.out.empty();
  std::optional<hal::openal::LoopbackMixer> mixer;
  if (has_film || is_window) {
    auto created = hal::openal::LoopbackMixer::create();
    if (created) {
      mixer.emplace(std::move(*created));
      setup.mixer = &*mixer;
      if (!mixer->has_hrtf()) notes.push_back({Note::Kind::note, "Sound is panned: OpenAL has no HRTF here."});
    } else {
      notes.push_back({Note::Kind::warning, "No sound: " + created.error().message});
    }
  }

  // Memory: planned, reserved, touched, handed out, sealed.
  rt::MemoryPlan plan;
  if (auto planned = Pipeline::plan(setup, plan); !planned) return planned.error();
  auto arena = rt::Arena::reserve(plan.arena_bytes());
  if (!arena) return arena.error();
  plan.carve(*arena);
  auto pipeline = std::make_unique<Pipeline>();
  if (auto bound = pipeline->bind(setup, plan); !bound) return bound.error();
  arena->seal();

  // Outputs are opened before the session: a folder that cannot be written must not cost a session.
  auto outputs = RunOutputs::create(options.out);
  if (!outputs) return outputs.error();
  std::unique_ptr<Recorder> recorder;
  if (has_film || is_window) {
    RecorderConfig config;
    config.folder = has_film ? options.out : std::filesystem::path();
    config.width_px = camera.width;
    config.height_px = camera.height;
    config.frame_rate_hz = sensor->frame_rate_hz;
    config.has_pictures = setup.display != nullptr;
    config.has_sound = mixer.has_value();
    config.plays = is_window;
    auto created = Recorder::create(config);
    if (!created) return created.error();
    recorder = std::move(*created);
  }

  // The session.
  catch_signals();
  PictureTaker pictures(sensor->frames_count);
  PresenterParts parts;
  parts.display = setup.display;
  parts.input = is_window ? &*screen->window : nullptr;
  parts.recorder = recorder.get();
  parts.pictures = setup.display != nullptr && !options.out.empty() ? &pictures : nullptr;
  parts.draws_every_frame = is_window || (recorder != nullptr && recorder->has_pictures());
  parts.app = app;
  parts.frame_rate_hz = sensor->frame_rate_hz;
  Presenter presenter(parts);
  rt::heap_guard::seal();
  double wall_s = 0;
  if (is_lockstep) {
    wall_s = run_lockstep(*pipeline, sensor->frame_rate_hz, sensor->frames_count, presenter, recorder.get());
  } else {
    auto ran = run_realtime(*pipeline, sensor->frame_rate_hz, false, sensor->frames_count, presenter, recorder.get());
    if (!ran) return ran.error();
    wall_s = *ran;
  }
  pipeline->finish_labels();
  rt::heap_guard::unseal();
  rt::Result<void> recorded;
  if (recorder != nullptr) {
    recorded = recorder->close(*pipeline, rt::Clock::monotonic());
    notes.insert(notes.end(), recorder->notes().begin(), recorder->notes().end());
  }
  notes.insert(notes.end(), presenter.notes().begin(), presenter.notes().end());

  // What came of it.
  RunFacts facts{&options,
                 &*settings,
                 &*labels,
                 &plan,
                 &*arena,
                 gravity->origin,
                 wall_s,
                 parts.pictures != nullptr ? pictures.take() : std::vector<Picture>{},
                 std::move(notes)};
  if (recorder != nullptr) facts.pictures_recorded = recorder->pictures_written();
  auto written = outputs->write(facts, *pipeline, *sensor);
  // A film that failed does not keep the rest from being written.
  if (written && !recorded) return recorded.error();
  return written;
}

}  // namespace tactus::firmware
