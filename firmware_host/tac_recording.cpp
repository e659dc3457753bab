#include "firmware_host/tac_recording.hpp"

#include <vector>

#include "firmware_host/progress.hpp"
#include "rt/clock.hpp"

namespace tactus::firmware {

rt::Result<TacRecorded> record_tac(hal::Sensor& sensor, const std::string& source, const TacRequest& request) {
  hal::record::TacOptions how = request.how;
  how.waits_when_full = !sensor.is_live;
  auto created = hal::record::TacWriter::create(request.out, sensor, request.info, how);
  if (!created) return created.error();
  hal::record::TacWriter& writer = **created;
  const rt::Clock clock = rt::Clock::monotonic();
  const rt::HostTime begin = clock.now();
  TacRecorded result;
  Progress progress((sensor.is_live ? "recording " : "writing ") + source, sensor.frames_count, clock);
  std::uint64_t frames_count = 0;
  std::optional<rt::SensorTime> first;
  bool is_span_over = false;
  const hal::Intrinsics& k = sensor.calibration.depth;
  std::vector<std::uint8_t> ids(sensor.labels && request.has_labels
                                    ? static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height)
                                    : 0);
  StreamsReader reader;
  reader.skips_color = true;
  reader.depth = [&](const hal::FrameHeader& header, std::span<const std::uint16_t>) {
    progress.update(++frames_count);
    if (!first) first = header.time;
    is_span_over = request.span && header.time - *first >= *request.span;
    if (ids.empty() || sensor.labels->read(header.sequence, ids) != rt::Status::ok) return;
    ++(writer.add_labels(header.sequence, ids) ? result.labels_count : result.labels_dropped_count);
  };
  reader.is_over = [&] { return is_span_over || writer.has_stopped() || (request.is_over && request.is_over()); };
  sensor.depth->set_tap(&writer);
  if (sensor.color) sensor.color->set_tap(&writer);
  result.ended = read_streams(sensor, reader, request.patience);
  sensor.depth->set_tap(nullptr);
  if (sensor.color) sensor.color->set_tap(nullptr);
  result.written = writer.close();
  result.counts = writer.was();
  result.wall_s = (clock.now() - begin).seconds();
  return result;
}

}  // namespace tactus::firmware
