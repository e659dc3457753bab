#include "firmware_host/record.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/machine.hpp"
#include "firmware_host/open_source.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/summary.hpp"
#include "firmware_host/tac_recording.hpp"

namespace tactus::firmware {
namespace {

using hal::Stream;

constexpr rt::Duration kPatience{10'000'000'000};  // for a device that is away or silent

/// One sentence; empty when the source was at its end or was told to stop.
std::string why_it_ended(const hal::Sensor& sensor, const TacRecorded& recorded) {
  if (recorded.ended.depth == rt::Status::device_lost)
    return "The device went away and did not come back within 10 s; what came before is in the file.";
  if (recorded.ended.depth == rt::Status::timeout)
    return sensor.is_live ? "No depth frame came for 10 s; what came before is in the file."
                          : "The recording stopped answering; what came before is in the file.";
  return {};
}

nlohmann::json json_of(const RecordOptions& options, const hal::Sensor& sensor, const TacRecorded& recorded) {
  const auto stream = [&](Stream which, const hal::Camera& camera) {
    const auto& counts = recorded.counts.streams[static_cast<std::size_t>(which)];
    return nlohmann::json{{"frames", counts.written},
                          {"dropped_by_recorder", counts.dropped},
                          {"refused_by_recorder", counts.refused},
                          {"rate_hz", static_cast<double>(counts.written) / recorded.wall_s},
                          {"frames_missing", camera.counters().frames_missing},
                          {"frames_rejected", camera.counters().frames_rejected},
                          {"timestamps_rejected", camera.counters().timestamps_rejected},
                          {"losses", camera.counters().losses}};
  };
  nlohmann::json j = {{"source", options.source},
                      {"out", options.out.string()},
                      {"description", sensor.description},
                      {"wall_s", recorded.wall_s},
                      {"file_bytes", recorded.counts.file_bytes},
                      {"mb_per_s", static_cast<double>(recorded.counts.file_bytes) / 1e6 / recorded.wall_s},
                      {"depth", stream(Stream::depth, *sensor.depth)},
                      {"labels", recorded.labels_count},
                      {"labels_dropped", recorded.labels_dropped_count},
                      {"ended_by", rt::name(recorded.ended.depth)},
                      {"notes", sensor.notes}};
  if (sensor.color) j["color"] = stream(Stream::color, *sensor.color);
  return j;
}

std::string text_of(const RecordOptions& options, const hal::Sensor& sensor, const TacRecorded& recorded) {
  const auto& depth = recorded.counts.streams[static_cast<std::size_t>(Stream::depth)];
  const auto& color = recorded.counts.streams[static_cast<std::size_t>(Stream::color)];
  const double megabytes = static_cast<double>(recorded.counts.file_bytes) / 1e6;
  char line[320];
  std::snprintf(line, sizeof(line),
                ": %llu depth and %llu colour frames in %.1f s (%.1f and %.1f a second), %.1f MB, %.1f MB/s\n",
                static_cast<unsigned long long>(depth.written), static_cast<unsigned long long>(color.written),
                recorded.wall_s, static_cast<double>(depth.written) / recorded.wall_s,
                static_cast<double>(color.written) / recorded.wall_s, megabytes, megabytes / recorded.wall_s);
  std::string text = options.out.string() + line;
  const auto add = [&](std::uint64_t in_depth, std::uint64_t in_color, const char* what) {
    if (in_depth + in_color > 0)
      text += std::to_string(in_depth) + " depth and " + std::to_string(in_color) + " colour frames " + what + "\n";
  };
  const hal::CameraCounters none;
  const hal::CameraCounters& d = sensor.depth->counters();
  const hal::CameraCounters& c = sensor.color ? sensor.color->counters() : none;
  add(depth.dropped, color.dropped, "were dropped by the recorder: the disk or the processor was behind");
  add(depth.refused, color.refused, "had another size than the camera's");
  add(d.frames_missing, c.frames_missing, "never came from the device");
  add(d.frames_rejected + d.timestamps_rejected, c.frames_rejected + c.timestamps_rejected, "were unusable");
  if (const std::string why = why_it_ended(sensor, recorded); !why.empty()) text += why + "\n";
  for (const std::string& note : sensor.notes) text += "note: " + note + "\n";
  return text;
}

}  // namespace

rt::Result<std::string> record(const RecordOptions& options) {
  catch_signals();
  SourceOptions how;
  how.frames = options.frames;
  auto sensor = open_source(options.source, how);
  if (!sensor) return sensor.error();
  TacRequest request;
  request.out = options.out;
  request.how.color =
      options.color == "jpeg" ? hal::record::TacColor::jpeg : hal::record::TacColor::as_it_came;
  request.how.jpeg_quality = options.jpeg_quality;
  request.info.entries = {{"source", options.source}, {"command", options.command}, {"revision", revision()}};
  // Relaxed: a flag alone.
  request.is_over = [] { return interrupted.load(std::memory_order_relaxed); };
  if (options.seconds > 0) request.span = rt::Duration{static_cast<std::int64_t>(options.seconds * 1e9)};
  request.patience = kPatience;
  const auto recorded = record_tac(*sensor, options.source, request);
  if (!recorded) return recorded.error();
  if (!recorded->written) return recorded->written.error();
  if (recorded->counts.streams[static_cast<std::size_t>(Stream::depth)].written == 0)
    return rt::Error{rt::ExitCode::device_unavailable,
                     options.source + ": not one depth frame came; " + options.out.string() + " is empty."};
  return options.is_json ? to_text(json_of(options, *sensor, *recorded)) : text_of(options, *sensor, *recorded);
}

}  // namespace tactus::firmware
