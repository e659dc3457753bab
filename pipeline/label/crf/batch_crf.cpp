#include "pipeline/label/crf/batch_crf.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus::label {
namespace {

DenseCrfConfig engine_config(const BatchCrfConfig& config) {
  return {config.points_max,
          {{{3, config.smoothness.vertices_max, config.smoothness.slots_max},
            {6, config.appearance.vertices_max, config.appearance.slots_max},
            {6, config.surface.vertices_max, config.surface.slots_max}}}};
}

// The low 10 bits of v, two zeros between each.
constexpr std::uint32_t spread_bits(std::uint32_t v) {
  v &= 0x3FF;
  v = (v | v << 16) & 0x30000FF;
  v = (v | v << 8) & 0x300F00F;
  v = (v | v << 4) & 0x30C30C3;
  return (v | v << 2) & 0x9249249;
}
static_assert(spread_bits(0x3FF) == 0x9249249);

}  // namespace

std::size_t BatchCrf::bytes_needed(const BatchCrfConfig& config) {
  return DenseCrf::bytes_needed(engine_config(config)) + rt::bytes_of<std::uint32_t>(config.points_max) +
         rt::bytes_of<std::uint64_t>(config.points_max);
}

void BatchCrf::bind(rt::Slice& memory, const BatchCrfConfig& config) {
  engine_.bind(memory, engine_config(config));
  order_ = memory.take<std::uint32_t>(config.points_max);
  keys_ = memory.take<std::uint64_t>(config.points_max);
}

rt::Status BatchCrf::prepare(const CrfPoints& points, const CrfParameters& p) noexcept {
  if (engine_.begin(0) != rt::Status::ok || !is_valid(points) || !is_valid(p)) return rt::Status::corrupt;
  const std::size_t n = points.size();
  if (const rt::Status begun = engine_.begin(n); begun != rt::Status::ok) return begun;
  // Points along a Morton curve of 1024 steps over the longest side: neighbours on it share lattice vertices
  // while these are in cache.
  Vec3f low{3e38F, 3e38F, 3e38F}, high{-3e38F, -3e38F, -3e38F};
  for (const Vec3f& at : points.position_m) {
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
  }
  const float side = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-6F});
  const float steps = 1023 / side;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3f at = (points.position_m[i] - low) * steps;
    keys_[i] = std::uint64_t{spread_bits(static_cast<std::uint32_t>(at.x)) |
                             spread_bits(static_cast<std::uint32_t>(at.y)) << 1 |
                             spread_bits(static_cast<std::uint32_t>(at.z)) << 2}
                   << 32 |
               i;
  }
  std::sort(keys_.begin(), keys_.begin() + static_cast<std::ptrdiff_t>(n));
  for (std::size_t i = 0; i < n; ++i) order_[i] = static_cast<std::uint32_t>(keys_[i]);

  const auto add = [&](std::size_t m, float weight, float theta_position_m, std::size_t dimensions,
                       float theta, const auto& second) {
    const std::span<float> features = engine_.feature_scratch().first(n * dimensions);
    const float inverse_position = 1 / theta_position_m, inverse = 1 / theta;
    for (std::size_t i = 0; i < n; ++i) {
      float* const f = &features[i * dimensions];
      const Vec3f at = points.position_m[order_[i]] * inverse_position;
      f[0] = at.x;
      f[1] = at.y;
      f[2] = at.z;
      if (dimensions == 3) continue;
      const Vec3f other = second(order_[i]) * inverse;
      f[3] = other.x;
      f[4] = other.y;
      f[5] = other.z;
    }
    return engine_.add_kernel(m, weight, features, p.normalisation);
  };
  const auto color = [&](std::size_t i) {
    const Rgb8 c = points.color[i];
    return Vec3f{static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)};
  };
  const auto normal = [&](std::size_t i) { return points.normal[i]; };
  rt::Status status = add(0, p.smoothness.weight, p.smoothness.theta_position_m, 3, 1, normal);
  if (status == rt::Status::ok)
    status = add(1, p.appearance.weight, p.appearance.theta_position_m, 6, p.appearance.theta_color, color);
  if (status == rt::Status::ok)
    status = add(2, p.surface.weight, p.surface.theta_position_m, 6, p.surface.theta_normal, normal);
  if (status != rt::Status::ok) {
    static_cast<void>(engine_.begin(0));
    return status;
  }
  engine_.set_unary(p.compatibility, [&](std::size_t i) {
    return &points.unary_nat[std::size_t{order_[i]} * kMaterialCount];
  });
  iterations_max_ = p.iterations_max;
  settled_change_ = p.settled_change;
  return rt::Status::ok;
}

CrfReport BatchCrf::solve(std::span<float> marginals) noexcept {
  const std::size_t n = engine_.points_count();
  TACTUS_ASSERT(marginals.size() == n * kMaterialCount);
  const CrfReport report = engine_.solve(iterations_max_, settled_change_);
  for (std::size_t i = 0; i < n; ++i)
    engine_.marginals_of(i,
                         std::span<float, kMaterialCount>(&marginals[std::size_t{order_[i]} * kMaterialCount],
                                                          std::size_t{kMaterialCount}));
  return report;
}

}  // namespace tactus::label
