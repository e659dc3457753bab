#include "firmware_host/report_sections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware_host/html.hpp"
#include "firmware_host/report.hpp"
#include "firmware_host/report_parts.hpp"
#include "firmware_host/report_plot.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {
namespace {

/// Rows of a long list that the page shows before it says how many more there are.
constexpr std::size_t kEventsShown = 200;

enum class Verdict : std::uint8_t { none, good, bad };

std::string tile(const std::string& name, const std::string& figure, const std::string& unit,
                 const std::string& detail, Verdict verdict = Verdict::none) {
  const char* kind = verdict == Verdict::good ? " good" : verdict == Verdict::bad ? " bad" : "";
  return "<div class=\"tile" + std::string(kind) + "\"><div class=\"name\">" + name +
         "</div><div class=\"figure\">" + figure + (unit.empty() ? "" : " <small>" + unit + "</small>") +
         "</div><div class=\"detail\">" + detail + "</div></div>";
}

std::string percent(double share) {
  const double p = share * 100;
  return (p > 0 && p < 0.1 ? "&lt; 0.1" : fixed(p, p < 9.95 ? 1 : 0)) + " %";
}

/// The overlay's colour of a material and its name.
std::string swatch(MaterialId id, const char* name_of_unknown = "unknown") {
  const Rgb8 c = material_color(id);
  return "<span class=\"swatch\" style=\"background:rgb(" + std::to_string(c.r) + "," + std::to_string(c.g) +
         "," + std::to_string(c.b) + ")\"></span>" +
         (id < kMaterialCount ? std::string(kMaterialNames[id]) : name_of_unknown);
}

double path_length_m(const std::vector<evaluate::StampedPose>& poses) {
  double sum = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    sum += (poses[i].T_world_depth.translation - poses[i - 1].T_world_depth.translation).norm();
  return sum;
}

rt::Duration gap_max_of(const RunResult& r) {
  const double period_s = r.frame_rate_hz > 0 ? 1 / r.frame_rate_hz : 1.0 / 30;
  return {static_cast<std::int64_t>(period_s * 3.5e9)};
}

/// The true path in the estimate's world, so that "up" stays up in both.
std::vector<evaluate::StampedPose> truth_in_estimate_world(const RunResult& r) {
  if (!r.accuracy) return {};
  const evaluate::Alignment& a = r.accuracy->T_truth_estimate_rigid;
  const Rotation back = a.rotation.transposed();
  std::vector<evaluate::StampedPose> poses;
  // Only the part the camera filmed: motion capture often runs for longer.
  const auto first = r.trajectory.empty() ? rt::SensorTime{} : r.trajectory.front().time;
  const auto last = r.trajectory.empty() ? rt::SensorTime{} : r.trajectory.back().time;
  for (const evaluate::StampedPose& pose : r.truth) {
    if (pose.time < first - evaluate::kAssociationMax || pose.time > last + evaluate::kAssociationMax)
      continue;
    const T_WorldDepth& T = pose.T_world_depth;
    poses.push_back({pose.time, {back * T.rotation, back * (T.translation - a.translation)}});
  }
  return poses;
}

}  // namespace

rt::Result<std::string> encode_png(const Picture& picture) {
  const auto pixels = static_cast<std::size_t>(std::max(picture.width, 0)) *
                      static_cast<std::size_t>(std::max(picture.height, 0));
  if (pixels == 0 || picture.rgb.size() != pixels * 3) {
    return rt::Error{rt::ExitCode::failed, "the picture '" + picture.title + "' has " +
                                               std::to_string(picture.rgb.size()) + " bytes, which is not " +
                                               std::to_string(picture.width) + " x " +
                                               std::to_string(picture.height) + " x 3."};
  }
  try {
    const cv::Mat rgb(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.rgb.data()));
    cv::Mat bgr;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    std::vector<std::uint8_t> png;
    cv::imencode(".png", bgr, png, {cv::IMWRITE_PNG_COMPRESSION, 6});
    return std::string(png.begin(), png.end());
  } catch (const cv::Exception& e) {
    return rt::Error{rt::ExitCode::failed,
                     "the picture '" + picture.title + "' cannot be encoded: " + e.what()};
  }
}

