#include "pipeline/track/tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/assert.hpp"
#include "rt/worker_pool.hpp"

namespace tactus::track {
namespace {

constexpr int kChunksMax = 40;              // 320 rows at half resolution, what run accepts; 256 bytes each
constexpr double kConvergedM = 5e-5;        // an increment below 50 um ...
constexpr double kConvergedRadians = 3e-5;  // ... and 60 um at two metres ends a level

IcpSums accumulate(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level,
                   rt::WorkerPool& pool) {
  const int chunks = icp_chunks_count(*input.model, level.stride);
  TACTUS_ASSERT(chunks <= kChunksMax);
  std::array<IcpSums, kChunksMax> parts;
  pool.run(static_cast<std::uint32_t>(chunks), [&](std::uint32_t chunk) {
    parts[chunk] = icp_accumulate(input, T_view_live, level, static_cast<int>(chunk));
  });
  IcpSums sums;
  for (int chunk = 0; chunk < chunks; ++chunk) icp_add(sums, parts[static_cast<std::size_t>(chunk)]);
  return sums;
}

double norm3(const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

double small_angle(const Rotation& rotation) noexcept {
  const Quaternion q = rotation.quaternion();
  const double s = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  return 2 * s * (1 + s * s / 6);  // 2 asin(s)
}

T_ViewLive scaled(const T_ViewLive& motion, double factor) noexcept {
  if (factor == 1) return motion;
  // The sine of half the angle, as if it were the angle; half a turn at most.
  const Quaternion q = motion.rotation.quaternion();
  const Vec3d sine = Vec3d{q.x, q.y, q.z} * factor;
  const double squared = std::min(1.0, sine.dot(sine));
  const Quaternion turned = Quaternion{std::sqrt(1 - squared), sine.x, sine.y, sine.z}.normalized();
  return {Rotation::from(turned), motion.translation * factor};
}

TrackResult track_frame(const IcpInput& input, std::span<const IcpLevel> levels, const T_ViewLive& T_guess,
                        const TrackConfig& config, rt::WorkerPool& pool) noexcept {
  TrackResult result;
  T_ViewLive T = T_guess;
  const double pivot = static_cast<double>(input.pivot_z_m);
  const double lever = 0.5 * pivot;  // half the view's width at the pivot is about half its distance
  IcpSums sums;
  bool first = true;
  IcpInput used = input;
  if (!input.live_luma.empty() && levels.size() > 1) {
    used.live_luma = {};
    const IcpStep probe = icp_solve(accumulate(used, T, levels.front(), pool), lever, config.information_min);
    if (probe.information[5] < config.brightness_first_below) used = input;
  }
  for (const IcpLevel& level : levels) {
    if (&level != &levels.front()) used = input;
    for (int iteration = 0; iteration < level.iterations_max; ++iteration) {
      sums = accumulate(used, T, level, pool);
      ++result.iterations_count;
      const IcpStep step = icp_solve(sums, lever, config.information_min);
      result.held_count = step.held_count;
      result.information = step.information;
      if (step.held_count == 6) return result;
      if (first && step.held_count > 0) {
        // What cannot be observed is held where the last frame left it, not where a motion model would carry
        // it.
        T = T_ViewLive{};
        first = false;
        continue;
      }
      first = false;
      T = icp_apply(T, step.increment, pivot);
      if (norm3(&step.increment[0]) < kConvergedRadians && norm3(&step.increment[3]) < kConvergedM) break;
    }
  }
  result.T_view_live = T;
  const int stride = levels.back().stride;
  const double pixels = static_cast<double>(input.live_m.size()) / (stride * stride);
  result.inlier_share = sums.candidates_count > 0 ? sums.inliers_count / sums.candidates_count : 0;
  result.overlap_share = sums.candidates_count / pixels;
  result.residual_m = sums.weight > 0 ? std::sqrt(sums.weighted_residual2 / sums.weight) : 0;
  const bool plausible =
      T.translation.norm() <= config.shift_m_max && small_angle(T.rotation) <= config.turn_max;
  const bool supported = result.inlier_share >= config.inlier_share_min &&
                         result.overlap_share >= config.overlap_share_min &&
                         result.residual_m <= config.residual_m_max;
  if (plausible && supported && T.is_finite()) result.status = rt::Status::ok;
  return result;
}

}  // namespace tactus::track
