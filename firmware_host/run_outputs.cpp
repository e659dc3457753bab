#include "firmware_host/run_outputs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/machine.hpp"
#include "firmware_host/mesh_ply.hpp"
#include "firmware_host/report.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/stored_map.hpp"
#include "firmware_host/summary.hpp"
#include "firmware_host/trace.hpp"
#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/mesh.hpp"
#include "pipeline/render/map_view.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::firmware {

std::uint64_t map_hash(const map::Map::Hash& hash) { return hash.geometry ^ (hash.labels * 1099511628211ull); }

namespace {

LatencySummary summary_of(const rt::Histogram& histogram) {
  LatencySummary s;
  s.count = histogram.count();
  if (s.count == 0) return s;
  s.p50 = histogram.percentile(0.50).milliseconds();
  s.p99 = histogram.percentile(0.99).milliseconds();
  s.max = histogram.max().milliseconds();
  s.mean = histogram.sum().milliseconds() / static_cast<double>(s.count);
  return s;
}

void add_stages(RunResult& result, const Pipeline& pipeline) {
  for (const StageBudget& budget : kBudgets) {
    const rt::StageRecord& record = pipeline.record(budget.stage);
    StageResult stage;
    stage.name = budget.name;
    stage.thread = budget.thread;
    stage.latency_ms = summary_of(record.latency);
    stage.budget_p99_ms = budget.p99.milliseconds();
    stage.budget_max_ms = budget.max.milliseconds();
    stage.skipped_count = record.statuses.was(rt::Status::skipped);
    stage.late_count = record.statuses.was(rt::Status::late);
    const auto series = pipeline.series_ms(budget.stage);
    if (std::string_view(budget.thread) == "spine") stage.frame_ms.assign(series.begin(), series.end());
    result.stages.push_back(std::move(stage));
  }
  const auto frames = pipeline.frame_series_ms();
  result.frame_ms.assign(frames.begin(), frames.end());
  result.frame_latency_ms = summarise_latency(frames);
  result.frame_budget_ms = kFrameBudget.milliseconds();
}

void add_memory(RunResult& result, const RunFacts& facts, const Pipeline& pipeline) {
  const map::Map& map = pipeline.spine().map();
  for (const rt::MemoryRow& row : facts.plan->rows()) {
    MemoryResult memory;
    memory.name = row.name;
    memory.owner = row.owner;
    memory.planned_bytes = row.bytes();
    memory.is_outside_arena = row.is_outside_arena;
    std::string holders;
    if (row.holders.size() > 1)
      for (const rt::Holder& holder : row.holders)
        holders +=
            (holders.empty() ? "" : " + ") + std::string(holder.name) + " " + std::to_string(holder.count);
    memory.why = row.why + (holders.empty() ? std::string() : " (" + holders + ")");
    if (memory.name == "map")
      memory.high_water_bytes = static_cast<std::uint64_t>(
          static_cast<double>(row.bytes()) * map.counters().used_high_water / map.config().blocks_capacity);
    if (memory.name == "network" && pipeline.segmenter() != nullptr)
      memory.high_water_bytes = pipeline.segmenter()->network().use().pool_bytes;
    result.memory.push_back(std::move(memory));
  }
  result.resident_bytes_peak = resident_bytes_peak();
  result.memory_was_locked = facts.arena->is_locked();
  result.heap_allocations_after_seal = rt::heap_guard::was_total_calls();
  result.heap_allocations_in_guests = rt::heap_guard::was_guest_calls();
  result.heap_allocations_elsewhere = rt::heap_guard::was_other_calls();
}

std::vector<InjectedFault> injected_faults(const hal::faults::FaultCounts& counts) {
  std::vector<InjectedFault> injected;
  for (std::size_t i = 0; i < hal::faults::kFaultKinds; ++i) {
    const auto kind = static_cast<hal::faults::FaultKind>(i);
    const InjectedFault fault{std::string(hal::faults::kFaultNames[i]), counts.of(hal::Stream::depth, kind),
                              counts.of(hal::Stream::color, kind)};
    if (fault.depth + fault.color > 0) injected.push_back(fault);
  }
  return injected;
}

/// What never came. A camera that rejects a frame leaves a gap in the numbers, too.
std::uint64_t missing_of(const hal::CameraCounters& camera, const IntakeCounts& intake) {
  const std::uint64_t rejected = camera.frames_rejected + camera.timestamps_rejected + intake.out_of_order;
  return intake.gaps > rejected ? intake.gaps - rejected : 0;
}

void add_sensor(RunResult& result, const Pipeline& pipeline, const hal::Sensor& sensor) {
  const PipelineCounts& counts = pipeline.counts();
  const hal::CameraCounters& depth = sensor.depth->counters();
  // Frames that the camera passed over for their time were never handed out.
  result.frames.in = counts.frames_in + depth.timestamps_rejected;
  result.frames.tracked = counts.frames_tracked;
  result.frames.dropped = counts.frames_dropped;
  result.frames.lost = counts.frames_lost;
  result.frames.rejected = counts.frames_corrupt + counts.frames_stale + depth.timestamps_rejected;
  result.frames.missing = missing_of(depth, pipeline.depth_intake());
  SensorResult& s = result.sensor;
  s.is_live = sensor.is_live;
  s.losses = depth.losses;
  s.timeouts = counts.capture_timeouts;
  s.buffers_bytes = sensor.buffers_bytes;
  s.depth = pipeline.depth_intake();
  s.color = pipeline.color_intake();
  if (sensor.color != nullptr) {
    const hal::CameraCounters& color = sensor.color->counters();
    s.losses += color.losses;
    s.color_rejected = color.frames_rejected + color.timestamps_rejected + s.color.rejected();
    s.color_missing = missing_of(color, s.color);
  }
  const Pairing& pairing = pipeline.pairing();
  s.paired = pairing.paired();
  s.colors_unpaired = pairing.colors_unpaired();
  s.depths_unpaired = pairing.depths_unpaired();
  s.skew_ms_counts = pairing.skew_ms_counts();
  s.skew_ms = summary_of(pairing.distance());
  s.depth_drift_ppm = pairing.depth_clock().drift_ppm();
  s.color_drift_ppm = pairing.color_clock().drift_ppm();
  s.arrival_to_read_ms = summary_of(pipeline.arrival_latency());
}

void add_map(RunResult& result, const map::Map& map) {
  const map::MapConfig& config = map.config();
  result.map.blocks_used = map.blocks_used();
  result.map.blocks_capacity = config.blocks_capacity;
  result.map.evicted = map.counters().evicted;
  result.map.bytes_per_voxel = map::Map::bytes_per_voxel(config);
  result.map.voxel_size_m = static_cast<double>(config.voxel_size_m);
  result.map.truncation_m = static_cast<double>(config.truncation_m);
  const map::Map::Hash hash = map.hash_content();
  result.geometry_hash = hash.geometry;
  result.label_hash = hash.labels;
  result.map_hash = map_hash(hash);
}

void add_labels(RunResult& result, const RunFacts& facts, const Pipeline& pipeline, const map::Mesh& mesh) {
  result.labels.model = facts.labels->name;
  result.labels.keyframes_segmented = pipeline.counts().keyframes_segmented;
  result.labels.keyframes_replaced = pipeline.counts().keyframes_replaced;
  auto ages = std::vector<float>(pipeline.label_ages_ms().begin(), pipeline.label_ages_ms().end());
  result.labels.age_ms_p50 = summarise_latency(ages).p50;
  if (pipeline.refiner() != nullptr) result.labels.refined = pipeline.refiner()->counters();
  std::array<std::uint64_t, kMaterialCount + 1> count{};
  std::array<double, kMaterialCount + 1> probability{};
  for (const map::MeshVertex& v : mesh.vertices) {
    const std::size_t i = v.label < kMaterialCount ? v.label : std::size_t{kMaterialCount};
    ++count[i];
    probability[i] += static_cast<double>(v.confidence);
  }
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (count[i] == 0) continue;
    const auto n = static_cast<double>(count[i]);
    result.labels.surface.push_back({i < kMaterialCount ? static_cast<MaterialId>(i) : kUnknownMaterial,
                                     n / static_cast<double>(mesh.vertices.size()), probability[i] / n});
  }
  std::sort(result.labels.surface.begin(), result.labels.surface.end(),
            [](const LabelResult& a, const LabelResult& b) { return a.surface_share > b.surface_share; });
}

