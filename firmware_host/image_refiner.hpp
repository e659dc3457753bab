// The study's baseline in the style of CRF-RNN: a network's answer about one image, refined by the dense 2D
// CRF.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/label/crf/image_crf.hpp"
#include "pipeline/segment/material_scores.hpp"
#include "rt/arena.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Refines images of one size. Fixed memory from the first image on. One thread.
class ImageRefiner {
 public:
  /// Most probable material of each pixel of a width x height image, given its colours and the network's
  /// probabilities. The field itself is solved on at most kSideMax pixels across, as the paper's network
  /// input; each pixel takes its nearest answer. failed when the image has more detail than the memory holds.
  rt::Result<void> refine(const segment::MaterialScores& scores, std::span<const std::uint8_t> rgb, int width,
                          int height, std::span<MaterialId> labels);

  static constexpr int kSideMax = 480;

 private:
  std::optional<rt::Arena> arena_;
  label::ImageCrf crf_;
  std::vector<float> unary_nat_, marginals_;
  std::vector<std::uint8_t> small_rgb_;
  std::vector<MaterialId> small_labels_;
};

}  // namespace tactus::firmware
