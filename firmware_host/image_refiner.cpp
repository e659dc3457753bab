#include "firmware_host/image_refiner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace tactus::firmware {
namespace {

/// A probability below half a step of the network's bytes is not known better than that.
constexpr float kProbabilityMin = 0.5f / 255;

/// Mean colour of the pixels that a small pixel covers.
std::array<std::uint8_t, 3> mean_color(std::span<const std::uint8_t> rgb, int width, int u0, int u1, int v0,
                                       int v1) {
  std::array<std::uint32_t, 3> sum{};
  for (int v = v0; v < v1; ++v)
    for (int u = u0; u < u1; ++u)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += rgb[(static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(u)) *
                          3 +
                      c];
  const auto count = static_cast<std::uint32_t>((u1 - u0) * (v1 - v0));
  std::array<std::uint8_t, 3> mean{};
  for (std::size_t c = 0; c < 3; ++c) mean[c] = static_cast<std::uint8_t>((sum[c] + count / 2) / count);
  return mean;
}

}  // namespace

rt::Result<void> ImageRefiner::refine(const segment::MaterialScores& scores,
                                      std::span<const std::uint8_t> rgb, int width, int height,
                                      std::span<MaterialId> labels) {
  const int side = std::max(width, height);
  const int small_width = side > kSideMax ? width * kSideMax / side : width,
            small_height = side > kSideMax ? height * kSideMax / side : height;
  const std::size_t count = static_cast<std::size_t>(small_width) * static_cast<std::size_t>(small_height);
  if (!arena_) {
    auto config = label::ImageCrfConfig::for_image(small_width, small_height);
    config.appearance_vertices_max =
        6 * count;  // anything: a network's test images are noisier than photographs
    auto arena = rt::Arena::reserve(label::ImageCrf::bytes_needed(config));
    if (!arena) return arena.error();
    arena_.emplace(std::move(*arena));
    rt::Slice memory = arena_->carve(label::ImageCrf::bytes_needed(config));
    crf_.bind(memory, config);
  }
  unary_nat_.resize(count * kMaterialCount);
  marginals_.resize(count * kMaterialCount);
  small_rgb_.resize(count * 3);
  small_labels_.resize(count);
  MaterialDistribution p{};
  std::size_t i = 0;
  for (int y = 0; y < small_height; ++y)
    for (int x = 0; x < small_width; ++x, ++i) {
      const int u0 = x * width / small_width, u1 = std::max(u0 + 1, (x + 1) * width / small_width),
                v0 = y * height / small_height, v1 = std::max(v0 + 1, (y + 1) * height / small_height);
      scores.sample(0.5f * static_cast<float>(u0 + u1 - 1), 0.5f * static_cast<float>(v0 + v1 - 1), p);
      for (std::size_t m = 0; m < kMaterialCount; ++m)
        unary_nat_[i * kMaterialCount + m] = -std::log(std::max(p[m], kProbabilityMin));
      const std::array<std::uint8_t, 3> color = mean_color(rgb, width, u0, u1, v0, v1);
      std::copy(color.begin(), color.end(), small_rgb_.begin() + static_cast<std::ptrdiff_t>(i * 3));
    }
  label::CrfReport report;
  if (const rt::Status status = crf_.refine_costs(unary_nat_, small_rgb_, small_width, small_height,
                                                  label::crf_rnn_parameters(small_width), marginals_, report);
      status != rt::Status::ok)
    return rt::Error{rt::ExitCode::failed, "The 2D CRF cannot take an image of " + std::to_string(width) +
                                               "x" + std::to_string(height) + " pixels: " + rt::name(status) +
                                               "."};
  label::most_probable(marginals_, small_labels_);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      labels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] =
          small_labels_[static_cast<std::size_t>(v * small_height / height) *
                            static_cast<std::size_t>(small_width) +
                        static_cast<std::size_t>(u * small_width / width)];
  return {};
}

}  // namespace tactus::firmware
