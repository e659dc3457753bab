#include "firmware_host/open_source.hpp"

#include <filesystem>
#include <utility>

#include "firmware_host/source_part.hpp"
#include "hal/openni2/openni2.hpp"
#include "hal/record/tac.hpp"
#include "hal/replay/replay.hpp"
#include "hal/synthetic/synthetic.hpp"

namespace tactus::firmware {
namespace {

rt::Result<hal::Sensor> open_part_of_synthetic(const std::string& source, FrameRange frames) {
  auto options = hal::parse_synthetic_name(source);
  if (!options) return options.error();
  auto opened = hal::open_synthetic(*options);
  if (!opened || frames.is_everything()) return opened;
  hal::Sensor& sensor = *opened;
  if (frames.first >= sensor.frames_count) {
    return rt::Error{rt::ExitCode::bad_usage, "--frames begins at " + std::to_string(frames.first) +
                                                  ", but " + source + " has " +
                                                  std::to_string(sensor.frames_count) + " frames."};
  }
  const std::uint64_t last = std::min(frames.last, sensor.frames_count);
  if (sensor.truth.size() == sensor.frames_count) {
    // Gravity is given in the first frame that is played.
    if (sensor.gravity_depth) {
      const Vec3d gravity_world = sensor.truth[0].T_world_depth.rotation * *sensor.gravity_depth;
      sensor.gravity_depth = sensor.truth[frames.first].T_world_depth.rotation.transposed() * gravity_world;
    }
    const auto begin = sensor.truth.begin();
    sensor.truth = {begin + static_cast<std::ptrdiff_t>(frames.first),
                    begin + static_cast<std::ptrdiff_t>(last)};
  }
  sensor.frames_count = last - frames.first;
  play_numbers(sensor, frames);
  sensor.description += ", frames " + std::to_string(frames.first) + " to " + std::to_string(last - 1);
  return opened;
}

rt::Result<hal::Sensor> open_part_of_live(const std::string& source, const SourceOptions& options) {
  const auto parsed = parse_live_source(source);
  if (!parsed) return parsed.error();
  auto sensor = open_live(*parsed, options.live);
  if (sensor && !options.frames.is_everything()) play_next_frames(*sensor, options.frames);
  return sensor;
}

}  // namespace

rt::Result<hal::Sensor> open_source(const std::string& source, const SourceOptions& options) {
  if (source.starts_with("synthetic:")) return open_part_of_synthetic(source, options.frames);
  std::error_code error;
  if (std::filesystem::is_directory(source, error)) {
    return hal::open_replay(source, {options.frames.first, options.frames.last, options.prefetch});
  }
  if (is_live_source(source)) return open_part_of_live(source, options);
  const FrameRange& frames = options.frames;
  if (source.ends_with(".oni")) return hal::openni2::open_oni(source, {frames.first, frames.last, options.prefetch});
  if (source.ends_with(".tac") || hal::record::is_tac(source))
    return hal::record::open_tac(source, {frames.first, frames.last, options.prefetch});
  if (std::filesystem::exists(source, error)) {
    return rt::Error{rt::ExitCode::bad_input,
                     source + ": this is no recording; a folder in TUM RGB-D or 7-Scenes layout is one, or a .tac or .oni file."};
  }
  return rt::Error{
      rt::ExitCode::bad_input,
      source + ": there is no such folder, and no kind of source is called so (see tactus --help)."};
}

const char* source_help() {
  return "SOURCE is one of\n"
         "  DIR                  a recording in TUM RGB-D layout (depth.txt, rgb.txt, intrinsics.txt, "
         "groundtruth.txt)\n"
         "                       or 7-Scenes layout (frame-NNNNNN.depth.png, .color.*, .pose.txt)\n"
         "  synthetic:NAME       a made room with exact truth: bedroom, office, wall, corner; options after "
         "'?',\n"
         "                       joined by '&': frames=N  mode=640x480|960x540|320x240  "
         "trajectory=handheld|still\n"
         "                       seed=N  noise=0|1  registered=0|1  blank=FIRST:COUNT  jump=0|1\n"
         "  FILE.tac             a recording of `tactus record`;  FILE.oni  one of OpenNI2\n"
         "  v4l2:NODE            a depth camera of the kernel (Z16, Y16, Y12), with ?color=NODE or libcamera:ID for colour\n"
         "  openni2[:URI]        a depth camera that OpenNI2 has a driver for, with its own colour or ?color=\n"
         "                       options of both: mode=WxH@HZ  color_mode=  color=  color_format=  "
         "color_controls=NAME:VALUE,...\n"
         "                       calibration=FILE.toml  accelerometer=iio:deviceN; of openni2: registered=0|1  "
         "sync=0|1; of v4l2:\n"
         "                       format=  controls=NAME:VALUE,...  buffers=mmap|userptr|dmabuf[:EXPORTER]\n";
}

}  // namespace tactus::firmware
