// The band around the truth's boundaries ("trimap", Kohli et al. 2009): how much of an error lies where two
// materials meet, and what is left away from there.
#pragma once

#include <cstdint>
#include <span>

#include "pipeline/evaluate/labels.hpp"

namespace tactus::evaluate {

inline constexpr int kTrimapRadius_px = 4;

/// A byte per pixel: 1 where a pixel with another id lies within radius_px of it (Euclidean, between pixel
/// centres), else 0. Unknown (255) counts as an id: the edge of what was labelled is an edge as well. Time:
/// pixels + boundary pixels * radius_px^2.
void mark_boundary_band(std::span<const MaterialId> truth, int width, int height, int radius_px,
                        std::span<std::uint8_t> band);

/// Pixels of an image, counted apart.
struct TrimapConfusion {
  ConfusionMatrix all, band, inside;  // inside: away from the band; band + inside = all
  void add(const TrimapConfusion& other);
};

/// `band`: mark_boundary_band() of `truth`. All three spans have one size.
void count_pixels(std::span<const MaterialId> truth, std::span<const MaterialId> predicted,
                  std::span<const std::uint8_t> band, TrimapConfusion& counts);

}  // namespace tactus::evaluate
