#include "hal/replay/recording_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "hal/replay/image_codec.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "hal/replay/recording.hpp"

namespace tactus::hal {
namespace {

using replay::kPairDistanceMax;

/// A live device that says nothing for this long ends the recording with an error.
constexpr rt::Duration kSilenceMax{1'000'000'000};

std::string time_text(rt::SensorTime time) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%lld.%09lld", static_cast<long long>(time.ns / 1'000'000'000),
                static_cast<long long>(time.ns % 1'000'000'000));
  return buffer.data();
}

std::string exact(double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.17g", value);
  return buffer.data();
}

std::string numbered(std::uint64_t number) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%06llu", static_cast<unsigned long long>(number));
  return buffer.data();
}

rt::Error cannot_write(const std::filesystem::path& path) {
  return {rt::ExitCode::failed,
          path.string() + ": cannot be written; is the disk full, or the folder read-only?"};
}

rt::Result<void> write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) return cannot_write(path);
  return {};
}

/// One line at a time, on disk before the next.
class ListFile {
 public:
  rt::Result<void> open(const std::filesystem::path& path) {
    path_ = path;
    file_.open(path, std::ios::binary);
    file_ << "# timestamp path\n" << std::flush;
    if (!file_) return cannot_write(path_);
    return {};
  }
  rt::Result<void> add(rt::SensorTime time, const std::string& frame_path) {
    file_ << time_text(time) << ' ' << frame_path << '\n' << std::flush;
    if (!file_) return cannot_write(path_);
    return {};
  }

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

/// intrinsics.txt says everything about this rig.
bool is_simple(const RigCalibration& rig) {
  return !rig.depth.has_distortion() && (rig.registered || !rig.has_color);
}

/// Whole millimetres as 7-Scenes has them.
void to_millimetres(std::span<const std::uint16_t> depth, double m_per_unit, std::span<std::uint16_t> out) {
  constexpr double kMmMax = 65534;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const double mm = m_per_unit == 0.001 ? depth[i] : std::floor(depth[i] * m_per_unit * 1000 + 0.5);
    out[i] = mm > kMmMax ? std::uint16_t{0} : static_cast<std::uint16_t>(mm);
  }
}

std::size_t pixels_of(const Intrinsics& k) {
  return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
}

}  // namespace

struct RecordingWriter::State {
  struct ColorFrame {
    std::vector<std::uint8_t> rgb;
    FrameHeader header;
    bool is_filled = false;
  };

  State(std::filesystem::path folder, Sensor& source, const RecordingOptions& how)
      : directory(std::move(folder)), sensor(source), options(how) {}

  std::filesystem::path directory;
  Sensor& sensor;
  RecordingOptions options;
  ListFile depth_list, color_list, label_list;
  std::vector<std::uint16_t> depth, depth_mm;
  std::vector<std::uint8_t> ids;
  ColorFrame color, color_ahead;  // TUM uses the first only
  bool depth_ended = false, color_ended = false;
  std::uint64_t depth_count = 0, color_count = 0;

  [[nodiscard]] bool is_tum() const { return options.layout == RecordingLayout::tum; }

  rt::Result<void> start() {
    const RigCalibration& rig = sensor.calibration;
    depth.resize(pixels_of(rig.depth));
    depth_mm.resize(is_tum() ? 0 : depth.size());
    ids.resize(sensor.labels && options.write_labels ? depth.size() : 0);
    color_ended = sensor.color == nullptr;
    if (sensor.color) {
      color.rgb.resize(pixels_of(rig.color) * 3);
      color_ahead.rgb.resize(is_tum() ? 0 : color.rgb.size());
    }
    if (sensor.gravity_depth) {
      const Vec3d g = *sensor.gravity_depth;
      const std::string text =
          "# direction of gravity in the first depth frame (x right, y down, z forward)\n" + exact(g.x) +
          " " + exact(g.y) + " " + exact(g.z) + "\n";
      if (auto wrote = write_text(directory / "gravity.txt", text); !wrote) return wrote;
    }
    return is_tum() ? start_tum() : start_seven_scenes();
  }

