#include "firmware_host/run.hpp"

#include <filesystem>

#include "firmware_host/first_pose.hpp"
#include "firmware_host/open_source.hpp"
#include "firmware_host/run_labels.hpp"
#include "firmware_host/run_outputs.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/run_settings.hpp"
#include "hal/egl/offscreen.hpp"
#include "rt/arena.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::firmware {
namespace {

// Without a script: a ball is dropped onto the nearest surface, and three are tossed along the view, so that
// something lands in sight whatever the camera looks at.
std::vector<interact::Throw> built_in_throws() {
  std::vector<interact::Throw> throws = interact::default_drop_script();
  constexpr struct {
    std::int64_t at_ms;
    std::string_view material;
    double speed;
  } kTosses[] = {{500, "plastic", 2.6}, {1200, "wood", 3.0}, {2000, "leather", 3.4}};
  for (const auto& toss : kTosses) {
    interact::Throw ball;
    ball.at_time = rt::Duration{toss.at_ms * 1'000'000};
    ball.shape = contact::Shape::sphere(0.08);
    ball.material = material_from_name(toss.material);
    ball.in_front_m = 0.6;
    ball.speed_m_per_s = toss.speed;
    throws.push_back(ball);
  }
  return throws;
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
  setup.collision = options.collision == "none"      ? Collision::none
                    : options.collision == "uniform" ? Collision::uniform
                                                     : Collision::semantic;
  if (options.materials.empty()) {
    setup.materials = contact::default_material_table();
  } else {
    auto table = contact::load_material_table(options.materials.string());
    if (!table) return table.error();
    setup.materials = *table;
  }
  if (options.script.empty()) {
    setup.throws = built_in_throws();
  } else {
    auto script = interact::load_drop_script(options.script.string());
    if (!script) return script.error();
    setup.throws = std::move(*script);
  }
  std::optional<hal::egl::OffscreenDisplay> display;
  std::vector<Note> notes;
  if (!options.out.empty()) {
    const hal::Intrinsics& camera =
        sensor->calibration.has_color ? sensor->calibration.color : sensor->calibration.depth;
    auto created = hal::egl::OffscreenDisplay::create({camera.width, camera.height});
    if (created) {
      display.emplace(std::move(*created));
      setup.display = &*display;
    } else {
      notes.push_back({Note::Kind::warning, "No pictures were drawn: " + created.error().message});
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

  // The session.
  catch_signals();
  PictureTaker pictures(sensor->frames_count);
  PictureTaker* taker = display ? &pictures : nullptr;
  rt::heap_guard::seal();
  double wall_s = 0;
  if (is_lockstep) {
    wall_s = run_lockstep(*pipeline, sensor->frame_rate_hz, sensor->frames_count, taker);
  } else {
    auto ran =
        run_realtime(*pipeline, sensor->frame_rate_hz, false, sensor->frames_count, setup.display, taker);
    if (!ran) return ran.error();
    wall_s = *ran;
  }
  pipeline->finish_labels();
  rt::heap_guard::unseal();

  // What came of it.
  RunFacts facts{
      &options,        &*settings,      &*labels, &plan,
      &*arena,         gravity->origin, wall_s,   display ? pictures.take() : std::vector<Picture>{},
      std::move(notes)};
  return outputs->write(facts, *pipeline, *sensor);
}

}  // namespace tactus::firmware
