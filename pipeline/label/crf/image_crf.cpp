#include "pipeline/label/crf/image_crf.hpp"

#include <algorithm>
#include <array>

#include "pipeline/label/cost_tables.hpp"
#include "rt/assert.hpp"

namespace tactus::label {
namespace {

DenseCrfConfig engine_config(const ImageCrfConfig& config) {
  return {static_cast<std::size_t>(config.width) * static_cast<std::size_t>(config.height),
          {{{2, config.smoothness_vertices_max, 4 * config.smoothness_vertices_max},
            {5, config.appearance_vertices_max, 7 * config.appearance_vertices_max},
            {}}}};
}

}  // namespace

bool is_valid(const ImageCrfParameters& p) noexcept {
  CrfParameters same = default_crf_parameters();
  same.smoothness = {p.smoothness.weight, p.smoothness.theta_position_px};
  same.appearance = {p.appearance.weight, p.appearance.theta_position_px, p.appearance.theta_color};
  same.iterations_max = p.iterations_max;
  same.settled_change = p.settled_change;
  same.compatibility = p.compatibility;
  return is_valid(same);
}

std::size_t ImageCrf::bytes_needed(const ImageCrfConfig& config) {
  return DenseCrf::bytes_needed(engine_config(config));
}

void ImageCrf::bind(rt::Slice& memory, const ImageCrfConfig& config) {
  engine_.bind(memory, engine_config(config));
}

rt::Status ImageCrf::prepare(std::span<const std::uint8_t> rgb, int width, int height,
                             const ImageCrfParameters& p) noexcept {
  TACTUS_ASSERT(width >= 0 && height >= 0);
  const auto w = static_cast<std::size_t>(width), n = w * static_cast<std::size_t>(height);
  TACTUS_ASSERT(rgb.size() == 3 * n);
  if (!is_valid(p)) return rt::Status::corrupt;
  rt::Status status = engine_.begin(n);
  if (status != rt::Status::ok) return status;
  const auto fill = [&](std::size_t dimensions, float theta_position_px, float theta_color) {
    const std::span<float> features = engine_.feature_scratch().first(n * dimensions);
    const float inverse_position = 1 / theta_position_px, inverse_color = 1 / theta_color;
    for (std::size_t i = 0; i < n; ++i) {
      float* const f = &features[i * dimensions];
      f[0] = static_cast<float>(i % w) * inverse_position;
      f[1] = static_cast<float>(i / w) * inverse_position;
      for (std::size_t c = 2; c < dimensions; ++c)
        f[c] = static_cast<float>(rgb[i * 3 + c - 2]) * inverse_color;
    }
    return std::span<const float>(features);
  };
  status =
      engine_.add_kernel(0, p.smoothness.weight, fill(2, p.smoothness.theta_position_px, 1), p.normalisation);
  if (status == rt::Status::ok)
    status = engine_.add_kernel(1, p.appearance.weight,
                                fill(5, p.appearance.theta_position_px, p.appearance.theta_color),
                                p.normalisation);
  return status;
}

void ImageCrf::finish(const ImageCrfParameters& p, std::span<float> marginals, CrfReport& report) noexcept {
  report = engine_.solve(p.iterations_max, p.settled_change);
  for (std::size_t i = 0; i < engine_.points_count(); ++i)
    engine_.marginals_of(i, std::span<float, kMaterialCount>(&marginals[i * kMaterialCount], kMaterialCount));
}

rt::Status ImageCrf::refine(std::span<const std::uint8_t> probability, std::span<const std::uint8_t> rgb,
                            int width, int height, const ImageCrfParameters& parameters,
                            std::span<float> marginals, CrfReport& report) noexcept {
  TACTUS_ASSERT(probability.size() == marginals.size() &&
                3 * marginals.size() == rgb.size() * kMaterialCount);
  if (const rt::Status prepared = prepare(rgb, width, height, parameters); prepared != rt::Status::ok)
    return prepared;
  std::array<float, kMaterialCount> cost;
  engine_.set_unary(parameters.compatibility, [&](std::size_t i) {
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      cost[l] = static_cast<float>(kCostOfByte[probability[i * kMaterialCount + l]]) * (1.0F / kCostsPerNat);
    return cost.data();
  });
  finish(parameters, marginals, report);
  return rt::Status::ok;
}

rt::Status ImageCrf::refine_costs(std::span<const float> unary_nat, std::span<const std::uint8_t> rgb,
                                  int width, int height, const ImageCrfParameters& parameters,
                                  std::span<float> marginals, CrfReport& report) noexcept {
  TACTUS_ASSERT(unary_nat.size() == marginals.size() && 3 * marginals.size() == rgb.size() * kMaterialCount);
  if (const rt::Status prepared = prepare(rgb, width, height, parameters); prepared != rt::Status::ok)
    return prepared;
  engine_.set_unary(parameters.compatibility, [&](std::size_t i) { return &unary_nat[i * kMaterialCount]; });
  finish(parameters, marginals, report);
  return rt::Status::ok;
}

}  // namespace tactus::label