std::string headline_section(const RunResult& r) {
  std::string html =
      "<header><p class=\"brand\">tactus · report of a run</p><h1>" + escaped(r.source) +
      "</h1><p class=\"lead\">" + escaped(r.description) + (r.description.empty() ? "" : ". ") +
      (r.width > 0 ? std::to_string(r.width) + " × " + std::to_string(r.height) + " at " +
                         shortest(r.frame_rate_hz) + " Hz, "
                   : "") +
      escaped(r.runner) + " runner, " +
      plural(static_cast<std::uint64_t>(std::max(r.threads_count, 0)), "thread", "threads") + ", profile " +
      escaped(r.profile) + ", app " + escaped(r.app) + ", collision " + escaped(r.collision) + "." +
      (r.was_interrupted ? " The run was interrupted." : "") + "</p></header>\n<div class=\"tiles\">";

  const FrameCounts& f = r.frames;
  html += tile("Frames tracked", grouped(f.tracked), "of " + grouped(f.in),
               grouped(f.lost) + " lost, " + grouped(f.dropped) + " dropped, " +
                   plural(r.relocalisations, "relocalisation", "relocalisations"),
               f.in > 0 && f.tracked == f.in ? Verdict::good : Verdict::none);
  if (r.frame_latency_ms.count > 0) {
    const bool has_budget = r.frame_budget_ms > 0;
    html += tile("Frame latency, median", readable(r.frame_latency_ms.p50), "ms",
                 "p99 " + readable(r.frame_latency_ms.p99) + " ms, max " + readable(r.frame_latency_ms.max) +
                     " ms" + (has_budget ? "; budget " + shortest(r.frame_budget_ms) + " ms" : ""),
                 !has_budget                                   ? Verdict::none
                 : r.frame_latency_ms.p99 <= r.frame_budget_ms ? Verdict::good
                                                               : Verdict::bad);
  }
  if (r.accuracy) {
    html += tile("Trajectory error, RMSE", readable(r.accuracy->ate_rigid_m.rmse * 1e3), "mm",
                 readable(r.accuracy->ate_first_pose_m.rmse * 1e3) + " mm aligned at the first pose; path " +
                     readable(r.accuracy->path_length_m) + " m");
  } else if (!r.trajectory.empty()) {
    html += tile("Camera path", readable(path_length_m(r.trajectory)), "m",
                 "no true path is known for this source");
  }
  if (r.surface_error_mean_m) {
    html += tile("Surface error, mean", readable(*r.surface_error_mean_m * 1e3), "mm",
                 "against the exact surface");
  }
  html += tile("Heap calls after boot", grouped(r.heap_allocations_after_seal), "",
               "malloc family, on pipeline threads",
               r.heap_allocations_after_seal == 0 ? Verdict::good : Verdict::bad);
  if (!r.memory.empty()) {
    html += tile("Memory planned", readable_bytes(r.planned_bytes()), "",
                 readable_bytes(r.high_water_bytes()) + " used at most; process " +
                     readable_bytes(r.resident_bytes_peak));
  }
  if (r.map.blocks_capacity > 0) {
    html += tile("Map", grouped(r.map.blocks_used), "blocks",
                 "of " + grouped(r.map.blocks_capacity) + "; " + shortest(r.map.voxel_size_m * 100) +
                     " cm voxels, " + shortest(r.map.bytes_per_voxel) + " bytes each, " +
                     grouped(r.map.evicted) + " evicted");
  }
  if (r.labels.keyframes_segmented > 0) {
    html += tile("Keyframes labelled", grouped(r.labels.keyframes_segmented), "of " + grouped(r.keyframes),
                 "label in the map after " + readable(r.labels.age_ms_p50) + " ms (median)");
  }
  return html + "</div>\n";
}

std::string notes_section(const RunResult& r) {
  if (r.notes.empty()) return {};
  std::string body = "<ul class=\"notes\">";
  for (const Note::Kind kind : {Note::Kind::warning, Note::Kind::note}) {
    for (const Note& note : r.notes) {
      if (note.kind != kind) continue;
      body += kind == Note::Kind::warning ? "<li><span class=\"tag warning\">warning</span>"
                                          : "<li><span class=\"tag\">note</span>";
      body += escaped(note.text) + "</li>";
    }
  }
  return section("notes", "Notes", "", body + "</ul>");
}

