#include <algorithm>
#include <string>

#include "firmware_host/html.hpp"
#include "firmware_host/report_parts.hpp"
#include "firmware_host/report_sections.hpp"

namespace tactus::firmware {
namespace {

constexpr const char* kTableHead = "<div class=\"scroll\"><table><thead><tr>";

std::string row(const std::string& name, std::uint64_t count, std::uint64_t of, const std::string& what) {
  const double share = of == 0 ? 0 : static_cast<double>(count) / static_cast<double>(of);
  return "<tr><td class=\"key\">" + name + "</td>" + cell(grouped(count)) + "<td style=\"width:30%\">" + meter(share) +
         "</td><td class=\"why\">" + what + "</td></tr>";
}

std::string frames_table(const RunResult& r) {
  const FrameCounts& f = r.frames;
  const IntakeCounts& depth = r.sensor.depth;
  std::string body = kTableHead;
  body += "<th>depth frames</th><th class=\"n\">count</th><th></th><th>which</th></tr></thead><tbody>";
  body += row("tracked", f.tracked, f.in, "with a pose that is trusted");
  body += row("lost", f.lost, f.in, "tracking had no pose to trust");
  body += row("dropped", f.dropped, f.in, "overtaken by newer ones");
  body += row("rejected", f.rejected, f.in,
              "damaged, repeated (" + grouped(depth.duplicates) + ") or out of order (" + grouped(depth.out_of_order) + ")");
  body += row("missing", f.missing, f.in, "never came, by their numbers; not among those above");
  if (depth.times_repaired > 0)
    body += row("times replaced", depth.times_repaired, f.in, "the device's clock stood still or leapt");
  return body + "</tbody></table></div>";
}

std::string skew_table(const SensorResult& s) {
  const std::uint64_t most = *std::max_element(s.skew_ms_counts.begin(), s.skew_ms_counts.end());
  std::string body = kTableHead;
  body += "<th>colour after depth</th><th class=\"n\">pairs</th><th></th><th></th></tr></thead><tbody>";
  for (std::size_t i = 0; i < s.skew_ms_counts.size(); ++i) {
    if (s.skew_ms_counts[i] == 0) continue;
    const int ms = static_cast<int>(i) - static_cast<int>(Pairing::kSkewBins / 2);
    body += row(std::to_string(ms) + " ms", s.skew_ms_counts[i], most, "");
  }
  return body + "</tbody></table></div>";
}

}  // namespace

std::string sensor_section(const RunResult& r) {
  const SensorResult& s = r.sensor;
  if (r.frames.in == 0) return {};
  std::string about = plural(r.frames.in, "depth frame", "depth frames") + " came from " +
                      (s.is_live ? "a live camera" : "a recording or simulator");
  if (s.losses > 0) about += ", which went away " + plural(s.losses, "time", "times");
  about += ".";
  if (s.arrival_to_read_ms.count > 0)
    about += " From arrival in this machine to the pipeline: " + readable(s.arrival_to_read_ms.p50) + " ms (p50), " +
             readable(s.arrival_to_read_ms.p99) + " ms (p99).";
  if (s.depth_drift_ppm)
    about += " The depth camera's clock runs " + fixed(*s.depth_drift_ppm, 1) + " millionths fast" +
             (s.color_drift_ppm ? ", colour's " + fixed(*s.color_drift_ppm, 1) : "") + ".";
  std::string body = frames_table(r);
  if (s.paired + s.depths_unpaired + s.colors_unpaired > 0 && s.paired > 0)
    body += "<p class=\"about\">" + plural(s.paired, "frame has", "frames have") + " a colour frame at most " +
            fixed(Pairing::kSkewMax.milliseconds(), 0) + " ms away; " + grouped(s.depths_unpaired) +
            " have none, and " + plural(s.colors_unpaired, "colour frame", "colour frames") + " found no depth.</p>" +
            skew_table(s);
  return section("sensor", "Sensor", about, body);
}

}  // namespace tactus::firmware
