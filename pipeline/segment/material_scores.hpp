// What the network says about the materials in one colour image, at the resolution at which it says it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/label/material.hpp"
#include "pipeline/segment/network_plan.hpp"
#include "rt/slice.hpp"

namespace tactus::segment {

/// height x width x 23 probabilities as bytes, layout [y][x][material], value = round(255 * p); a pixel's
/// bytes sum to about 255. A view: the memory belongs to whoever made it, so that a triple buffer can hold
/// three.
struct MaterialScores {
  int width = 0, height = 0;
  std::span<std::uint8_t> probability;
  /// From colour image pixels (integers at pixel centres) to score pixels; set by Segmenter::step.
  AxisMap columns, rows;

  static std::size_t bytes_needed(int width, int height) {
    return rt::bytes_of<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                      kMaterialCount);
  }
  static MaterialScores take(rt::Slice& memory, int width, int height) {
    return {width,
            height,
            memory.take<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                      kMaterialCount),
            {},
            {}};
  }

  /// The 23 bytes of one score pixel.
  [[nodiscard]] std::span<const std::uint8_t, kMaterialCount> pixel(int x, int y) const noexcept {
    const std::size_t first =
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
        kMaterialCount;
    return std::span<const std::uint8_t, kMaterialCount>(probability.data() + first, kMaterialCount);
  }

  /// The distribution at a place in the colour image: bilinear between score pixels, held at the border, sums
  /// to 1. Phase: any; thread-safe while nobody writes; + - * / only.
  void sample(float u, float v, MaterialDistribution& out) const noexcept;
};

}  // namespace tactus::segment
