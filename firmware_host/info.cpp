#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "firmware_host/commands.hpp"
#include "firmware_host/progress.hpp"
#include "firmware_host/registration_check.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {
namespace {

/// What reading a stream to its end has shown.
struct StreamInfo {
  hal::CameraCounters counters;
  rt::SensorTime first, last;
  rt::Duration gap_max;
  std::uint64_t gap_max_before = 0;  // sequence number of the frame after the longest pause
  std::uint64_t missing_count = 0;   // sequence numbers that were never seen
  rt::Status ended_by = rt::Status::ok;

  [[nodiscard]] double rate_hz() const {
    const double s = (last - first).seconds();
    return counters.frames_delivered > 1 && s > 0 ? static_cast<double>(counters.frames_delivered - 1) / s
                                                  : 0;
  }
};

struct DepthContent {
  double valid_share = 0;
  double nearest_m = 0, median_m = 0, farthest_m = 0;  // 1st, 50th and 99th percentile of what was measured
};

/// Reads a camera to its end; look(pixels) sees every good frame.
template <typename Camera, typename Pixel, typename Look>
StreamInfo read_all(Camera& camera, std::vector<Pixel>& pixels, Progress& progress, const Look& look) {
  // A recording answers at once; a second without a frame means that none will come.
  constexpr rt::Duration kTimeout{1'000'000'000};
  StreamInfo info;
  std::uint64_t next_sequence = 0, frames_count = 0;
  for (;;) {
    hal::FrameHeader header;
    const rt::Status status = camera.read(pixels, header, kTimeout);
    if (status == rt::Status::corrupt) continue;
    if (status != rt::Status::ok) {
      info.ended_by = status;
      break;
    }
    if (frames_count == 0) {
      info.first = header.time;
    } else {
      const rt::Duration gap = header.time - info.last;
      if (gap > info.gap_max) {
        info.gap_max = gap;
        info.gap_max_before = header.sequence;
      }
      if (header.sequence > next_sequence) info.missing_count += header.sequence - next_sequence;
    }
    next_sequence = header.sequence + 1;
    info.last = header.time;
    ++frames_count;
    look(pixels);
    progress.update(frames_count);
  }
  info.counters = camera.counters();
  return info;
}

class DepthHistogram {
 public:
  DepthHistogram() : counts_(65536, 0) {}
  void add(const std::vector<std::uint16_t>& raw) {
    for (const std::uint16_t v : raw) ++counts_[v];
  }
  [[nodiscard]] DepthContent content(double m_per_unit) const {
    std::uint64_t total = 0;
    for (const std::uint64_t c : counts_) total += c;
    const std::uint64_t valid = total - counts_[0];
    if (valid == 0) return {};
    const auto value = [&](double share) {
      std::uint64_t seen = 0;
      for (std::size_t v = 1; v < counts_.size(); ++v) {
        seen += counts_[v];
        if (static_cast<double>(seen) >= share * static_cast<double>(valid))
          return static_cast<double>(v) * m_per_unit;
      }
      return 65535 * m_per_unit;
    };
    return {static_cast<double>(valid) / static_cast<double>(total), value(0.01), value(0.5), value(0.99)};
  }

 private:
  std::vector<std::uint64_t> counts_;
};

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
  std::snprintf(line, sizeof(line),
                "%-12s %llu good in %.2f s, %.2f Hz; longest pause %.0f ms before frame %llu\n", name,
                static_cast<unsigned long long>(s.counters.frames_delivered), (s.last - s.first).seconds(),
                s.rate_hz(), s.gap_max.milliseconds(), static_cast<unsigned long long>(s.gap_max_before));
  std::string text = line;
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
  if (s.ended_by != rt::Status::end_of_stream)
    text += "             ended: " + std::string(rt::name(s.ended_by)) + "\n";
  return text;
}

nlohmann::json stream_json(const StreamInfo& s) {
  return {{"frames", s.counters.frames_delivered},
          {"frames_rejected", s.counters.frames_rejected},
          {"timestamps_rejected", s.counters.timestamps_rejected},
          {"first_rejection", s.counters.first_rejection},
          {"frames_missing", s.missing_count},
          {"duration_s", (s.last - s.first).seconds()},
          {"rate_hz", s.rate_hz()},
          {"gap_ms_max", s.gap_max.milliseconds()},
          {"gap_before_frame", s.gap_max_before}};
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

  std::optional<StreamInfo> depth, color;
  DepthContent content;
  // A live camera has no end to read to.
  if (!options.is_quick && sensor.frames_count > 0) {
    Progress progress("reading " + options.source, sensor.frames_count, rt::Clock::monotonic());
    std::vector<std::uint16_t> raw(static_cast<std::size_t>(rig.depth.width) *
                                   static_cast<std::size_t>(rig.depth.height));
    DepthHistogram histogram;
    depth = read_all(*sensor.depth, raw, progress, [&](const auto& pixels) { histogram.add(pixels); });
    content = histogram.content(rig.depth_m_per_unit);
    if (sensor.color) {
      std::vector<std::uint8_t> rgb(static_cast<std::size_t>(rig.color.width) *
                                    static_cast<std::size_t>(rig.color.height) * 3);
      color = read_all(*sensor.color, rgb, progress, [](const auto&) {});
    }
  }
  const double truth_s =
      sensor.truth.empty() ? 0 : (sensor.truth.back().time - sensor.truth.front().time).seconds();

  if (options.is_json) {
    nlohmann::json j = {
        {"source", options.source},
        {"description", sensor.description},
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
    if (depth) {
      j["depth"]["stream"] = stream_json(*depth);
      j["depth"]["valid_share"] = content.valid_share;
      j["depth"]["range_m"] = {
          {"p1", content.nearest_m}, {"p50", content.median_m}, {"p99", content.farthest_m}};
    }
    if (color) j["color"]["stream"] = stream_json(*color);
    return to_text(j);
  }

  char line[240];
  std::string text = sensor.description + "\n";
  std::snprintf(line, sizeof(line), "%-12s %llu at %g Hz (nominal)\n", "frames",
                static_cast<unsigned long long>(sensor.frames_count), sensor.frame_rate_hz);
  text += line;
  text += intrinsics_text("depth", rig.depth);
  if (depth) text += stream_text("", *depth);
  if (depth && content.valid_share > 0) {
    std::snprintf(line, sizeof(line),
                  "%-12s %.1f %% of the pixels measured; %.2f to %.2f m (1 %% to 99 %%), median %.2f m\n", "",
                  content.valid_share * 100, content.nearest_m, content.farthest_m, content.median_m);
    text += line;
  } else if (depth) {
    text += "             no pixel holds a measurement\n";
  }
  std::snprintf(line, sizeof(line), "%-12s %g m per unit\n", "", rig.depth_m_per_unit);
  text += line;
  if (sensor.color) {
    text += intrinsics_text("colour", rig.color);
    if (color) text += stream_text("", *color);
    const double baseline_mm = rig.T_color_depth.translation.norm() * 1e3;
    if (rig.registered) {
      text += "             registered: depth and colour share one camera\n";
    } else {
      std::snprintf(line, sizeof(line), "%-12s another camera, %.1f mm beside the depth camera\n", "",
                    baseline_mm);
      text += line;
    }
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
  for (const std::string& note : sensor.notes) text += "note: " + note + "\n";
  return text;
}

}  // namespace tactus::firmware
