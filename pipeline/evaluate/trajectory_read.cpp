// Trajectories from outside: every byte is suspect.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/evaluate/text.hpp"
#include "pipeline/evaluate/trajectory.hpp"

namespace tactus::evaluate {
namespace {

rt::Error bad_line(const std::filesystem::path& file, std::size_t line_number, const std::string& what) {
  return {rt::ExitCode::bad_input, file.string() + ":" + std::to_string(line_number) + ": " + what};
}

/// Rows orthonormal to 1 % and determinant +1: what a rotation printed with few digits still satisfies.
bool is_rotation(const Rotation& r) {
  const Rotation rrt = r * r.transposed();
  const Rotation identity;
  for (std::size_t i = 0; i < 9; ++i)
    if (!(std::abs(rrt.m[i] - identity.m[i]) < 0.01)) return false;
  const auto& m = r.m;
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
             m[2] * (m[3] * m[7] - m[4] * m[6]) >
         0;
}

/// "frame-000123.pose.txt" -> 123.
bool frame_number(const std::string& name, std::int64_t& number) {
  constexpr std::string_view kHead = "frame-", kTail = ".pose.txt";
  if (!name.starts_with(kHead) || !name.ends_with(kTail) || name.size() <= kHead.size() + kTail.size())
    return false;
  const auto digits = std::string_view(name).substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  return digits.size() <= 9 && digits.find_first_not_of("0123456789") == std::string_view::npos &&
         parse_number(digits, number);
}

/// Folders are listed in order of their frame numbers, which is the order of time.
struct PoseFile {
  std::int64_t frame;
  std::filesystem::path path;
};

std::vector<PoseFile> pose_files(const std::filesystem::path& folder) {
  std::vector<PoseFile> files;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::int64_t frame = 0;
    if (frame_number(it->path().filename().string(), frame)) files.push_back({frame, it->path()});
  }
  std::sort(files.begin(), files.end(),
            [](const PoseFile& a, const PoseFile& b) { return a.frame < b.frame; });
  return files;
}

}  // namespace

rt::Result<Trajectory> read_tum_trajectory(const std::filesystem::path& file) {
  auto bytes = read_file(file);
  if (!bytes) return bytes.error();
  Trajectory trajectory;
  std::string_view text = *bytes;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
    std::array<double, 8> v{};
    if (!parse_numbers(line, v)) {
      return bad_line(file, line_number,
                      "a pose is 8 finite numbers, time tx ty tz qx qy qz qw; this line is not.");
    }
    // Up to the year 2115 the difference of two times fits 63 bits of nanoseconds.
    if (!(std::abs(v[0]) < 4.6e9))
      return bad_line(file, line_number, "the time is out of range (seconds expected).");
    const double norm = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
    if (!(std::abs(norm - 1) < 0.01)) {
      return bad_line(file, line_number, "the quaternion has length " + std::to_string(norm) + ", not 1.");
    }
    const rt::SensorTime time{static_cast<std::int64_t>(std::llround(v[0] * 1e9))};
    if (!trajectory.poses.empty() && time <= trajectory.poses.back().time) {
      return bad_line(file, line_number, "the time is not later than that of the pose before.");
    }
    const Quaternion q = Quaternion{v[7], v[4], v[5], v[6]}.normalized();
    trajectory.poses.push_back({time, {Rotation::from(q), {v[1], v[2], v[3]}}});
  }
  if (trajectory.poses.empty()) {
    return rt::Error{rt::ExitCode::bad_input, file.string() + ": there is no pose in this file."};
  }
  return trajectory;
}

rt::Result<Trajectory> read_seven_scenes_trajectory(const std::filesystem::path& folder) {
  Trajectory trajectory;
  for (const PoseFile& file : pose_files(folder)) {
    auto bytes = read_file(file.path, 4096);
    if (!bytes) return bytes.error();
    std::string text = *bytes;
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    std::string_view rest = text;
    std::array<double, 16> v{};
    bool is_valid = true;
    for (double& number : v) {
      const std::string_view word = take_word(rest);
      // "-1.#IND" is how the recorder of 7-Scenes (on Windows) writes NaN.
      if (word.find("#IND") != std::string_view::npos || word.find("#QNAN") != std::string_view::npos) {
        number = std::numeric_limits<double>::quiet_NaN();
      } else if (!parse_number(word, number)) {
        return rt::Error{rt::ExitCode::bad_input,
                         file.path.string() + ": a pose is 16 numbers (4x4, row by row); this is not."};
      }
      is_valid = is_valid && std::isfinite(number);
    }
    if (!take_word(rest).empty()) {
      return rt::Error{rt::ExitCode::bad_input,
                       file.path.string() + ": a pose is 16 numbers; here are more."};
    }
    const T_WorldDepth T_world_depth{{{v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]}},
                                     {v[3], v[7], v[11]}};
    is_valid = is_valid && is_rotation(T_world_depth.rotation);
    if (!is_valid) {
      ++trajectory.rejected_count;
      if (trajectory.first_rejection.empty()) {
        trajectory.first_rejection = file.path.string() + ": the matrix is not a finite rigid motion.";
      }
      continue;
    }
    const rt::SensorTime time{file.frame * 1'000'000'000 / kSevenScenesRateHz};
    trajectory.poses.push_back({time, T_world_depth.orthonormalized()});
  }
  if (trajectory.poses.empty()) {
    return rt::Error{rt::ExitCode::bad_input,
                     folder.string() + (trajectory.rejected_count == 0
                                            ? ": there is no frame-NNNNNN.pose.txt in this folder."
                                            : ": no pose is usable; " + trajectory.first_rejection)};
  }
  return trajectory;
}

rt::Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return read_tum_trajectory(path);
  for (const char* name : {"groundtruth.txt", "trajectory.txt"})
    if (std::filesystem::exists(path / name, error)) return read_tum_trajectory(path / name);
  auto trajectory = read_seven_scenes_trajectory(path);
  if (!trajectory && pose_files(path).empty()) {
    return rt::Error{
        rt::ExitCode::bad_input,
        path.string() + ": this folder has no groundtruth.txt, trajectory.txt or frame-NNNNNN.pose.txt."};
  }
  return trajectory;
}

}  // namespace tactus::evaluate
