#include "firmware_host/exact_fusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/label/pane_evidence.hpp"
#include "pipeline/map/fuse_labels.hpp"
#include "pipeline/register/depth_images.hpp"
#include "pipeline/register/panes.hpp"
#include "rt/assert.hpp"

namespace tactus::firmware {
namespace {

// As map::fuse_labels() has them.
constexpr double kAgreeVoxels = 1.5, kAgreeSigmas = 2, kFacingMin = 0.2, kNearM = 0.1;
constexpr double kProbabilityMin = 0.5 / 255;  // a byte of 0 is anything below that

}  // namespace

void ExactFusion::add(const T_WorldDepth& T_world_depth, std::span<const float> half_depth_m,
                      std::span<const std::uint64_t> pane_bits, const segment::MaterialScores& scores) {
  Keyframe& keyframe = keyframes_.emplace_back();
  keyframe.T_world_depth = T_world_depth;
  keyframe.half_depth_m.assign(half_depth_m.begin(), half_depth_m.end());
  keyframe.pane_bits.assign(pane_bits.begin(), pane_bits.end());
  keyframe.probability.assign(scores.probability.begin(), scores.probability.end());
  keyframe.scores = scores;
}

FusedTwice ExactFusion::fuse(std::span<const map::SurfaceCell> cells, const hal::RigCalibration& rig,
                             const hal::Intrinsics& half_camera, float voxel_size_m) const {
  FusedTwice fused;
  fused.words.assign(cells.size(), 0);
  std::vector<double> cost(cells.size() * kMaterialCount);
  MaterialDistribution p{};
  std::array<std::uint8_t, kMaterialCount> bytes;
  for (const Keyframe& keyframe : keyframes_) {
    segment::MaterialScores scores = keyframe.scores;
    scores.probability = {const_cast<std::uint8_t*>(keyframe.probability.data()),
                          keyframe.probability.size()};
    const map::ScoreView view{keyframe.probability.data(), scores.width,          scores.height,
                              scores.columns.scale,        scores.columns.offset, scores.rows.scale,
                              scores.rows.offset};
    const Transform<Depth, World> T_depth_world = keyframe.T_world_depth.inverse();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Vec3d at = T_depth_world * cells[i].position_world_m.cast<double>();
      if (!(at.z > kNearM)) continue;
      const Vec3d ray = at * (1 / at.z);
      const double toward = -(T_depth_world.rotation * cells[i].normal_world.cast<double>()).dot(ray);
      if (!(toward >= kFacingMin * ray.norm())) continue;
      const double hu = ray.x * half_camera.fx + half_camera.cx + 0.5,
                   hv = ray.y * half_camera.fy + half_camera.cy + 0.5;
      if (!(hu >= 0 && hv >= 0 && hu < half_camera.width && hv < half_camera.height)) continue;
      const std::size_t pixel = static_cast<std::size_t>(hv) * static_cast<std::size_t>(half_camera.width) +
                                static_cast<std::size_t>(hu);
      const auto measured_m = static_cast<double>(keyframe.half_depth_m[pixel]);
      if (!(measured_m > 0)) continue;
      const double sigma_m = static_cast<double>(depth_sigma_m(static_cast<float>(measured_m)));
      const double tolerance_m =
          std::max(kAgreeVoxels * static_cast<double>(voxel_size_m), kAgreeSigmas * sigma_m * toward);
      if (!(std::abs(measured_m - at.z) * toward <= tolerance_m)) continue;
      const auto u = static_cast<float>(ray.x * rig.depth.fx + rig.depth.cx),
                 v = static_cast<float>(ray.y * rig.depth.fy + rig.depth.cy);
      if (!map::sample_scores(view, u, v, bytes)) continue;
      const bool as_pane = is_pane(keyframe.pane_bits, pixel);
      label::ObservationCosts costs = label::costs_of(bytes);
      if (as_pane) label::add_pane_evidence(costs);
      fused.words[i] = label::fuse(fused.words[i], costs);
      scores.sample(u, v, p);
      std::array<double, kMaterialCount> likelihood;
      for (std::size_t m = 0; m < kMaterialCount; ++m)
        likelihood[m] = std::max(static_cast<double>(p[m]), kProbabilityMin);
      if (as_pane) {
        for (const MaterialId pane : label::kPaneMaterials)
          likelihood[pane] = std::max(likelihood[pane], label::kSeenAsSomethingElse);
        for (std::size_t m = 0; m < kMaterialCount; ++m) likelihood[m] *= label::kNothingMeasured[m];
      }
      for (std::size_t m = 0; m < kMaterialCount; ++m) cost[i * kMaterialCount + m] -= std::log(likelihood[m]);
    }
  }
  fused.unary_nat.resize(cost.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto begin = cost.begin() + static_cast<std::ptrdiff_t>(i * kMaterialCount);
    const double best = *std::min_element(begin, begin + kMaterialCount);
    for (std::size_t m = 0; m < kMaterialCount; ++m)
      fused.unary_nat[i * kMaterialCount + m] = static_cast<float>(cost[i * kMaterialCount + m] - best);
  }
  return fused;
}

FusionLoss loss_of(std::span<const label::LabelWord> words, const FusedTwice& exact) {
  TACTUS_ASSERT(words.size() == exact.words.size());
  FusionLoss loss;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (exact.words[i] == 0) continue;
    ++loss.cells_count;
    const auto cost = std::span(exact.unary_nat).subspan(i * kMaterialCount, kMaterialCount);
    double sum = 0;  // the best one's cost is 0
    for (const float c : cost) sum += std::exp(-static_cast<double>(c));
    const auto winner = std::min_element(cost.begin(), cost.end()) - cost.begin();
    loss.winner_equal_count += label::best(words[i]) == winner ? 1u : 0u;
    loss.probability_near_count +=
        std::abs(static_cast<double>(label::confidence(words[i])) - 1 / sum) <= kProbabilityNear ? 1u : 0u;
  }
  return loss;
}

}  // namespace tactus::firmware
