#include <cstdio>

#include "firmware_host/commands.hpp"
#include "firmware_host/progress.hpp"
#include "hal/replay/recording_writer.hpp"

namespace tactus::firmware {

rt::Result<std::string> convert(const ConvertOptions& options) {
  auto sensor = open_source(options.source, {options.frames, 0});
  if (!sensor) return sensor.error();
  hal::RecordingOptions recording;
  recording.layout = options.layout == "tum" ? hal::RecordingLayout::tum : hal::RecordingLayout::seven_scenes;
  recording.color = options.color == "png" ? hal::ColorEncoding::png : hal::ColorEncoding::jpeg;
  recording.write_labels = options.has_labels;
  auto writer = hal::RecordingWriter::open(options.out, *sensor, recording);
  if (!writer) return writer.error();
  Progress progress("writing " + options.out.string(), sensor->frames_count, rt::Clock::monotonic());
  for (;;) {
    auto has_written = writer->step();
    if (!has_written) return has_written.error();
    if (!*has_written) break;
    progress.update(writer->depth_frames_count());
  }
  progress.finish();
  std::string text = options.out.string() + ": " + std::to_string(writer->depth_frames_count()) +
                     " depth and " + std::to_string(writer->color_frames_count()) +
                     " colour frames written\n";
  const hal::CameraCounters& counters = sensor->depth->counters();
  if (counters.frames_rejected + counters.timestamps_rejected > 0) {
    text += std::to_string(counters.frames_rejected + counters.timestamps_rejected) +
            " depth frames of the source were left out: " + counters.first_rejection + "\n";
  }
  return text;
}

}  // namespace tactus::firmware