std::string material_text(MaterialId id) {
  return id < kMaterialCount ? std::string(kMaterialNames[id]) : std::string("unknown");
}

std::string walk_text(interact::AgentState state) {
  if (state == interact::AgentState::arrived) return "arrives";
  return state == interact::AgentState::stuck ? "finds no way" : "is put down";
}

RunEvent run_event(const interact::GameEvent& game) {
  RunEvent event;
  event.time = game.frame.time;
  event.frame = game.frame.sequence;
  event.kind = interact::kGameEventNames[static_cast<std::size_t>(game.kind)];
  event.position_world_m = game.position_world_m;
  if (game.order_index >= 0) event.values.emplace_back("order", game.order_index);
  if (game.kind != interact::GameEventKind::shot) event.body_material = game.body_material;
  switch (game.kind) {
    case interact::GameEventKind::thrown:
      event.text = material_text(game.body_material) + " is thrown";
      event.values.emplace_back("body", game.body_index);
      event.values.emplace_back("speed_m_per_s", game.impact_speed_m_per_s);
      return event;
    case interact::GameEventKind::shot:
      event.text = "a shot";
      event.values.emplace_back("energy_j", game.energy_j);
      return event;
    case interact::GameEventKind::walk:
      event.text = "a walker " + walk_text(game.walker_state) + " on " + material_text(game.material);
      event.material = game.material;
      event.values.emplace_back("probability", static_cast<double>(game.probability));
      event.values.emplace_back("walked_m", game.walked_m);
      return event;
    case interact::GameEventKind::contact:
    case interact::GameEventKind::broke: event.values.emplace_back("body", game.body_index); break;
    case interact::GameEventKind::hit: break;
  }
  event.outcome = contact::kOutcomeNames[static_cast<std::size_t>(game.outcome)];
  event.text =
      material_text(game.body_material) + " on " + material_text(game.material) + ": " + event.outcome;
  event.material = game.material;
  event.values.emplace_back("probability", static_cast<double>(game.probability));
  event.values.emplace_back("impulse_n_s", game.impulse_n_s);
  event.values.emplace_back("impact_speed_m_per_s", game.impact_speed_m_per_s);
  event.values.emplace_back("energy_j", game.energy_j);
  if (game.chips_count > 0) {
    event.values.emplace_back("chips", game.chips_count);
    event.values.emplace_back("chips_mass_kg", game.chips_mass_kg);
    event.values.emplace_back("chips_speed_m_per_s", game.chips_speed_m_per_s);
  }
  if (game.mark_index >= 0) event.values.emplace_back("mark", game.mark_index);
  return event;
}