  rt::Result<void> start_tum() {
    const RigCalibration& rig = sensor.calibration;
    if (auto wrote = make_folder("depth"); !wrote) return wrote;
    if (auto opened = depth_list.open(directory / "depth.txt"); !opened) return opened;
    if (sensor.color) {
      if (auto wrote = make_folder("rgb"); !wrote) return wrote;
      if (auto opened = color_list.open(directory / "rgb.txt"); !opened) return opened;
    }
    if (!ids.empty()) {
      if (auto wrote = make_folder("label"); !wrote) return wrote;
      if (auto opened = label_list.open(directory / "label.txt"); !opened) return opened;
    }
    if (auto wrote = write_text(directory / "intrinsics.txt", replay::format_intrinsics(rig)); !wrote)
      return wrote;
    if (!is_simple(rig))
      if (auto wrote = write_text(directory / "calibration.toml", replay::format_calibration_toml(rig));
          !wrote)
        return wrote;
    if (sensor.truth.empty()) return {};
    std::string text = "# true poses, camera to world, metres\n# timestamp tx ty tz qx qy qz qw\n";
    for (const TruthPose& pose : sensor.truth) {
      const Quaternion q = pose.T_world_depth.rotation.quaternion();
      text += time_text(pose.time);
      const Vec3d& t = pose.T_world_depth.translation;
      for (const double v : {t.x, t.y, t.z, q.x, q.y, q.z, q.w}) text += " " + exact(v);
      text += "\n";
    }
    return write_text(directory / "groundtruth.txt", text);
  }

  rt::Result<void> start_seven_scenes() {
    RigCalibration rig = sensor.calibration;
    rig.depth_m_per_unit = 0.001;
    return write_text(directory / "calibration.toml", replay::format_calibration_toml(rig));
  }

  rt::Result<void> make_folder(const char* name) {
    std::error_code error;
    std::filesystem::create_directories(directory / name, error);
    if (error) return cannot_write(directory / name);
    return {};
  }

  /// Reads until a good frame or the end, passing over rejected ones. False at the end.
  template <typename Camera, typename Pixels>
  rt::Result<bool> read_good(Camera& camera, Pixels& pixels, FrameHeader& header) {
    for (;;) {
      switch (camera.read(pixels, header, kSilenceMax)) {
        case rt::Status::ok:
          return true;
        case rt::Status::end_of_stream:
          return false;
        case rt::Status::corrupt:
          continue;
        case rt::Status::timeout:
          return rt::Error{rt::ExitCode::device_unavailable,
                           sensor.description + ": no frame within a second"};
        default:
          return rt::Error{rt::ExitCode::device_unavailable, sensor.description + ": the device was lost"};
      }
    }
  }

  rt::Result<bool> read_color(ColorFrame& frame) {
    frame.is_filled = false;
    if (color_ended) return false;
    auto got = read_good(*sensor.color, frame.rgb, frame.header);
    if (!got) return got;
    color_ended = !*got;
    frame.is_filled = *got;
    return got;
  }

  [[nodiscard]] const char* color_extension() const {
    return options.color == ColorEncoding::png ? ".png" : ".jpg";
  }

  rt::Result<void> write_color(const std::filesystem::path& path, const ColorFrame& frame) {
    const Intrinsics& k = sensor.calibration.color;
    ++color_count;
    if (options.color == ColorEncoding::png)
      return replay::write_color_png(path, frame.rgb, k.width, k.height);
    return replay::write_color_jpeg(path, frame.rgb, k.width, k.height, options.jpeg_quality);
  }

  /// Writes the label image of a depth frame to `path` when there is one; false when not.
  rt::Result<bool> write_label(std::uint64_t sequence, const std::filesystem::path& path) {
    if (ids.empty() || sensor.labels->read(sequence, ids) != rt::Status::ok) return false;
    const Intrinsics& k = sensor.calibration.depth;
    if (auto wrote = replay::write_label_png(path, ids, k.width, k.height); !wrote) return wrote.error();
    return true;
  }

  rt::Result<bool> step_tum() {
    const Intrinsics& k = sensor.calibration.depth;
    FrameHeader header;
    if (!depth_ended) {
      auto got = read_good(*sensor.depth, depth, header);
      if (!got) return got;
      depth_ended = !*got;
      if (*got) {
        const std::string name = numbered(header.sequence) + ".png";
        if (auto wrote = replay::write_depth_png(directory / "depth" / name, depth, k.width, k.height);
            !wrote)
          return wrote.error();
        if (auto added = depth_list.add(header.time, "depth/" + name); !added) return added.error();
        ++depth_count;
        auto labelled = write_label(header.sequence, directory / "label" / name);
        if (!labelled) return labelled;
        if (*labelled)
          if (auto added = label_list.add(header.time, "label/" + name); !added) return added.error();
      }
    }
    auto got = read_color(color);
    if (!got) return got;
    if (*got) {
      const std::string name = "rgb/" + numbered(color.header.sequence) + color_extension();
      if (auto wrote = write_color(directory / name, color); !wrote) return wrote.error();
      if (auto added = color_list.add(color.header.time, name); !added) return added.error();
    }
    return !(depth_ended && color_ended);
  }

