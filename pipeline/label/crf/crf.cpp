#include "pipeline/label/crf/crf.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus::label {
namespace {

constexpr float kLargest = 3e38F;
bool is_finite(float v) { return v >= -kLargest && v <= kLargest; }
bool is_finite(const Vec3f& v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }
bool is_weight(float v) { return v >= 0 && v <= kLargest; }
bool is_bandwidth(float v) { return v > 0 && v <= kLargest; }

}  // namespace

void unary_costs_of(LabelWord word, std::span<float, kMaterialCount> unary_nat) noexcept {
  const ObservationCosts costs = costs_in(word);
  for (std::size_t l = 0; l < kMaterialCount; ++l)
    unary_nat[l] = static_cast<float>(costs.cost[l]) * (1.0F / kCostsPerNat);
}

bool is_valid(const CrfParameters& p) noexcept {
  if (!is_weight(p.smoothness.weight) || !is_weight(p.appearance.weight) || !is_weight(p.surface.weight))
    return false;
  if (!is_bandwidth(p.smoothness.theta_position_m) || !is_bandwidth(p.appearance.theta_position_m) ||
      !is_bandwidth(p.appearance.theta_color) || !is_bandwidth(p.surface.theta_position_m) ||
      !is_bandwidth(p.surface.theta_normal))
    return false;
  if (p.iterations_max < 0 || p.iterations_max > 1000 || !is_finite(p.settled_change)) return false;
  for (std::size_t a = 0; a < kMaterialCount; ++a)
    for (std::size_t b = 0; b < kMaterialCount; ++b) {
      const float cost = p.compatibility.of(a, b);
      if (!is_finite(cost) || cost != p.compatibility.of(b, a) || (a == b && cost != 0)) return false;
    }
  return true;
}

bool is_valid(const CrfPoints& points) noexcept {
  const std::size_t n = points.size();
  return points.color.size() == n && points.normal.size() == n &&
         points.unary_nat.size() == n * kMaterialCount &&
         std::all_of(points.position_m.begin(), points.position_m.end(),
                     [](const Vec3f& v) { return is_finite(v); }) &&
         std::all_of(points.normal.begin(), points.normal.end(),
                     [](const Vec3f& v) { return is_finite(v); }) &&
         std::all_of(points.unary_nat.begin(), points.unary_nat.end(), [](float v) { return is_finite(v); });
}

void most_probable(std::span<const float> marginals, std::span<MaterialId> labels) noexcept {
  TACTUS_ASSERT(marginals.size() == labels.size() * kMaterialCount);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto q = marginals.subspan(i * kMaterialCount, kMaterialCount);
    labels[i] = static_cast<MaterialId>(std::max_element(q.begin(), q.end()) - q.begin());
  }
}

}  // namespace tactus::label
