#include <cmath>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/gravity_file.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "hal/replay/poses.hpp"
#include "hal/replay/recording.hpp"
#include "hal/replay/text.hpp"

namespace tactus::hal::replay {
namespace {

bool is_present(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

rt::Result<FrameList> read_list(const std::filesystem::path& directory, const char* name) {
  std::string text;
  if (auto read = read_file(directory / name, kTextBytesMax, text); !read) return read.error();
  auto list = parse_frame_list(text, (directory / name).string());
  if (list) list->file = name;
  return list;
}

/// Two files that both state the depth camera must agree, or nobody knows which one is meant.
bool agree(const RigCalibration& a, const RigCalibration& b) {
  const auto near = [](double x, double y) { return std::fabs(x - y) <= 1e-6 * std::fabs(x); };
  return a.depth.width == b.depth.width && a.depth.height == b.depth.height && near(a.depth.fx, b.depth.fx) &&
         near(a.depth.fy, b.depth.fy) && near(a.depth.cx, b.depth.cx) && near(a.depth.cy, b.depth.cy) &&
         near(a.depth_m_per_unit, b.depth_m_per_unit);
}

RigCalibration tum_default() {
  RigCalibration out;
  out.depth = {.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 319.5, .cy = 239.5};
  out.color = out.depth;
  out.depth_m_per_unit = 1.0 / 5000;
  out.registered = true;
  return out;
}

rt::Result<RigCalibration> read_calibration(const std::filesystem::path& directory,
                                            std::vector<std::string>& notes) {
  std::optional<RigCalibration> simple;
  const auto path = directory / "intrinsics.txt";
  if (is_present(path)) {
    std::string text;
    if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
    auto parsed = parse_intrinsics(text, path.string());
    if (!parsed) return parsed.error();
    simple = *parsed;
  }
  auto full = read_calibration_toml(directory);
  if (!full) return full.error();
  if (*full) {
    if (simple && !agree(**full, *simple))
      return bad_input(path.string(), 0,
                       "says another depth camera than calibration.toml beside it; remove one");
    return **full;
  }
  if (simple) return *simple;
  notes.push_back(path.string() + " is missing: TUM's default of 525 525 319.5 239.5 640 480 5000 is taken");
  return tum_default();
}

}  // namespace

rt::Result<std::optional<RigCalibration>> read_calibration_toml(const std::filesystem::path& directory) {
  const auto path = directory / "calibration.toml";
  if (!is_present(path)) return std::optional<RigCalibration>{};
  std::string text;
  if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
  auto parsed = parse_calibration_toml(text, path.string());
  if (!parsed) return parsed.error();
  return std::optional<RigCalibration>(*parsed);
}

rt::Result<std::optional<Vec3d>> read_gravity(const std::filesystem::path& directory, const char* name) {
  const auto path = directory / name;
  if (!is_present(path)) return std::optional<Vec3d>{};
  std::string text;
  if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
  auto parsed = parse_gravity(text, path.string());
  if (!parsed) return parsed.error();
  return std::optional<Vec3d>(*parsed);
}

rt::Result<Recording> read_tum_folder(const std::filesystem::path& directory) {
  Recording out;
  out.directory = directory;
  out.layout = "TUM RGB-D layout";
  auto depth = read_list(directory, "depth.txt");
  if (!depth) return depth.error();
  out.depth = std::move(*depth);
  if (is_present(directory / "rgb.txt")) {
    auto color = read_list(directory, "rgb.txt");
    if (!color) return color.error();
    out.color = std::move(*color);
  }
  if (is_present(directory / "label.txt")) {
    auto labels = read_list(directory, "label.txt");
    if (!labels) return labels.error();
    out.labels = std::move(*labels);
  }
  auto calibration = read_calibration(directory, out.notes);
  if (!calibration) return calibration.error();
  out.calibration = *calibration;

  if (const auto path = directory / "groundtruth.txt"; is_present(path)) {
    std::string text;
    if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
    Trajectory trajectory = parse_trajectory(text, path.string());
    if (trajectory.skipped_count > 0)
      out.notes.push_back(std::to_string(trajectory.skipped_count) +
                          " true poses are left out: " + trajectory.first_skip);
    if (trajectory.poses.empty()) out.notes.push_back(path.string() + " holds no usable pose");
    out.truth = std::move(trajectory.poses);
  }
  auto gravity = read_gravity(directory, "gravity.txt");
  if (!gravity) return gravity.error();
  out.gravity_first_depth = *gravity;
  if (const auto path = directory / "accelerometer.txt"; !*gravity && is_present(path))
    if (auto read = read_file(path, kTextBytesMax, out.accelerometer_text); !read) return read.error();
  return out;
}

}  // namespace tactus::hal::replay
