#include "firmware_host/summary.hpp"

#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/output_file.hpp"

namespace tactus::firmware {

std::string hexadecimal(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, value);
  return text.data();
}

namespace {

using nlohmann::json;

json latency_json(const LatencySummary& latency) {
  return {{"p50", latency.p50},
          {"p99", latency.p99},
          {"max", latency.max},
          {"mean", latency.mean},
          {"count", latency.count}};
}

json millimetres(const evaluate::ErrorStatistics& s) {
  return {{"rmse", s.rmse * 1e3},
          {"mean", s.mean * 1e3},
          {"median", s.median * 1e3},
          {"max", s.max * 1e3},
          {"count", s.count}};
}

std::string material_name(MaterialId id) {
  return std::string(id < kMaterialCount ? kMaterialNames[id] : std::string_view("unknown"));
}

json memory_json(const RunResult& r) {
  json rows = json::array();
  for (const MemoryResult& row : r.memory) {
    json j = {
        {"name", row.name}, {"owner", row.owner}, {"why", row.why}, {"planned_bytes", row.planned_bytes}};
    if (row.high_water_bytes) j["high_water_bytes"] = *row.high_water_bytes;
    if (row.is_outside_arena) j["outside_arena"] = true;
    rows.push_back(std::move(j));
  }
  return {{"planned_bytes", r.planned_bytes()},
          {"high_water_bytes", r.high_water_bytes()},
          {"resident_bytes_peak", r.resident_bytes_peak},
          {"locked", r.memory_was_locked},
          {"rows", std::move(rows)}};
}

json labels_json(const LabelingResult& labels) {
  json surface = json::object();
  for (const LabelResult& label : labels.surface)
    surface[material_name(label.material)] = {{"share", label.surface_share},
                                              {"mean_probability", label.mean_probability}};
  return {{"model", labels.model},
          {"keyframes_segmented", labels.keyframes_segmented},
          {"keyframes_replaced", labels.keyframes_replaced},
          {"age_ms_p50", labels.age_ms_p50},
          {"refined",
           {{"regions", labels.refined.regions},
            {"rounds", labels.refined.rounds},
            {"iterations", labels.refined.iterations},
            {"cells", labels.refined.cells},
            {"regions_too_fine", labels.refined.too_fine}}},
          {"surface", std::move(surface)}};
}

json accuracy_json(const evaluate::TrajectoryReport& a) {
  return {{"pairs", a.pairs_count},
          {"path_length_m", a.path_length_m},
          {"ate_first_pose_mm", millimetres(a.ate_first_pose_m)},
          {"ate_rigid_mm", millimetres(a.ate_rigid_m)},
          {"rpe_per_second_mm", millimetres(a.per_second.translation_m)},
          {"rpe_per_metre_mm", millimetres(a.per_metre.translation_m)}};
}

json overlay_json(const evaluate::OverlayError& e) {
  return {{"poses", e.poses_count}, {"p50", e.p50_px}, {"p95", e.p95_px}, {"max", e.max_px}};
}

json display_json(const DisplayResult& d) {
  json j = {{"pictures_recorded", d.pictures_recorded}, {"camera_to_photon_ms", latency_json(d.camera_to_photon_ms)}};
  const auto add = [&](const char* name, const evaluate::OverlayError& error) {
    if (error.poses_count > 0) j[name] = overlay_json(error);
  };
  add("predicted_to_tracked_px", d.predicted_to_tracked);
  add("predicted_to_truth_px", d.predicted_to_truth);
  add("tracked_to_truth_px", d.tracked_to_truth);
  return j;
}

json intake_json(const IntakeCounts& i) {
  return {{"duplicates", i.duplicates},
          {"out_of_order", i.out_of_order},
          {"times_repaired", i.times_repaired},
          {"time_jumps", i.time_jumps}};
}

json sensor_json(const SensorResult& s) {
  json histogram = json::object();
  for (std::size_t i = 0; i < s.skew_ms_counts.size(); ++i)
    if (s.skew_ms_counts[i] > 0)
      histogram[std::to_string(static_cast<int>(i) - static_cast<int>(Pairing::kSkewBins / 2))] = s.skew_ms_counts[i];
  json pairing = {{"skew_ms_limit", Pairing::kSkewMax.milliseconds()},
                  {"paired", s.paired},
                  {"colors_unpaired", s.colors_unpaired},
                  {"depths_unpaired", s.depths_unpaired},
                  {"skew_ms", latency_json(s.skew_ms)},
                  {"histogram_ms", std::move(histogram)}};
  json j = {{"live", s.is_live},
            {"losses", s.losses},
            {"timeouts", s.timeouts},
            {"buffers_bytes", s.buffers_bytes},
            {"depth", intake_json(s.depth)},
            {"color", intake_json(s.color)},
            {"pairing", std::move(pairing)}};
  j["color"]["rejected"] = s.color_rejected;
  j["color"]["missing"] = s.color_missing;
  if (s.depth_drift_ppm) j["depth"]["clock_drift_ppm"] = *s.depth_drift_ppm;
  if (s.color_drift_ppm) j["color"]["clock_drift_ppm"] = *s.color_drift_ppm;
  if (s.arrival_to_read_ms.count > 0) j["arrival_to_read_ms"] = latency_json(s.arrival_to_read_ms);
  return j;
}

json injected_json(const std::vector<InjectedFault>& faults) {
  json j = json::object();
  for (const InjectedFault& fault : faults) j[fault.kind] = {{"depth", fault.depth}, {"color", fault.color}};
  return j;
}

json recording_json(const RecordingResult& r) {
  const auto stream = [](const RecordedStream& one) { return json{{"frames", one.frames}, {"dropped", one.dropped}}; };
  return {{"file", r.file}, {"file_bytes", r.file_bytes}, {"depth", stream(r.depth)}, {"color", stream(r.color)}};
}

json game_json(const GameResult& g) {
  return {{"throws", g.throws},
          {"shots", g.shots},
          {"misses", g.misses},
          {"broken", g.broken},
          {"chips", g.chips},
          {"marks", g.marks},
          {"orders_refused", g.orders_refused},
          {"events_dropped", g.events_dropped},
          {"walkers", g.walkers},
          {"goals_reached", g.goals_reached},
          {"stuck", g.stuck},
          {"walked_m", g.walked_m},
          {"sounds", g.sounds},
          {"reflections", g.reflections},
          {"sounds_left_out", g.sounds_left_out}};
}

}  // namespace

