// The fully connected field over the pixels of one image (Kraehenbuehl & Koltun 2011; what CRF-RNN unrolls,
// Zheng et al. 2015): the 2D baseline that the paper's table calls CRF-RNN. The same lattices and the same
// mean field as in 3D, with two kernels:
//
//   smoothness   w1 exp(-|p_i-p_j|^2 / 2 theta_p^2)                                 d = 2, p in pixels
//   appearance   w2 exp(-|p_i-p_j|^2 / 2 theta_pI^2 - |I_i-I_j|^2 / 2 theta_I^2)    d = 5
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/label/crf/dense_crf.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::label {

struct ImageCrfParameters {
  struct Smoothness {
    float weight, theta_position_px;
  } smoothness;
  struct Appearance {
    float weight, theta_position_px, theta_color;  ///< colour in 0 to 255 per channel
  } appearance;
  int iterations_max = 10;
  float settled_change = 0;  ///< as in CrfParameters
  CrfNormalisation normalisation = CrfNormalisation::symmetric;
  CrfCompatibility compatibility;
};

/// What CRF-RNN starts from (its published program: 3 px; 160 px and 3 grey levels; weights 3 and 5 at 500 x
/// 500 pixels, 5 iterations in training and 10 in testing), the position bandwidths scaled to `width` pixels.
constexpr ImageCrfParameters crf_rnn_parameters(int width) {
  const float scale = static_cast<float>(width) / 500;
  return {.smoothness = {3.0F, 3.0F * scale},
          .appearance = {5.0F, 160.0F * scale, 3.0F},
          .iterations_max = 10,
          .settled_change = 0,
          .normalisation = CrfNormalisation::symmetric,
          .compatibility = {}};
}

/// Weights finite and >= 0, bandwidths > 0, 0 to 1000 iterations, compatibility symmetric. Phase: any. Pure.
[[nodiscard]] bool is_valid(const ImageCrfParameters& parameters) noexcept;

struct ImageCrfConfig {
  int width = 0, height = 0;  ///< the largest image
  std::size_t smoothness_vertices_max = 0, appearance_vertices_max = 0;

  /// Room for photographs, with position bandwidths of 2 px and colour bandwidths of 3 or more.
  static constexpr ImageCrfConfig for_image(int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    return {width, height, pixels, 2 * pixels};
  }
};

/// Fixed memory, no heap. Not thread-safe.
class ImageCrf {
 public:
  static std::size_t bytes_needed(const ImageCrfConfig& config);
  /// Phase: boot.
  void bind(rt::Slice& memory, const ImageCrfConfig& config);

  /// probability: bytes [y][x][23], 255 * p, as the segment stage leaves them; a byte of 0 stands for half a
  /// step. rgb: [y][x][3]. marginals: [y][x][23]. full: more pixels or vertices than bound; corrupt: invalid
  /// parameters. marginals are untouched then. Phase: any.
  rt::Status refine(std::span<const std::uint8_t> probability, std::span<const std::uint8_t> rgb, int width,
                    int height, const ImageCrfParameters& parameters, std::span<float> marginals,
                    CrfReport& report) noexcept;
  /// The same from unary costs in nats, [y][x][23], finite.
  rt::Status refine_costs(std::span<const float> unary_nat, std::span<const std::uint8_t> rgb, int width,
                          int height, const ImageCrfParameters& parameters, std::span<float> marginals,
                          CrfReport& report) noexcept;

 private:
  rt::Status prepare(std::span<const std::uint8_t> rgb, int width, int height,
                     const ImageCrfParameters& parameters) noexcept;
  void finish(const ImageCrfParameters& parameters, std::span<float> marginals, CrfReport& report) noexcept;

  DenseCrf engine_;
};

}  // namespace tactus::label
