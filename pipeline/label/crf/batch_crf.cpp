#include "pipeline/label/crf/batch_crf.hpp"

#include <algorithm>

#include "pipeline/label/crf/morton.hpp"
#include "rt/assert.hpp"

namespace tactus::label {

DenseCrfConfig surface_engine_config(const BatchCrfConfig& config) noexcept {
  return {config.points_max,
          {{{3, config.smoothness.vertices_max, config.smoothness.slots_max},
            {6, config.appearance.vertices_max, config.appearance.slots_max},
            {6, config.surface.vertices_max, config.surface.slots_max}}}};
}

rt::Status add_surface_kernel(DenseCrf& engine, std::size_t kernel, const CrfPoints& points,
                              std::span<const std::uint32_t> order, const CrfParameters& p) noexcept {
  begin_surface_kernel(engine, kernel, points, order, p);
  CrfPiece piece;
  while (!piece.is_last) piece = engine.continue_kernel();
  return piece.status;
}

void begin_surface_kernel(DenseCrf& engine, std::size_t kernel, const CrfPoints& points,
                          std::span<const std::uint32_t> order, const CrfParameters& p) noexcept {
  const std::size_t n = points.size(), dimensions = kernel == kSmoothness ? 3 : 6;
  const std::span<float> features = engine.feature_scratch().first(n * dimensions);
  const float theta_position_m = kernel == kSmoothness   ? p.smoothness.theta_position_m
                                 : kernel == kAppearance ? p.appearance.theta_position_m
                                                         : p.surface.theta_position_m;
  const float inverse_position = 1 / theta_position_m;
  const float inverse = kernel == kAppearance ? 1 / p.appearance.theta_color : 1 / p.surface.theta_normal;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t from = order.empty() ? i : order[i];
    float* const f = &features[i * dimensions];
    const Vec3f at = points.position_m[from] * inverse_position;
    f[0] = at.x;
    f[1] = at.y;
    f[2] = at.z;
    if (dimensions == 3) continue;
    const Rgb8 c = points.color[from];
    const Vec3f other = (kernel == kAppearance ? Vec3f{static_cast<float>(c.r), static_cast<float>(c.g),
                                                       static_cast<float>(c.b)}
                                               : points.normal[from]) *
                        inverse;
    f[3] = other.x;
    f[4] = other.y;
    f[5] = other.z;
  }
  const float weight = kernel == kSmoothness   ? p.smoothness.weight
                       : kernel == kAppearance ? p.appearance.weight
                                               : p.surface.weight;
  engine.begin_kernel(kernel, weight, features, p.normalisation);
}

std::size_t BatchCrf::bytes_needed(const BatchCrfConfig& config) {
  return DenseCrf::bytes_needed(surface_engine_config(config)) +
         rt::bytes_of<std::uint32_t>(config.points_max) + rt::bytes_of<std::uint64_t>(config.points_max);
}

void BatchCrf::bind(rt::Slice& memory, const BatchCrfConfig& config) {
  engine_.bind(memory, surface_engine_config(config));
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
    keys_[i] = std::uint64_t{morton_place(static_cast<std::uint32_t>(at.x), static_cast<std::uint32_t>(at.y),
                                          static_cast<std::uint32_t>(at.z))}
                   << 32 |
               i;
  }
  std::sort(keys_.begin(), keys_.begin() + static_cast<std::ptrdiff_t>(n));
  for (std::size_t i = 0; i < n; ++i) order_[i] = static_cast<std::uint32_t>(keys_[i]);

  rt::Status status = rt::Status::ok;
  for (std::size_t kernel = 0; kernel < kCrfKernelsMax && status == rt::Status::ok; ++kernel)
    status = add_surface_kernel(engine_, kernel, points, {order_.data(), n}, p);
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