json summary_json(const RunResult& r) {
  json stages = json::object();
  for (const StageResult& stage : r.stages) {
    json j = latency_json(stage.latency_ms);
    j["skipped"] = stage.skipped_count;
    j["late"] = stage.late_count;
    if (!stage.thread.empty()) j["thread"] = stage.thread;
    if (stage.budget_p99_ms > 0) j["budget_p99"] = stage.budget_p99_ms;
    if (stage.budget_max_ms > 0) j["budget_max"] = stage.budget_max_ms;
    stages[stage.name] = std::move(j);
  }
  json notes = json::array();
  for (const Note& note : r.notes)
    notes.push_back({{"kind", note.kind == Note::Kind::warning ? "warning" : "note"}, {"text", note.text}});
  json j = {
      {"source", r.source},
      {"description", r.description},
      {"runner", r.runner},
      {"threads", r.threads_count},
      {"profile", r.profile},
      {"app", r.app},
      {"collision", r.collision},
      {"command", r.command},
      {"date", r.date},
      {"revision", r.revision},
      {"machine",
       {{"cpu", r.machine.cpu},
        {"cores", r.machine.cores_count},
        {"memory_bytes", r.machine.memory_bytes},
        {"kernel", r.machine.kernel},
        {"compiler", r.machine.compiler}}},
      {"gravity", r.gravity_origin},
      {"interrupted", r.was_interrupted},
      {"wall_s", r.wall_s},
      {"frames_in", r.frames.in},
      {"frames_tracked", r.frames.tracked},
      {"frames_dropped", r.frames.dropped},
      {"frames_lost", r.frames.lost},
      {"frames_rejected", r.frames.rejected},
      {"frames_missing", r.frames.missing},
      {"sensor", sensor_json(r.sensor)},
      {"keyframes", r.keyframes},
      {"relocalisations", r.relocalisations},
      {"frame_latency_ms", latency_json(r.frame_latency_ms)},
      {"stage_latency_ms", std::move(stages)},
      {"memory", memory_json(r)},
      {"heap_allocations_after_seal", r.heap_allocations_after_seal},
      {"heap_allocations_in_guests", r.heap_allocations_in_guests},
      {"heap_allocations_elsewhere", r.heap_allocations_elsewhere},
      {"map",
       {{"blocks_used", r.map.blocks_used},
        {"blocks_capacity", r.map.blocks_capacity},
        {"bytes_per_voxel", r.map.bytes_per_voxel},
        {"voxel_size_m", r.map.voxel_size_m},
        {"truncation_m", r.map.truncation_m},
        {"evicted", r.map.evicted},
        {"mesh_vertices", r.map.mesh_vertices},
        {"mesh_triangles", r.map.mesh_triangles}}},
      {"labels", labels_json(r.labels)},
      {"map_hash", hexadecimal(r.map_hash)},
      {"geometry_hash", hexadecimal(r.geometry_hash)},
      {"label_hash", hexadecimal(r.label_hash)},
      {"events", r.events.size()},
      {"game", game_json(r.game)},
      {"display", display_json(r.display)},
      {"notes", std::move(notes)},
  };
  if (r.recording) j["recording"] = recording_json(*r.recording);
  if (r.faults) j["faults"] = {{"injected", injected_json(*r.faults)}};
  if (r.accuracy) j["accuracy"] = accuracy_json(*r.accuracy);
  if (r.surface_error_mean_m) j["surface_error_mean_mm"] = *r.surface_error_mean_m * 1e3;
  return j;
}

