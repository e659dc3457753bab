#include "firmware_host/image_crf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace tactus::firmware {
namespace {

/// A probability below half a step of the network's bytes is not known better than that.
constexpr float kProbabilityMin = 0.5f / 255;

/// Mean colour of the pixels that a small pixel covers.
std::array<float, 3> mean_color(std::span<const std::uint8_t> rgb, int width, int u0, int u1, int v0, int v1) {
  std::array<std::uint32_t, 3> sum{};
  for (int v = v0; v < v1; ++v)
    for (int u = u0; u < u1; ++u)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += rgb[(static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)) * 3 + c];
  const auto count = static_cast<float>((u1 - u0) * (v1 - v0));
  return {static_cast<float>(sum[0]) / count, static_cast<float>(sum[1]) / count, static_cast<float>(sum[2]) / count};
}

}  // namespace

rt::Result<void> ImageCrf::refine(const segment::MaterialScores& scores, std::span<const std::uint8_t> rgb, int width,
                                  int height, std::span<MaterialId> labels) {
  const int side = std::max(width, height);
  const int small_width = side > kSideMax ? width * kSideMax / side : width,
            small_height = side > kSideMax ? height * kSideMax / side : height;
  const std::size_t count = static_cast<std::size_t>(small_width) * static_cast<std::size_t>(small_height);
  if (!arena_) {
    // A vertex has dimensions + 2 slots when all its neighbours exist; photographs fill a third of that.
    const label::DenseCrfConfig config{count, {{{2, count, 4 * count}, {5, 3 * count, 15 * count}, {}}}};
    auto arena = rt::Arena::reserve(label::DenseCrf::bytes_needed(config));
    if (!arena) return arena.error();
    arena_.emplace(std::move(*arena));
    rt::Slice memory = arena_->carve(label::DenseCrf::bytes_needed(config));
    engine_.bind(memory, config);
  }
  unary_nat_.resize(count * kMaterialCount);
  small_labels_.resize(count);
  std::vector<float> place(count * 2), appearance(count * 5);
  MaterialDistribution p{};
  std::size_t i = 0;
  for (int y = 0; y < small_height; ++y)
    for (int x = 0; x < small_width; ++x, ++i) {
      const int u0 = x * width / small_width, u1 = std::max(u0 + 1, (x + 1) * width / small_width),
                v0 = y * height / small_height, v1 = std::max(v0 + 1, (y + 1) * height / small_height);
      scores.sample(0.5f * static_cast<float>(u0 + u1 - 1), 0.5f * static_cast<float>(v0 + v1 - 1), p);
      for (std::size_t m = 0; m < kMaterialCount; ++m)
        unary_nat_[i * kMaterialCount + m] = -std::log(std::max(p[m], kProbabilityMin));
      const std::array<float, 3> color = mean_color(rgb, width, u0, u1, v0, v1);
      place[i * 2] = static_cast<float>(x) / parameters_.smoothness_theta_px;
      place[i * 2 + 1] = static_cast<float>(y) / parameters_.smoothness_theta_px;
      appearance[i * 5] = static_cast<float>(x) / parameters_.appearance_theta_px;
      appearance[i * 5 + 1] = static_cast<float>(y) / parameters_.appearance_theta_px;
      for (std::size_t c = 0; c < 3; ++c) appearance[i * 5 + 2 + c] = color[c] / parameters_.appearance_theta_color;
    }
  rt::Status status = engine_.begin(count);
  if (status == rt::Status::ok)
    status = engine_.add_kernel(0, parameters_.smoothness_weight, place, label::CrfNormalisation::symmetric);
  if (status == rt::Status::ok)
    status = engine_.add_kernel(1, parameters_.appearance_weight, appearance, label::CrfNormalisation::symmetric);
  if (status != rt::Status::ok)
    return rt::Error{rt::ExitCode::failed, "The 2D CRF cannot take an image of " + std::to_string(width) + "x" +
                                               std::to_string(height) + " pixels: " + rt::name(status) + "."};
  engine_.set_unary({}, [&](std::size_t point) { return &unary_nat_[point * kMaterialCount]; });
  (void)engine_.solve(parameters_.iterations_max, 0);
  std::array<float, kMaterialCount> marginals{};
  for (i = 0; i < count; ++i) {
    engine_.marginals_of(i, marginals);
    small_labels_[i] =
        static_cast<MaterialId>(std::max_element(marginals.begin(), marginals.end()) - marginals.begin());
  }
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      labels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] =
          small_labels_[static_cast<std::size_t>(v * small_height / height) * static_cast<std::size_t>(small_width) +
                        static_cast<std::size_t>(u * small_width / width)];
  return {};
}

}  // namespace tactus::firmware