  static std::int64_t distance_ns(const ColorFrame& frame, rt::SensorTime time) {
    const std::int64_t d = frame.header.time.ns - time.ns;
    return d < 0 ? -d : d;
  }

  rt::Result<bool> step_seven_scenes() {
    const Intrinsics& k = sensor.calibration.depth;
    FrameHeader header;
    auto got = read_good(*sensor.depth, depth, header);
    if (!got) return got;
    if (!*got) return false;
    const std::string stem = "frame-" + numbered(header.sequence);
    to_millimetres(depth, sensor.calibration.depth_m_per_unit, depth_mm);
    if (auto wrote = replay::write_depth_png(directory / (stem + ".depth.png"), depth_mm, k.width, k.height);
        !wrote)
      return wrote.error();
    ++depth_count;
    if (auto labelled = write_label(header.sequence, directory / (stem + ".label.png")); !labelled)
      return labelled;

    // Colour: step forward while the frame ahead is nearer to this depth frame than the one at hand.
    if (!color.is_filled && !color_ended)
      if (auto read = read_color(color); !read) return read;
    if (!color_ahead.is_filled && !color_ended)
      if (auto read = read_color(color_ahead); !read) return read;
    while (color_ahead.is_filled && distance_ns(color_ahead, header.time) < distance_ns(color, header.time)) {
      std::swap(color, color_ahead);
      if (auto read = read_color(color_ahead); !read) return read;
    }
    if (color.is_filled && distance_ns(color, header.time) <= kPairDistanceMax.ns)
      if (auto wrote = write_color(directory / (stem + ".color" + color_extension()), color); !wrote)
        return wrote.error();

    const auto& truth = sensor.truth;
    const auto nearest =
        std::min_element(truth.begin(), truth.end(), [&](const TruthPose& a, const TruthPose& b) {
          return std::abs(a.time.ns - header.time.ns) < std::abs(b.time.ns - header.time.ns);
        });
    if (nearest == truth.end() || std::abs(nearest->time.ns - header.time.ns) > kPairDistanceMax.ns)
      return true;
    const auto& m = nearest->T_world_depth.rotation.m;
    const Vec3d& t = nearest->T_world_depth.translation;
    std::string text;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) text += exact(m[row * 3 + column]) + " ";
      text += exact(row == 0 ? t.x : row == 1 ? t.y : t.z) + "\n";
    }
    if (auto wrote = write_text(directory / (stem + ".pose.txt"), text + "0 0 0 1\n"); !wrote)
      return wrote.error();
    return true;
  }
};

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

rt::Result<RecordingWriter> RecordingWriter::open(const std::filesystem::path& directory, Sensor& sensor,
                                                  const RecordingOptions& options) {
  TACTUS_ASSERT(sensor.depth != nullptr);
  std::error_code error;
  if (std::filesystem::exists(directory, error) && !std::filesystem::is_empty(directory, error))
    return rt::Error{rt::ExitCode::bad_usage,
                     directory.string() + ": exists and is not empty; name a new folder for the recording"};
  std::filesystem::create_directories(directory, error);
  if (error) return cannot_write(directory);
  auto state = std::make_unique<State>(directory, sensor, options);
  if (auto started = state->start(); !started) return started.error();
  return RecordingWriter(std::move(state));
}

rt::Result<bool> RecordingWriter::step() {
  return state_->is_tum() ? state_->step_tum() : state_->step_seven_scenes();
}

std::uint64_t RecordingWriter::depth_frames_count() const { return state_->depth_count; }
std::uint64_t RecordingWriter::color_frames_count() const { return state_->color_count; }

rt::Result<std::uint64_t> write_recording(const std::filesystem::path& directory, Sensor& sensor,
                                          const RecordingOptions& options) {
  auto writer = RecordingWriter::open(directory, sensor, options);
  if (!writer) return writer.error();
  for (;;) {
    auto more = writer->step();
    if (!more) return more.error();
    if (!*more) return writer->depth_frames_count();
  }
}

}  // namespace tactus::hal