rt::Result<std::string> pictures_section(const RunResult& r) {
  if (r.pictures.empty()) return std::string();
  std::string body = "<div class=\"pictures\">";
  bool is_wide = r.pictures.size() % 2 == 1;  // two columns: of an odd number the first takes both
  for (const Picture& picture : r.pictures) {
    auto png = encode_png(picture);
    if (!png) return png.error();
    body += std::string(is_wide ? "<figure class=\"wide\">" : "<figure>") + "<img alt=\"" +
            escaped(picture.title) + "\" width=\"" + std::to_string(picture.width) + "\" height=\"" +
            std::to_string(picture.height) + "\" src=\"data:image/png;base64," + base64(*png) +
            "\"><figcaption><b>" + escaped(picture.title) + "</b> " + escaped(picture.caption) +
            "</figcaption></figure>";
    is_wide = false;
  }
  return section("pictures", "Pictures", "", body + "</div>");
}

std::string trajectory_section(const RunResult& r) {
  if (r.trajectory.empty()) return {};
  const std::vector<evaluate::StampedPose> truth = truth_in_estimate_world(r);
  const rt::Duration gap_max = gap_max_of(r);
  std::string body = "<div class=\"pair\"><div><h3>From above</h3>" +
                     trajectory_svg(r.trajectory, truth, View::top, gap_max) +
                     "</div><div><h3>From the side</h3>" +
                     trajectory_svg(r.trajectory, truth, View::side, gap_max) + "</div></div>";
  body += "<div class=\"legend\"><span>estimate, with the direction of view</span>";
  if (!truth.empty()) body += "<span class=\"l-truth\">truth</span>";
  body += "<span class=\"l-start\">start</span><span class=\"l-end\">end</span></div>";

  std::string about = "The path of the camera over " +
                      readable((r.trajectory.back().time - r.trajectory.front().time).seconds()) +
                      " s; world axes in metres, y up";
  about += r.gravity_origin.empty() ? "." : " (gravity: " + escaped(r.gravity_origin) + ").";
  if (!r.accuracy) return section("trajectory", "Trajectory", about, body);

  about += " Truth is laid over the estimate by the rigid motion that fits best.";
  const evaluate::TrajectoryReport& a = *r.accuracy;
  const auto row = [](const std::string& name, const evaluate::ErrorStatistics& s, double scale) {
    return "<tr><td>" + name + "</td>" + cell(readable(s.rmse * scale)) + cell(readable(s.mean * scale)) +
           cell(readable(s.median * scale)) + cell(readable(s.max * scale)) + cell(grouped(s.count)) +
           "</tr>";
  };
  std::vector<float> errors_mm;
  rt::SensorTime last{};
  for (const evaluate::PosePair& pair : evaluate::associate(r.trajectory, r.truth)) {
    const Vec3d aligned = a.T_truth_estimate_rigid * pair.estimate.T_world_depth.translation;
    if (!errors_mm.empty() && pair.estimate.time - last > gap_max) errors_mm.push_back(kDidNotRun);
    errors_mm.push_back(static_cast<float>((aligned - pair.truth.T_world_depth.translation).norm() * 1e3));
    last = pair.estimate.time;
  }
  body +=
      "<h3 style=\"margin-top:20px\">Distance from the true position</h3>" +
      series_svg({.values = errors_mm, .unit = "mm", .label = "distance from the true position over time"});
  body +=
      "<div class=\"scroll\"><table><thead><tr><th>error</th><th class=\"n\">RMSE</th><th "
      "class=\"n\">mean</th>"
      "<th class=\"n\">median</th><th class=\"n\">max</th><th class=\"n\">count</th></tr></thead><tbody>";
  body += row("position, rigidly aligned (mm)", a.ate_rigid_m, 1e3);
  body += row("position, aligned at the first pose (mm)", a.ate_first_pose_m, 1e3);
  if (a.per_second.translation_m.count > 0) {
    body += row("drift per second (mm)", a.per_second.translation_m, 1e3);
    body += row("turn per second (degrees)", a.per_second.rotation_deg, 1);
  }
  if (a.per_metre.translation_m.count > 0)
    body += row("drift per metre (mm)", a.per_metre.translation_m, 1e3);
  body += "</tbody></table></div>";
  return section("trajectory", "Trajectory", about, body);
}

