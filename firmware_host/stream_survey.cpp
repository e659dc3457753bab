#include "firmware_host/stream_survey.hpp"

#include <span>
#include <vector>

#include "firmware_host/progress.hpp"
#include "firmware_host/streams.hpp"
#include "rt/clock.hpp"

namespace tactus::firmware {
namespace {

// Long enough for a clock's drift, which needs three seconds, and short enough to wait for.
constexpr rt::Duration kLiveSpan{5'000'000'000};
constexpr rt::Duration kPatience{3'000'000'000};

class DepthHistogram {
 public:
  DepthHistogram() : counts_(65536, 0) {}
  void add(std::span<const std::uint16_t> raw) {
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

StreamInfo info_of(const std::vector<hal::FrameHeader>& headers, double frame_rate_hz, const ClockFit& clock) {
  StreamInfo info;
  info.frames_count = headers.size();
  if (headers.empty()) return info;
  info.first = headers.front().time;
  info.last = headers.back().time;
  const auto long_pause_ns = static_cast<std::int64_t>(1.5e9 / frame_rate_hz);
  for (std::size_t i = 1; i < headers.size(); ++i) {
    const rt::Duration pause = headers[i].time - headers[i - 1].time;
    if (pause.ns > long_pause_ns) ++info.gaps_count;
    if (pause > info.gap_max) {
      info.gap_max = pause;
      info.gap_max_before = headers[i].sequence;
    }
    if (headers[i].sequence > headers[i - 1].sequence + 1)
      info.missing_count += headers[i].sequence - headers[i - 1].sequence - 1;
  }
  info.drift_ppm = clock.drift_ppm();
  return info;
}

/// As the pipeline does it, but with both clocks known from the start.
void pair(const std::vector<hal::FrameHeader>& depth, const std::vector<hal::FrameHeader>& color, Pairing& pairing) {
  std::size_t next = 0;
  for (const hal::FrameHeader& frame : depth) {
    Match match = Match::late;
    while (next < color.size() && (match = pairing.match(frame, color[next])) == Match::early) {
      pairing.count_color_alone();
      ++next;
    }
    if (next < color.size() && match == Match::partner)
      pairing.count_pair(frame, color[next++]);
    else
      pairing.count_depth_alone();
  }
  for (; next < color.size(); ++next) pairing.count_color_alone();
}

}  // namespace

Survey survey(hal::Sensor& sensor, const std::string& source, FrameRange frames) {
  const rt::Clock clock = rt::Clock::monotonic();
  const std::uint64_t last = frames.is_everything() || !sensor.is_live ? sensor.frames_count : frames.last - frames.first;
  Progress progress("reading " + source, last, clock);
  const rt::HostTime begin = clock.now();
  std::vector<hal::FrameHeader> depth, color;
  DepthHistogram histogram;
  StreamsReader reader;
  reader.depth = [&](const hal::FrameHeader& header, std::span<const std::uint16_t> raw) {
    depth.push_back(header);
    histogram.add(raw);
    progress.update(depth.size());
  };
  reader.color = [&](const hal::FrameHeader& header) { color.push_back(header); };
  if (sensor.is_live && frames.is_everything()) reader.is_over = [&] { return clock.now() - begin > kLiveSpan; };
  const StreamsEnd end = read_streams(sensor, reader, kPatience);

  Survey out;
  out.pairing.configure(sensor.frame_rate_hz, sensor.has_two_clocks);
  for (const hal::FrameHeader& header : depth) out.pairing.saw_depth(header);
  for (const hal::FrameHeader& header : color) out.pairing.saw_color(header);
  const hal::RigCalibration& rig = sensor.calibration;
  out.depth = info_of(depth, sensor.frame_rate_hz, out.pairing.depth_clock());
  out.depth.counters = sensor.depth->counters();
  out.depth.ended_by = end.depth;
  out.content = histogram.content(rig.depth_m_per_unit);
  out.pixel_bytes = depth.size() * static_cast<std::size_t>(rig.depth.width * rig.depth.height) * 2;
  if (sensor.color) {
    pair(depth, color, out.pairing);
    out.color = info_of(color, sensor.frame_rate_hz, out.pairing.color_clock());
    out.color->counters = sensor.color->counters();
    out.color->ended_by = end.color;
    out.pixel_bytes += color.size() * static_cast<std::size_t>(rig.color.width * rig.color.height) * 3;
  }
  return out;
}

}  // namespace tactus::firmware
