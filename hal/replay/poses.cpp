#include "hal/replay/poses.hpp"

#include <array>
#include <cmath>

#include "hal/replay/lists.hpp"
#include "hal/replay/text.hpp"

namespace tactus::hal::replay {
namespace {

constexpr double kUnitTolerance = 0.01;  // published trajectories carry four decimals: off by 1e-4 at most

struct PoseLine {
  TruthPose pose;
  const char* fault = nullptr;
};

PoseLine parse_pose_line(std::string_view line) {
  PoseLine out;
  const auto ns = parse_seconds_as_ns(next_word(line));
  if (!ns) {
    out.fault = "the timestamp is not a time in seconds";
    return out;
  }
  out.pose.time = {*ns};
  std::array<double, 7> v{};
  for (double& value : v) {
    const auto number = parse_number(next_word(line));
    if (!number) {
      out.fault = "needs 8 finite numbers: timestamp tx ty tz qx qy qz qw";
      return out;
    }
    value = *number;
  }
  if (!next_word(line).empty()) {
    out.fault = "has more than 8 numbers: timestamp tx ty tz qx qy qz qw";
    return out;
  }
  const Quaternion q{v[6], v[3], v[4], v[5]};
  const double norm = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (!(std::fabs(norm - 1) <= kUnitTolerance)) {
    out.fault = "the quaternion is not of unit length";
    return out;
  }
  out.pose.T_world_depth = {Rotation::from(q.normalized()), {v[0], v[1], v[2]}};
  return out;
}

}  // namespace

Trajectory parse_trajectory(std::string_view text, std::string_view file) {
  Trajectory out;
  const auto skip = [&](int line, std::string_view what) {
    if (out.skipped_count++ == 0) out.first_skip = bad_input(file, line, what).message;
  };
  std::vector<TruthPose> poses;
  std::vector<std::int64_t> times;
  std::vector<int> line_numbers;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    const PoseLine parsed = parse_pose_line(line);
    if (parsed.fault != nullptr) {
      skip(lines.line_number(), parsed.fault);
      continue;
    }
    poses.push_back(parsed.pose);
    times.push_back(parsed.pose.time.ns);
    line_numbers.push_back(lines.line_number());
  }
  const std::vector<bool> kept = longest_increasing(times);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (kept[i])
      out.poses.push_back(poses[i]);
    else
      skip(line_numbers[i], "the time does not fit between its neighbours'");
  }
  return out;
}

bool is_rotation(const Rotation& rotation, double tolerance) {
  const Rotation product = rotation * rotation.transposed();
  const Rotation identity;
  for (std::size_t i = 0; i < 9; ++i)
    if (!(std::fabs(product.m[i] - identity.m[i]) <= tolerance)) return false;
  const auto& m = rotation.m;
  return Vec3d{m[0], m[1], m[2]}.cross({m[3], m[4], m[5]}).dot({m[6], m[7], m[8]}) > 0;
}

rt::Result<T_WorldDepth> parse_pose_matrix(std::string_view text, std::string_view file) {
  std::array<double, 16> v{};
  std::size_t count = 0;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const auto number = parse_number(word);
      if (!number) return bad_input(file, lines.line_number(), quote(word) + " is not a finite number");
      if (count == v.size())
        return bad_input(file, lines.line_number(), "more than the 16 numbers of a 4x4 matrix");
      v[count++] = *number;
    }
  }
  if (count != v.size())
    return bad_input(file, 0,
                     "has " + std::to_string(count) + " numbers; a 4x4 camera-to-world matrix has 16");
  constexpr double kLastRowTolerance = 1e-3;
  for (std::size_t i = 12; i < 16; ++i)
    if (!(std::fabs(v[i] - (i == 15 ? 1 : 0)) <= kLastRowTolerance))
      return bad_input(file, 0, "the last row of the matrix is not 0 0 0 1");
  T_WorldDepth pose{{{v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]}}, {v[3], v[7], v[11]}};
  if (!is_rotation(pose.rotation, kUnitTolerance))
    return bad_input(file, 0, "the upper left 3x3 of the matrix is not a rotation");
  return pose.orthonormalized();
}

}  // namespace tactus::hal::replay