std::string latency_section(const RunResult& r) {
  if (r.frame_ms.empty() && r.stages.empty()) return {};
  std::string body;
  if (!r.frame_ms.empty()) {
    body += "<h3>Whole frame, first byte in to everything done</h3>" +
            series_svg({.values = r.frame_ms,
                        .unit = "ms",
                        .label = "frame latency over the run",
                        .budget = r.frame_budget_ms,
                        .budget_label = "budget " + shortest(r.frame_budget_ms) + " ms"});
  }
  if (!r.stages.empty()) {
    body +=
        "<h3 style=\"margin-top:18px\">Stages, milliseconds</h3><div "
        "class=\"scroll\"><table><thead><tr><th>stage</th><th>thread</th>"
        "<th class=\"n\">p50</th><th class=\"n\">p99</th><th class=\"n\">max</th><th class=\"n\">budget</th>"
        "<th>against the budget</th><th>over the run</th><th class=\"n\">late</th></tr></thead><tbody>";
    for (const StageResult& s : r.stages) {
      const bool is_over = s.budget_p99_ms > 0 && s.latency_ms.p99 > s.budget_p99_ms;
      body += "<tr><td class=\"key\">" + escaped(s.name) + "</td><td class=\"key\">" + escaped(s.thread) +
              "</td>" + cell(readable(s.latency_ms.p50)) + "<td class=\"n" + (is_over ? " over" : "") +
              "\">" + readable(s.latency_ms.p99) + "</td>" + cell(readable(s.latency_ms.max)) +
              cell(s.budget_p99_ms > 0 ? shortest(s.budget_p99_ms) : "–") + "<td>" +
              range_svg(s.latency_ms, s.budget_p99_ms) + "</td><td>" +
              sparkline_svg(s.frame_ms, s.budget_p99_ms) + "</td>" + cell(grouped(s.late_count)) + "</tr>";
    }
    body +=
        "</tbody></table></div><div class=\"legend\"><span class=\"l-bar\">up to p99</span>"
        "<span class=\"l-median\">median</span><span class=\"l-max\">up to the maximum</span>"
        "<span class=\"l-budget\">budget for p99, at two thirds of every bar</span></div>";
  }
  return section(
      "latency", "Latency",
      "Measured by the runner around every step, on the machine named below. Over more frames than fit, the "
      "band "
      "spans least to greatest and the line is the mean; a small triangle marks a value above the scale.",
      body);
}

std::string memory_section(const RunResult& r) {
  if (r.memory.empty()) return {};
  std::string body =
      "<div class=\"scroll\"><table><thead><tr><th>what</th><th>owner</th><th class=\"n\">planned</th>"
      "<th class=\"n\">used at most</th><th></th><th>why so much</th></tr></thead><tbody>";
  for (const MemoryResult& row : r.memory) {
    const bool is_known = row.high_water_bytes.has_value();
    const double share = row.planned_bytes == 0 ? 0
                                                : static_cast<double>(row.high_water_bytes.value_or(0)) /
                                                      static_cast<double>(row.planned_bytes);
    body += "<tr><td class=\"key\">" + escaped(row.name) +
            (row.is_outside_arena ? " <span class=\"tag\">outside</span>" : "") + "</td><td class=\"key\">" +
            escaped(row.owner) + "</td>" + cell(readable_bytes(row.planned_bytes)) +
            cell(is_known ? readable_bytes(*row.high_water_bytes) : "–") + "<td>" +
            (is_known ? meter(share) : meter(1, false)) + "</td><td class=\"why\">" + escaped(row.why) +
            "</td></tr>";
  }
  body +=
      "</tbody><tfoot><tr><td>arena</td><td></td>" + cell(readable_bytes(r.planned_bytes())) +
      cell(readable_bytes(r.high_water_bytes())) +
      "<td></td><td class=\"why\">whole process, resident at most: " + readable_bytes(r.resident_bytes_peak) +
      "</td></tr></tfoot></table></div>";
  return section(
      "memory", "Memory",
      std::string("Reserved and touched once at boot") +
          (r.memory_was_locked ? " and locked into memory" : ", but not locked: the system refused") +
          "; after that nothing is allocated. A grey bar has no counter.",
      body);
}