void add_events(RunResult& result, const Pipeline& pipeline) {
  for (const interact::GameEvent& event : pipeline.game().events()) result.events.push_back(run_event(event));
  const interact::GameCounters& counters = pipeline.game().counters();
  GameResult& game = result.game;
  game.throws = counters.throws;
  game.shots = counters.shots;
  game.misses = counters.misses;
  game.broken = counters.broken;
  game.chips = counters.chips;
  game.marks = counters.marks;
  game.orders_refused = counters.orders_refused;
  game.events_dropped = counters.events_dropped;
  const interact::Walkers& walkers = pipeline.game().walkers();
  game.walkers = walkers.counters().placed;
  game.goals_reached = walkers.counters().arrivals;
  game.stuck = walkers.counters().stuck;
  game.walked_m = walkers.walked_m();
  const sound::SoundCounts& sounds = pipeline.sound().counts();
  game.sounds = sounds.sounds;
  game.reflections = sounds.reflections;
  game.sounds_left_out = sounds.left_out + counters.cues_dropped + pipeline.counts().cues_dropped;
}

/// Virtual things a finger's length to an arm's beyond the hand: where an overlay's error is looked at.
constexpr double kOverlayDepthM = 2;

void add_display(RunResult& result, const RunFacts& facts, const Pipeline& pipeline, const hal::Sensor& sensor) {
  DisplayResult& display = result.display;
  display.pictures_recorded = facts.pictures_recorded;
  display.film = facts.film;
  display.sound = facts.sound;
  display.camera_to_photon_ms = summary_of(pipeline.photon_latency());
  std::vector<evaluate::StampedPose> predicted;
  for (const TrackedPose& pose : pipeline.predictions()) predicted.push_back({pose.time, pose.T_world_depth});
  const hal::Intrinsics& camera = sensor.calibration.depth;
  display.predicted_to_tracked =
      evaluate::overlay_error(predicted, result.trajectory, {}, camera, kOverlayDepthM);
  if (!result.accuracy) return;
  const evaluate::Alignment& aligned = result.accuracy->T_truth_estimate_first;
  display.predicted_to_truth = evaluate::overlay_error(predicted, result.truth, aligned, camera, kOverlayDepthM);
  display.tracked_to_truth = evaluate::overlay_error(result.trajectory, result.truth, aligned, camera, kOverlayDepthM);
}

