// The dense 2D CRF over one image (Kraehenbuehl & Koltun 2011, eq. (3)): the study's baseline in the style of
// CRF-RNN.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/label/crf/dense_crf.hpp"
#include "pipeline/segment/material_scores.hpp"
#include "rt/arena.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Weights and bandwidths of the two kernels, pixels of the field's image and colour in 0 to 255.
struct ImageCrfParameters {
  float smoothness_weight = 3, smoothness_theta_px = 3;
  float appearance_weight = 10, appearance_theta_px = 60, appearance_theta_color = 13;
  int iterations_max = 10;
};

/// Refines what a network said about an image. Fixed memory from the first image on. One thread.
class ImageCrf {
 public:
  explicit ImageCrf(const ImageCrfParameters& parameters = {}) : parameters_(parameters) {}

  /// Most probable material of each pixel of a width x height image, given its colours and the network's
  /// probabilities. The field itself is solved on at most kSideMax pixels across, as the paper's network input; each
  /// pixel takes its nearest answer. failed when the image has more detail than the memory holds.
  rt::Result<void> refine(const segment::MaterialScores& scores, std::span<const std::uint8_t> rgb, int width,
                          int height, std::span<MaterialId> labels);

  static constexpr int kSideMax = 480;

 private:
  ImageCrfParameters parameters_;
  std::optional<rt::Arena> arena_;
  label::DenseCrf engine_;
  std::vector<float> unary_nat_;
  std::vector<MaterialId> small_labels_;
};

}  // namespace tactus::firmware