std::string labels_section(const RunResult& r) {
  if (r.labels.surface.empty()) return {};
  std::vector<LabelResult> rows = r.labels.surface;
  std::stable_sort(rows.begin(), rows.end(), [](const LabelResult& a, const LabelResult& b) {
    return a.surface_share > b.surface_share;
  });
  const double largest = rows.front().surface_share > 0 ? rows.front().surface_share : 1;
  std::string body =
      "<div class=\"scroll\"><table><thead><tr><th>material</th><th class=\"n\">share of the surface</th>"
      "<th></th><th class=\"n\">mean probability</th></tr></thead><tbody>";
  for (const LabelResult& row : rows) {
    body += "<tr><td class=\"key\">" + swatch(row.material, "not labelled yet") + "</td>" +
            cell(percent(row.surface_share)) + "<td style=\"width:45%\">" +
            meter(row.surface_share / largest) + "</td>" +
            cell(row.material < kMaterialCount ? readable(row.mean_probability) : "–") + "</tr>";
  }
  return section(
      "labels", "Materials",
      plural(r.labels.keyframes_segmented, "keyframe", "keyframes") + " labelled by " +
          (r.labels.model.empty() ? "no network" : "<code>" + escaped(r.labels.model) + "</code>") +
          "; colours as in the overlay.",
      body + "</tbody></table></div>");
}

/// What impacts on each material came to, most impacts first.
std::string outcomes_table(const std::vector<RunEvent>& events) {
  struct Row {
    std::uint64_t impacts = 0;
    std::map<std::string, std::uint64_t> outcomes;
    double chips = 0, energy_j = 0;
  };
  std::map<MaterialId, Row> by_material;
  std::map<std::string, std::uint64_t> columns;
  for (const RunEvent& event : events) {
    if (!event.material || event.outcome.empty()) continue;
    Row& row = by_material[*event.material];
    ++row.impacts;
    ++row.outcomes[event.outcome];
    ++columns[event.outcome];
    for (const auto& [name, value] : event.values) {
      if (name == "chips") row.chips += value;
      if (name == "energy_j") row.energy_j += value;
    }
  }
  if (by_material.empty()) return {};
  std::vector<std::pair<MaterialId, Row>> rows(by_material.begin(), by_material.end());
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.second.impacts > b.second.impacts; });
  std::string html =
      "<h3>What impacts came to</h3><div class=\"scroll\"><table><thead><tr><th>surface</th><th "
      "class=\"n\">impacts</th>";
  for (const auto& [outcome, count] : columns) html += "<th class=\"n\">" + escaped(outcome) + "</th>";
  html += "<th class=\"n\">chips</th><th class=\"n\">mean energy, J</th></tr></thead><tbody>";
  for (const auto& [material, row] : rows) {
    html += "<tr><td class=\"key\">" + swatch(material) + "</td>" + cell(grouped(row.impacts));
    for (const auto& [outcome, count] : columns) {
      const auto found = row.outcomes.find(outcome);
      html += cell(found == row.outcomes.end() ? "–" : grouped(found->second));
    }
    html += cell(grouped(static_cast<std::uint64_t>(row.chips))) +
            cell(readable(row.energy_j / static_cast<double>(row.impacts))) + "</tr>";
  }
  return html + "</tbody></table></div>";
}

