#include <algorithm>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "hal/replay/poses.hpp"
#include "hal/replay/recording.hpp"
#include "hal/replay/text.hpp"

namespace tactus::hal::replay {
namespace {

struct NumberedFile {
  std::uint64_t number;
  std::string name;
};

/// All files frame-<digits>.<what> of the folder by number.
rt::Result<std::vector<NumberedFile>> find_frames(const std::filesystem::path& directory,
                                                  std::initializer_list<std::string_view> kinds) {
  std::vector<NumberedFile> out;
  std::error_code error;
  std::filesystem::directory_iterator item(directory, error);
  for (const std::filesystem::directory_iterator end; !error && item != end; item.increment(error)) {
    const std::string name = item->path().filename().string();
    for (const std::string_view kind : kinds)
      if (const auto number = frame_number(name, kind)) out.push_back({*number, name});
  }
  if (error) return bad_input(directory.string(), 0, "the folder cannot be read: " + error.message());
  std::sort(out.begin(), out.end(), [](const NumberedFile& a, const NumberedFile& b) {
    return a.number != b.number ? a.number < b.number : a.name < b.name;
  });
  return out;
}

/// The layout knows no times: frames are taken as 30 Hz.
rt::SensorTime time_of(std::uint64_t number) {
  return {static_cast<std::int64_t>(number) * 1'000'000'000 / 30};
}

FrameList as_list(const std::vector<NumberedFile>& files) {
  FrameList out;
  for (const NumberedFile& file : files) {
    ListEntry entry;
    entry.sequence = file.number;
    entry.time = time_of(file.number);
    entry.path = file.name;
    out.entries.push_back(std::move(entry));
  }
  check_times(out);
  return out;
}

bool is_present(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

rt::Result<RigCalibration> read_calibration(const std::filesystem::path& directory, bool has_color,
                                            std::vector<std::string>& notes) {
  auto full = read_calibration_toml(directory);
  if (!full) return full.error();
  if (*full) return **full;
  std::string text;
  if (const auto path = directory / "calibration.txt"; is_present(path)) {
    if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
    auto parsed = parse_calibration_text(text, path.string());
    if (parsed) parsed->depth_m_per_unit = 0.001;
    return parsed;
  }
  RigCalibration out;
  out.depth_m_per_unit = 0.001;
  out.registered = true;
  if (const auto path = directory / "camera-intrinsics.txt"; is_present(path)) {
    if (auto read = read_file(path, kTextBytesMax, text); !read) return read.error();
    auto parsed = parse_camera_matrix(text, path.string());
    if (!parsed) return parsed.error();
    out.depth = *parsed;
  } else {
    out.depth = {.width = 640, .height = 480, .fx = 585, .fy = 585, .cx = 320, .cy = 240};
    notes.push_back(directory.string() + ": no intrinsics; 7-Scenes' 585 585 320 240 for 640x480 is taken");
  }
  if (has_color)
    notes.push_back(
        directory.string() +
        ": no calibration.txt; colour is taken as registered to depth, which in 7-Scenes recordings is "
        "10 to 35 pixels wrong");
  return out;
}

/// Poses of the depth frames; what is unusable is skipped and told of.
void read_poses(const std::filesystem::path& directory, const std::vector<NumberedFile>& files,
                Recording& out) {
  std::uint64_t skipped_count = 0;
  std::string first_skip;
  std::string text;
  for (const NumberedFile& file : files) {
    const auto path = directory / file.name;
    std::string fault;
    if (auto read = read_file(path, 1 << 16, text); !read) {
      fault = read.error().message;
    } else if (auto pose = parse_pose_matrix(text, path.string()); !pose) {
      fault = pose.error().message;
    } else if (!out.truth.empty() && !(out.truth.back().time < time_of(file.number))) {
      fault = bad_input(path.string(), 0, "a second pose for the same frame").message;
    } else {
      out.truth.push_back({time_of(file.number), *pose});
      continue;
    }
    if (skipped_count++ == 0) first_skip = fault;
  }
  if (skipped_count > 0)
    out.notes.push_back(std::to_string(skipped_count) + " true poses are left out: " + first_skip);
}

}  // namespace

std::optional<std::uint64_t> frame_number(std::string_view file_name, std::string_view what) {
  constexpr std::string_view kPrefix = "frame-";
  constexpr std::size_t kDigitsMax = 9;  // keeps number / 30 Hz far inside int64 nanoseconds
  if (!file_name.starts_with(kPrefix)) return std::nullopt;
  file_name.remove_prefix(kPrefix.size());
  const std::size_t dot = file_name.find('.');
  if (dot == std::string_view::npos || dot > kDigitsMax || file_name.substr(dot + 1) != what)
    return std::nullopt;
  return parse_count(file_name.substr(0, dot));
}

bool has_seven_scenes_frames(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::directory_iterator item(directory, error);
  for (const std::filesystem::directory_iterator end; !error && item != end; item.increment(error))
    if (frame_number(item->path().filename().string(), "depth.png")) return true;
  return false;
}

rt::Result<Recording> read_seven_scenes_folder(const std::filesystem::path& directory) {
  Recording out;
  out.directory = directory;
  out.layout = "7-Scenes layout";
  auto depth = find_frames(directory, {"depth.png"});
  auto color = find_frames(directory, {"color.png", "color.jpg", "color.jpeg"});
  auto labels = find_frames(directory, {"label.png"});
  auto poses = find_frames(directory, {"pose.txt"});
  for (const auto* found : {&depth, &color, &labels, &poses})
    if (!*found) return found->error();
  if (depth->empty()) return bad_input(directory.string(), 0, "holds no frame-NNNNNN.depth.png");
  out.depth = as_list(*depth);
  if (!color->empty()) out.color = as_list(*color);
  if (!labels->empty()) out.labels = as_list(*labels);
  auto calibration = read_calibration(directory, out.color.has_value(), out.notes);
  if (!calibration) return calibration.error();
  out.calibration = *calibration;
  read_poses(directory, *poses, out);
  auto own_gravity = read_gravity(directory, "gravity.txt");
  if (!own_gravity) return own_gravity.error();
  out.gravity_first_depth = *own_gravity;
  auto world_gravity = read_gravity(directory, "gravity-direction.txt");
  if (!world_gravity) return world_gravity.error();
  out.gravity_truth_world = *world_gravity;
  return out;
}

}  // namespace tactus::hal::replay
