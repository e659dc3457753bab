#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "firmware_host/commands.hpp"
#include "firmware_host/registration_check.hpp"
#include "firmware_host/stream_survey.hpp"
#include "firmware_host/summary.hpp"
#include "hal/record/tac.hpp"

namespace tactus::firmware {
namespace {

std::string intrinsics_text(const char* name, const hal::Intrinsics& k) {
  char line[240];
  std::snprintf(line, sizeof(line), "%-12s %d x %d, fx %.2f fy %.2f cx %.2f cy %.2f", name, k.width, k.height,
                k.fx, k.fy, k.cx, k.cy);
  std::string text = line;
  if (k.has_distortion()) {
    std::snprintf(line, sizeof(line), ", distortion k1 %.4f k2 %.4f p1 %.4f p2 %.4f k3 %.4f", k.k1, k.k2,
                  k.p1, k.p2, k.k3);
    text += line;
  }
  return text + "\n";
}

nlohmann::json intrinsics_json(const hal::Intrinsics& k) {
  return {{"width", k.width}, {"height", k.height}, {"fx", k.fx}, {"fy", k.fy}, {"cx", k.cx}, {"cy", k.cy},
          {"k1", k.k1},       {"k2", k.k2},         {"p1", k.p1}, {"p2", k.p2}, {"k3", k.k3}};
}

std::string stream_text(const char* name, const StreamInfo& s) {
  char line[240];
  std::snprintf(line, sizeof(line), "%-12s %llu good in %.2f s, %.2f Hz; ", name,
                static_cast<unsigned long long>(s.frames_count), (s.last - s.first).seconds(), s.rate_hz());
  std::string text = line;
  if (s.gaps_count > 0)
    text += std::to_string(s.gaps_count) + (s.gaps_count == 1 ? " gap; " : " gaps; ");
  std::snprintf(line, sizeof(line), "longest pause %.0f ms before frame %llu\n", s.gap_max.milliseconds(),
                static_cast<unsigned long long>(s.gap_max_before));
  text += line;
  const std::uint64_t rejected = s.counters.frames_rejected + s.counters.timestamps_rejected;
  if (rejected > 0) {
    text += "             " + std::to_string(s.counters.frames_rejected) + " unusable, " +
            std::to_string(s.counters.timestamps_rejected) +
            " with a time that is not later; first: " + s.counters.first_rejection + "\n";
  }
  if (s.missing_count > rejected) {
    text += "             " + std::to_string(s.missing_count - rejected) +
            " frames are missing by their numbers\n";
  }
  if (s.drift_ppm) {
    std::snprintf(line, sizeof(line), "%-12s its clock runs %+.1f millionths fast\n", "", *s.drift_ppm);
    text += line;
  }
  if (s.ended_by != rt::Status::end_of_stream && s.ended_by != rt::Status::ok)
    text += "             ended: " + std::string(rt::name(s.ended_by)) + "\n";
  return text;
}

nlohmann::json stream_json(const StreamInfo& s) {
  nlohmann::json j = {{"frames", s.frames_count},
                      {"frames_rejected", s.counters.frames_rejected},
                      {"timestamps_rejected", s.counters.timestamps_rejected},
                      {"first_rejection", s.counters.first_rejection},
                      {"frames_missing", s.missing_count},
                      {"losses", s.counters.losses},
                      {"duration_s", (s.last - s.first).seconds()},
                      {"rate_hz", s.rate_hz()},
                      {"gaps", s.gaps_count},
                      {"gap_ms_max", s.gap_max.milliseconds()},
                      {"gap_before_frame", s.gap_max_before}};
  if (s.drift_ppm) j["clock_drift_ppm"] = *s.drift_ppm;
  return j;
}

std::string pairing_text(const Pairing& p) {
  if (p.paired() == 0) return "pairs        none: no colour frame is within 20 ms of a depth frame\n";
  char line[240];
  std::snprintf(line, sizeof(line),
                "%-12s %llu; apart p50 %.1f, p95 %.1f, at most %.1f ms; %llu depth and %llu colour frames alone\n", "pairs",
                static_cast<unsigned long long>(p.paired()), p.distance().p50().milliseconds(),
                p.distance().percentile(0.95).milliseconds(), p.distance().max().milliseconds(),
                static_cast<unsigned long long>(p.depths_unpaired()),
                static_cast<unsigned long long>(p.colors_unpaired()));
  return line;
}

nlohmann::json pairing_json(const Pairing& p) {
  nlohmann::json histogram = nlohmann::json::object();
  for (std::size_t i = 0; i < p.skew_ms_counts().size(); ++i)
    if (p.skew_ms_counts()[i] > 0)
      histogram[std::to_string(static_cast<int>(i) - static_cast<int>(Pairing::kSkewBins / 2))] = p.skew_ms_counts()[i];
  return {{"pairs", p.paired()},
          {"depth_alone", p.depths_unpaired()},
          {"color_alone", p.colors_unpaired()},
          {"skew_ms",
           {{"p50", p.distance().p50().milliseconds()},
            {"p95", p.distance().percentile(0.95).milliseconds()},
            {"max", p.distance().max().milliseconds()}}},
          {"skew_ms_histogram", histogram}};
}

/// Of a file or of all files in a folder; 0 when it is neither.
std::uint64_t bytes_of(const std::string& source) {
  std::error_code error;
  if (std::filesystem::is_regular_file(source, error)) return std::filesystem::file_size(source, error);
  if (!std::filesystem::is_directory(source, error)) return 0;
  std::uint64_t bytes = 0;
  for (std::filesystem::recursive_directory_iterator at(source, error), end; !error && at != end; at.increment(error))
    if (at->is_regular_file(error)) bytes += at->file_size(error);
  return bytes;
}

std::string facts_text(const hal::record::TacFacts& facts) {
  char line[320];
  std::string text;
  for (const auto& [name, s] : {std::pair{"depth", &facts.streams[0]}, std::pair{"colour", &facts.streams[1]}}) {
    if (s->frames == 0) continue;
    std::snprintf(line, sizeof(line), "%-12s %s stored at 1 : %.2f of what the device gave; %llu dropped by the recorder\n",
                  "", name, s->ratio(), static_cast<unsigned long long>(s->dropped + s->refused));
    text += line;
  }
  for (const auto& [key, value] : facts.info.entries) text += "             " + key + ": " + value + "\n";
  return text;
}

nlohmann::json facts_json(const hal::record::TacFacts& facts) {
  const auto stream = [](const hal::record::TacFacts::OfStream& s) {
    return nlohmann::json{{"frames", s.frames},         {"raw_bytes", s.raw_bytes}, {"stored_bytes", s.stored_bytes},
                          {"compression", s.ratio()},   {"dropped", s.dropped},     {"refused", s.refused},
                          {"frames_missing", s.missing}};
  };
  nlohmann::json info = nlohmann::json::object();
  for (const auto& [key, value] : facts.info.entries) info[key] = value;
  return {{"depth", stream(facts.streams[0])}, {"color", stream(facts.streams[1])}, {"cut_off", facts.is_cut_off},
          {"damaged_bytes", facts.damaged_bytes}, {"was_live", facts.was_live},     {"info", info}};
}

std::string registration_text(const RegistrationReport& r, const InfoOptions& options) {
  if (options.is_json)
    return to_text(nlohmann::json{{"source", options.source},
                                  {"pairs", r.pairs_count},
                                  {"edges", r.edges_count},
                                  {"edge_depth_m", r.edge_depth_m},
                                  {"edge_distance_px", {{"p50", r.median_px}, {"p90", r.p90_px}}},
                                  {"by_chance_px", {{"p50", r.chance_median_px}, {"p90", r.chance_p90_px}}},
                                  {"best_shift_px", {r.shift_x_px, r.shift_y_px}},
                                  {"best_fit_against_mean", r.fit_share},
                                  {"decidable", r.is_decidable},
                                  {"verdict", r.verdict}});
  char text[600];
  std::snprintf(text, sizeof(text),
                "%-12s %d of depth and colour; %llu edge pixels, median depth %.2f m\n"
                "%-12s p50 %.2f px, p90 %.2f px from depth edges to the nearest colour edge\n"
                "%-12s p50 %.2f px, p90 %.2f px for edges moved somewhere else\n"
                "%-12s (%+.2f, %+.2f) px would fit depth to colour best\n",
                "pairs", r.pairs_count, static_cast<unsigned long long>(r.edges_count), r.edge_depth_m, "misaligned",
                r.median_px, r.p90_px, "by chance", r.chance_median_px, r.chance_p90_px, "shift", r.shift_x_px,
                r.shift_y_px);
  return text + r.verdict + "\n";
}

}  // namespace

rt::Result<std::string> info(const InfoOptions& options) {
  auto opened = open_source(options.source, {options.frames, 0});
  if (!opened) return opened.error();
  hal::Sensor& sensor = *opened;
  if (options.checks_registration) {
    const auto report = check_registration(sensor, options.source, options.pairs_max);
    if (!report) return report.error();
    return registration_text(*report, options);
  }
  const hal::RigCalibration& rig = sensor.calibration;

  std::optional<Survey> seen;
  if (!options.is_quick) seen = survey(sensor, options.source, options.frames);
  const std::uint64_t file_bytes = bytes_of(options.source);
  std::optional<hal::record::TacFacts> facts;
  if (hal::record::is_tac(options.source))
    if (auto known = hal::record::tac_facts(options.source)) facts = std::move(*known);
  const double truth_s =
      sensor.truth.empty() ? 0 : (sensor.truth.back().time - sensor.truth.front().time).seconds();

  if (options.is_json) {
    nlohmann::json j = {
        {"source", options.source},
        {"description", sensor.description},
        {"live", sensor.is_live},
        {"frame_rate_hz", sensor.frame_rate_hz},
        {"frames", sensor.frames_count},
        {"depth", {{"intrinsics", intrinsics_json(rig.depth)}, {"m_per_unit", rig.depth_m_per_unit}}},
        {"registered", rig.registered},
        {"labels", sensor.labels != nullptr},
        {"truth_poses", sensor.truth.size()},
        {"notes", sensor.notes}};
    if (sensor.color) j["color"] = {{"intrinsics", intrinsics_json(rig.color)}};
    if (sensor.gravity_depth)
      j["gravity_depth"] = {sensor.gravity_depth->x, sensor.gravity_depth->y, sensor.gravity_depth->z};
    if (seen) {
      const DepthContent& content = seen->content;
      j["depth"]["stream"] = stream_json(seen->depth);
      j["depth"]["valid_share"] = content.valid_share;
      j["depth"]["range_m"] = {
          {"p1", content.nearest_m}, {"p50", content.median_m}, {"p99", content.farthest_m}};
    }
    if (seen && seen->color) {
      j["color"]["stream"] = stream_json(*seen->color);
      j["pairing"] = pairing_json(seen->pairing);
    }
    if (facts) j["recording"] = facts_json(*facts);
    if (file_bytes > 0) j["file_bytes"] = file_bytes;
    if (file_bytes > 0 && seen) j["pixel_bytes"] = seen->pixel_bytes;
    return to_text(j);
  }

  char line[240];
  std::string text = sensor.description + "\n";
  if (sensor.is_live)
    std::snprintf(line, sizeof(line), "%-12s of a device, at %g Hz (nominal)\n", "frames", sensor.frame_rate_hz);
  else
    std::snprintf(line, sizeof(line), "%-12s %llu at %g Hz (nominal)\n", "frames",
                  static_cast<unsigned long long>(sensor.frames_count), sensor.frame_rate_hz);
  text += line;
  text += intrinsics_text("depth", rig.depth);
  if (seen) text += stream_text("", seen->depth);
  if (const DepthContent content = seen ? seen->content : DepthContent{}; content.valid_share > 0) {
    std::snprintf(line, sizeof(line),
                  "%-12s %.1f %% of the pixels measured; %.2f to %.2f m (1 %% to 99 %%), median %.2f m\n", "",
                  content.valid_share * 100, content.nearest_m, content.farthest_m, content.median_m);
    text += line;
  } else if (seen) {
    text += "             no pixel holds a measurement\n";
  }
  std::snprintf(line, sizeof(line), "%-12s %g m per unit\n", "", rig.depth_m_per_unit);
  text += line;
  if (sensor.color) {
    text += intrinsics_text("colour", rig.color);
    if (seen && seen->color) text += stream_text("", *seen->color);
    const double baseline_mm = rig.T_color_depth.translation.norm() * 1e3;
    if (rig.registered) {
      text += "             registered: depth and colour share one camera\n";
    } else {
      std::snprintf(line, sizeof(line), "%-12s another camera, %.1f mm beside the depth camera\n", "",
                    baseline_mm);
      text += line;
    }
    if (seen) text += pairing_text(seen->pairing);
  } else {
    text += "colour       none\n";
  }
  if (sensor.truth.empty()) {
    text += "true poses   none\n";
  } else {
    std::snprintf(line, sizeof(line), "%-12s %zu over %.2f s\n", "true poses", sensor.truth.size(), truth_s);
    text += line;
  }
  text += std::string("true labels  ") + (sensor.labels ? "yes\n" : "none\n");
  if (sensor.gravity_depth) {
    const Vec3d& g = *sensor.gravity_depth;
    std::snprintf(line, sizeof(line), "%-12s %.3f %.3f %.3f in the first depth frame\n", "gravity", g.x, g.y,
                  g.z);
    text += line;
  } else {
    text += "gravity      unknown\n";
  }
  if (file_bytes > 0) {
    std::snprintf(line, sizeof(line), "%-12s %.1f MB", "size", static_cast<double>(file_bytes) / 1e6);
    text += line;
    if (seen) {
      std::snprintf(line, sizeof(line), ", 1 : %.2f of its pixels",
                    static_cast<double>(seen->pixel_bytes) / static_cast<double>(file_bytes));
      text += line;
    }
    text += "\n";
  }
  if (facts) text += facts_text(*facts);
  for (const std::string& note : sensor.notes) text += "note: " + note + "\n";
  return text;
}

}  // namespace tactus::firmware