std::string game_section(const RunResult& r) {
  const GameResult& g = r.game;
  if (g.throws + g.shots == 0 && r.display.film.empty()) return {};
  std::string body;
  if (!r.display.film.empty()) {
    // Of a film that has not begun browsers show nothing; the moment in the address makes them show that
    // picture.
    body += "<figure class=\"film\"><video controls=\"controls\" preload=\"metadata\" src=\"" +
            escaped(r.display.film) + "#t=0.01\"></video><figcaption><a href=\"" + escaped(r.display.film) +
            "\">" + escaped(r.display.film) + "</a>, " +
            plural(r.display.pictures_recorded, "picture", "pictures") + " at " + shortest(r.frame_rate_hz) +
            " Hz" +
            (r.display.sound.empty() ? "."
                                     : "; its sound alone is <a href=\"" + escaped(r.display.sound) + "\">" +
                                           escaped(r.display.sound) + "</a>.") +
            "</figcaption></figure>";
  }
  body += "<div class=\"tiles inner\">";
  body += tile("Thrown", grouped(g.throws), "", grouped(g.broken) + " broken");
  body += tile("Shots", grouped(g.shots), "", grouped(g.misses) + " met nothing");
  body += tile("Chips and marks", grouped(g.chips), "chips",
               plural(g.marks, "mark", "marks") + " on real surfaces");
  body += tile(
      "Sounds", grouped(g.sounds), "",
      plural(g.reflections, "reflection", "reflections") + ", " + grouped(g.sounds_left_out) + " left out");
  if (r.display.camera_to_photon_ms.count > 0)
    body += tile("Camera to photon, median", readable(r.display.camera_to_photon_ms.p50), "ms",
                 "p99 " + readable(r.display.camera_to_photon_ms.p99) + " ms, " +
                     plural(r.display.camera_to_photon_ms.count, "picture", "pictures"));
  body += "</div>" + outcomes_table(r.events);
  std::string about;
  if (g.orders_refused > 0)
    about += plural(g.orders_refused, "order", "orders") + " refused: no pose, or no room for more things. ";
  if (g.events_dropped > 0)
    about += plural(g.events_dropped, "event", "events") + " beyond the plan are not in the list. ";
  return section("game", "The game", about, body);
}

std::string events_section(const RunResult& r) {
  if (r.events.empty()) return {};
  std::map<std::string, std::uint64_t> counts;
  for (const RunEvent& event : r.events) ++counts[event.kind];
  std::string about;
  for (const auto& [kind, count] : counts)
    about += (about.empty() ? "" : ", ") + grouped(count) + " × " + escaped(kind);
  std::string body =
      "<div class=\"scroll\"><table><thead><tr><th class=\"n\">time</th><th "
      "class=\"n\">frame</th><th>what</th>"
      "<th>material</th><th></th></tr></thead><tbody>";
  const std::int64_t origin_ns =
      r.trajectory.empty() ? r.events.front().time.ns : r.trajectory.front().time.ns;
  for (std::size_t i = 0; i < std::min(r.events.size(), kEventsShown); ++i) {
    const RunEvent& event = r.events[i];
    std::string text = escaped(event.text);
    for (const auto& [name, value] : event.values)
      text += (text.empty() ? "" : ", ") + escaped(name) + " " + readable(value);
    const std::string material = event.material ? swatch(*event.material) : std::string();
    body += "<tr>" + cell(fixed(static_cast<double>(event.time.ns - origin_ns) * 1e-9, 2) + " s") +
            cell(grouped(event.frame)) + "<td class=\"key\">" + escaped(event.kind) +
            "</td><td class=\"key\">" + material + "</td><td class=\"why\">" + text + "</td></tr>";
  }
  body += "</tbody></table></div>";
  if (r.events.size() > kEventsShown) {
    body +=
        "<p class=\"about\">" + grouped(r.events.size() - kEventsShown) + " more are in events.jsonl.</p>";
  }
  return section("events", "Events", about + ".", body);
}

std::string provenance_section(const RunResult& r) {
  std::string body = "<dl>";
  const auto row = [&](const char* name, const std::string& value) {
    if (!value.empty()) body += "<dt>" + std::string(name) + "</dt><dd>" + value + "</dd>";
  };
  row("command", "<code>" + escaped(r.command) + "</code>");
  row("date", escaped(r.date));
  row("tactus", escaped(r.revision) + ", " + escaped(r.machine.compiler));
  row("machine", escaped(r.machine.description()));
  row("wall time", r.wall_s > 0 ? readable(r.wall_s) + " s" : "");
  row("map hash", "<span class=\"mono\">" + hexadecimal(r.map_hash) + "</span>");
  row("geometry, labels",
      "<span class=\"mono\">" + hexadecimal(r.geometry_hash) + ", " + hexadecimal(r.label_hash) + "</span>");
  return section(
      "provenance", "Where this comes from",
      r.runner == "lockstep"
          ? "A lockstep run repeats bit for bit: the same source, profile and revision give the same hashes."
          : "",
      body + "</dl>");
}

}  // namespace tactus::firmware