// The model as tracking saw it last, in two pictures: shape, and colour of the map.
void add_model_pictures(RunResult& result, const Pipeline& pipeline) {
  const map::ModelView& model = pipeline.spine().model();
  Picture shape;
  shape.title = "The model from the last pose";
  shape.caption = "Normals of the predicted view; black where no smooth surface is known.";
  shape.width = model.camera.width;
  shape.height = model.camera.height;
  shape.rgb.resize(model.z_m.size() * 3);
  for (std::size_t i = 0; i < model.z_m.size(); ++i) {
    const float n[3] = {model.nx[i], model.ny[i], model.nz[i]};
    for (std::size_t c = 0; c < 3; ++c)
      shape.rgb[i * 3 + c] = n[2] < 0
                                 ? static_cast<std::uint8_t>((c == 2 ? -n[c] : 0.5f + 0.5f * n[c]) * 255.0f)
                                 : std::uint8_t{0};
  }
  result.pictures.push_back(std::move(shape));
}

rt::Result<void> write_mesh(const std::filesystem::path& file, const map::Mesh& mesh) {
  auto writer = MeshPlyWriter::create(file);
  if (!writer) return writer.error();
  std::vector<Vec3f> positions, normals;
  std::vector<Rgb8> colors;
  std::vector<MaterialId> labels;
  std::vector<float> confidences;
  for (const map::MeshVertex& v : mesh.vertices) {
    positions.push_back(v.position_world_m);
    normals.push_back(v.normal_world);
    colors.push_back(v.color);
    labels.push_back(v.label);
    confidences.push_back(v.confidence);
  }
  writer->append_vertices({positions, normals, colors, labels, confidences});
  writer->append_triangles(mesh.triangles);
  return writer->close();
}

std::vector<TraceRecord> trace_records(const Pipeline& pipeline) {
  std::vector<TraceRecord> records;
  for (std::uint32_t thread = 0; thread < Pipeline::kThreadNames.size(); ++thread)
    pipeline.trace(thread).for_each([&](const rt::TraceRecord& r) {
      TraceRecord record;
      record.kind = r.kind == rt::TraceKind::counter   ? TraceRecord::Kind::counter
                    : r.kind == rt::TraceKind::instant ? TraceRecord::Kind::instant
                                                       : TraceRecord::Kind::span;
      record.name = r.name;
      record.thread = thread;
      record.start_ns = r.start.ns;
      record.duration_ns = r.duration.ns;
      record.value = static_cast<double>(r.value);
      records.push_back(record);
    });
  return records;
}

std::string headline(const RunResult& r, const std::filesystem::path& folder) {
  std::array<char, 512> line{};
  std::snprintf(
      line.data(), line.size(),
      "%llu frames: %llu tracked, %llu lost, %llu dropped; frame %.1f ms (p50) %.1f ms (p99); map %llu of "
      "%llu "
      "blocks; %llu keyframes labelled; %zu events; %llu heap calls after seal.\n",
      static_cast<unsigned long long>(r.frames.in), static_cast<unsigned long long>(r.frames.tracked),
      static_cast<unsigned long long>(r.frames.lost), static_cast<unsigned long long>(r.frames.dropped),
      r.frame_latency_ms.p50, r.frame_latency_ms.p99, static_cast<unsigned long long>(r.map.blocks_used),
      static_cast<unsigned long long>(r.map.blocks_capacity),
      static_cast<unsigned long long>(r.labels.keyframes_segmented), r.events.size(),
      static_cast<unsigned long long>(r.heap_allocations_after_seal));
  std::string text = line.data();
  if (r.accuracy) {
    std::snprintf(line.data(), line.size(),
                  "ATE RMSE against the known path: %.2f mm aligned at the first pose, %.2f mm rigid.\n",
                  r.accuracy->ate_first_pose_m.rmse * 1e3, r.accuracy->ate_rigid_m.rmse * 1e3);
    text += line.data();
  }
  for (const Note& note : r.notes) text += note.text + "\n";
  if (!folder.empty()) text += "Report: " + (folder / "report.html").string() + "\n";
  return text;
}

// Surface counts as mapped once it has the weight of one close look or of a second of far ones (32), in short
// runs that of a quarter of the frames. What was seen less is mostly the far side of edges: over 300 frames
// of the noisy bedroom the mean error is 1.3 mm with it and 4.4 mm without.
std::uint8_t exported_weight_min(std::size_t frames_count) {
  return static_cast<std::uint8_t>(std::clamp<std::size_t>(frames_count / 4, 1, 32));
}

}  // namespace