std::string to_text(const json& j) { return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n"; }

rt::Result<void> write_summary(const std::filesystem::path& file, const RunResult& result) {
  return write_file(file, to_text(summary_json(result)));
}

std::string event_line(const RunEvent& event) {
  json j = {{"time_s", event.time.seconds()}, {"frame", event.frame}, {"kind", event.kind}};
  if (!event.text.empty()) j["text"] = event.text;
  if (event.material) j["material"] = material_name(*event.material);
  if (event.body_material) j["body_material"] = material_name(*event.body_material);
  if (!event.outcome.empty()) j["outcome"] = event.outcome;
  if (event.position_world_m) {
    const Vec3d& p = *event.position_world_m;
    j["position_world_m"] = {p.x, p.y, p.z};
  }
  for (const auto& [name, value] : event.values) {
    if (value == std::floor(value) && std::fabs(value) < 1e9) {
      j[name] = static_cast<std::int64_t>(value);  // an index or a count
    } else {
      j[name] = value;
    }
  }
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

rt::Result<void> write_events(const std::filesystem::path& path, std::span<const RunEvent> events) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  for (const RunEvent& event : events) file->write(event_line(event) + "\n");
  return file->close();
}

std::string trajectory_line(const evaluate::StampedPose& pose) {
  const Quaternion q = pose.T_world_depth.rotation.quaternion();
  const Vec3d& t = pose.T_world_depth.translation;
  const std::int64_t ns = pose.time.ns;
  const auto magnitude = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  std::array<char, 256> line{};
  const int length = std::snprintf(line.data(), line.size(),
                                   "%s%" PRIu64 ".%09" PRIu64 " %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n",
                                   ns < 0 ? "-" : "", magnitude / 1'000'000'000, magnitude % 1'000'000'000,
                                   t.x, t.y, t.z, q.x, q.y, q.z, q.w);
  return {line.data(), static_cast<std::size_t>(length)};
}

rt::Result<void> write_trajectory(const std::filesystem::path& path,
                                  std::span<const evaluate::StampedPose> poses) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  for (const evaluate::StampedPose& pose : poses) file->write(trajectory_line(pose));
  return file->close();
}

}  // namespace tactus::firmware
