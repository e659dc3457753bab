#include <algorithm>
#include <array>
#include <cstdio>

#include "firmware_host/commands.hpp"
#include "firmware_host/machine.hpp"
#include "firmware_host/progress.hpp"
#include "firmware_host/tac_recording.hpp"
#include "hal/openni2/oni_writer.hpp"
#include "hal/replay/recording_writer.hpp"

namespace tactus::firmware {
namespace {

struct Written {
  std::uint64_t depth_frames = 0, color_frames = 0;
};

/// RecordingWriter and OniWriter: one step a depth frame.
template <typename Writer>
rt::Result<Written> write_all(Writer& writer, Progress& progress) {
  for (;;) {
    const auto has_written = writer.step();
    if (!has_written) return has_written.error();
    if (!*has_written) return Written{writer.depth_frames_count(), writer.color_frames_count()};
    progress.update(writer.depth_frames_count());
  }
}

rt::Result<Written> write_folder(const ConvertOptions& options, hal::Sensor& sensor, Progress& progress) {
  hal::RecordingOptions how;
  how.layout = options.layout == "7scenes" ? hal::RecordingLayout::seven_scenes : hal::RecordingLayout::tum;
  how.color = options.color == "png" ? hal::ColorEncoding::png : hal::ColorEncoding::jpeg;
  how.write_labels = options.has_labels;
  auto writer = hal::RecordingWriter::open(options.out, sensor, how);
  if (!writer) return writer.error();
  return write_all(*writer, progress);
}

rt::Result<Written> write_oni(const ConvertOptions& options, hal::Sensor& sensor, Progress& progress) {
  auto writer = hal::openni2::OniWriter::open(options.out, sensor);
  if (!writer) return writer.error();
  return write_all(*writer, progress);
}

rt::Result<Written> write_tac(const ConvertOptions& options, hal::Sensor& sensor) {
  TacRequest request;
  request.out = options.out;
  request.how.color = options.color == "jpeg" ? hal::record::TacColor::jpeg : hal::record::TacColor::as_it_came;
  request.has_labels = options.has_labels;
  request.info.entries = {{"source", options.source}, {"command", options.command}, {"revision", revision()}};
  const auto recorded = record_tac(sensor, options.source, request);
  if (!recorded) return recorded.error();
  if (!recorded->written) return recorded->written.error();
  if (recorded->ended.depth != rt::Status::end_of_stream && recorded->ended.depth != rt::Status::ok)
    return rt::Error{rt::ExitCode::device_unavailable,
                     options.source + ": no more frames came; " + options.out.string() + " holds those before."};
  return Written{recorded->counts.streams[0].written, recorded->counts.streams[1].written};
}

/// The kind of recording that OUT's ending means.
std::string layout_of(const std::filesystem::path& out) {
  if (out.extension() == ".tac") return "tac";
  return out.extension() == ".oni" ? "oni" : "tum";
}

rt::Result<void> check_encoding(const ConvertOptions& options) {
  const std::string& color = options.color;
  const bool is_folder = options.layout == "tum" || options.layout == "7scenes";
  const bool fits = color.empty() || (is_folder ? color != "as-came" : options.layout == "tac" && color != "png");
  if (fits) return {};
  return rt::Error{rt::ExitCode::bad_usage,
                   "--color " + color + ": " +
                       (options.layout == "oni" ? "an .oni file keeps colour as it is; leave --color out."
                        : is_folder             ? "images of a folder are jpeg or png."
                                                : "a .tac file has colour as-came or jpeg.")};
}

}  // namespace

rt::Result<std::string> convert(const ConvertOptions& asked) {
  ConvertOptions options = asked;
  if (options.layout.empty()) options.layout = layout_of(options.out);
  if (auto fits = check_encoding(options); !fits) return fits.error();
  SourceOptions how;
  how.frames = options.frames;
  auto sensor = open_source(options.source, how);
  if (!sensor) return sensor.error();
  rt::Result<Written> written = Written{};
  if (options.layout == "tac") {
    written = write_tac(options, *sensor);
  } else {
    Progress progress("writing " + options.out.string(), sensor->frames_count, rt::Clock::monotonic());
    written = options.layout == "oni" ? write_oni(options, *sensor, progress) : write_folder(options, *sensor, progress);
  }
  if (!written) return written.error();
  std::string text = options.out.string() + ": " + std::to_string(written->depth_frames) + " depth and " +
                     std::to_string(written->color_frames) + " colour frames written\n";
  const double unit_m = sensor->calibration.depth_m_per_unit;
  const bool keeps_unit = options.layout == "tum" || options.layout == "tac" || unit_m == 0.001 ||
                          (options.layout == "oni" && unit_m == 0.0001);
  if (!keeps_unit) text += "depth was rounded to whole millimetres, which is all that such a recording can hold\n";
  const hal::CameraCounters& counters = sensor->depth->counters();
  if (counters.frames_rejected + counters.timestamps_rejected > 0) {
    text += std::to_string(counters.frames_rejected + counters.timestamps_rejected) +
            " depth frames of the source were left out: " + counters.first_rejection + "\n";
  }
  return text;
}

}  // namespace tactus::firmware