rt::Result<RunOutputs> RunOutputs::create(const std::filesystem::path& folder) {
  RunOutputs outputs;
  outputs.folder_ = folder;
  if (folder.empty()) return outputs;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return rt::Error{rt::ExitCode::bad_usage,
                     "--out " + folder.string() + " cannot be made: " + error.message() + "."};
  if (auto written = write_trajectory(folder / "trajectory.txt", {}); !written) return written.error();
  return outputs;
}

rt::Result<std::string> RunOutputs::write(const RunFacts& facts, const Pipeline& pipeline,
                                          const hal::Sensor& sensor) {
  const map::Map& map = pipeline.spine().map();
  RunResult result;
  result.source = facts.options->source;
  result.description = sensor.description;
  result.runner = facts.options->runner;
  result.profile = facts.settings->profile_name;
  result.app = facts.options->app;
  result.collision = facts.options->collision;
  result.command = facts.options->command;
  result.date = date_and_time_utc();
  result.revision = revision();
  result.machine = describe_machine();
  result.threads_count = facts.settings->profile.threads_count;
  result.width = sensor.calibration.depth.width;
  result.height = sensor.calibration.depth.height;
  result.frame_rate_hz = sensor.frame_rate_hz;
  result.wall_s = facts.wall_s;
  result.gravity_origin = facts.gravity_origin;
  for (const std::string& note : sensor.notes) result.notes.push_back({Note::Kind::note, note});
  result.was_interrupted = interrupted.load();
  add_sensor(result, pipeline, sensor);
  result.recording = facts.recording;
  if (facts.faults != nullptr) result.faults = injected_faults(*facts.faults);
  result.keyframes = pipeline.counts().keyframes;
  result.relocalisations = pipeline.counts().relocalisations;
  add_stages(result, pipeline);
  add_memory(result, facts, pipeline);
  add_map(result, map);
  for (const TrackedPose& pose : pipeline.trajectory())
    result.trajectory.push_back({pose.time, pose.T_world_depth});
  for (const hal::TruthPose& pose : sensor.truth) result.truth.push_back({pose.time, pose.T_world_depth});
  if (!result.truth.empty()) {
    auto accuracy = evaluate::evaluate_trajectory(result.trajectory, result.truth);
    if (accuracy) result.accuracy = *accuracy;
  }
  add_events(result, pipeline);
  add_display(result, facts, pipeline, sensor);
  result.pictures = facts.pictures;
  result.notes = facts.notes;
  if (!facts.labels->remark.empty()) result.notes.push_back({Note::Kind::note, facts.labels->remark});
  if (const std::uint64_t left_out = pipeline.counts().poses_left_out; left_out > 0)
    result.notes.push_back({Note::Kind::warning, "trajectory.txt ends early: the last " + std::to_string(left_out) +
                                                     " tracked frames found no room in it; record long sessions "
                                                     "(--record) and replay them."});
  if (!facts.arena->is_locked()) result.notes.push_back({Note::Kind::warning, facts.arena->lock_refusal()});
  for (const hal::CameraCounters* camera :
       {&sensor.depth->counters(), sensor.color ? &sensor.color->counters() : nullptr})
    if (camera != nullptr && !camera->first_rejection.empty())
      result.notes.push_back({Note::Kind::warning, camera->first_rejection});

  map::MeshConfig mesh_config;
  mesh_config.weight_min = exported_weight_min(result.trajectory.size());
  const map::Mesh mesh = map::extract_mesh(map, mesh_config);
  result.map.mesh_vertices = mesh.vertices.size();
  result.map.mesh_triangles = mesh.triangles.size();
  add_labels(result, facts, pipeline, mesh);
  if (!folder_.empty()) {
    add_model_pictures(result, pipeline);
    std::vector<std::string> threads(Pipeline::kThreadNames.begin(), Pipeline::kThreadNames.end());
    // Everything is tried; the first failure is told.
    rt::Result<void> written;
    const auto keep = [&](rt::Result<void> one) {
      if (written && !one) written = one.error();
    };
    keep(write_trajectory(folder_ / "trajectory.txt", result.trajectory));
    keep(write_summary(folder_ / "summary.json", result));
    keep(write_events(folder_ / "events.jsonl", result.events));
    keep(write_trace(folder_ / "trace.json", trace_records(pipeline), threads));
    keep(write_mesh(folder_ / "mesh.ply", mesh));
    keep(save_map(folder_ / "map.tactus", map));
    keep(write_report(folder_ / "report.html", result));
    if (!written) return written.error();
  }
  return facts.options->is_json ? to_text(summary_json(result)) : headline(result, folder_);
}

}  // namespace tactus::firmware
