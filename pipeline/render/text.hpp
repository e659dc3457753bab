// Lines of text and a crosshair over the picture, and the array that the GPU draws them from. No GL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "pipeline/label/material.hpp"

namespace tactus::render {

/// A line on a darkened ground; what does not fit the picture is cut off.
struct TextLine {
  std::string_view text;   // ASCII; the first kTextColumnsMax characters
  int x_px = 0, y_px = 0;  // of the first cell's left upper corner; row 0 is the top
  Rgb8 color{255, 255, 255};
  int scale = 1;  // 1 to 8 pixels for each of a cell's 6 x 10
};
inline constexpr std::size_t kTextLinesMax = 40, kTextColumnsMax = 80;

/// Where something is aimed at.
struct Crosshair {
  int x_px = 0, y_px = 0;  // of its middle, which itself stays free; row 0 is the top
  Rgb8 color{255, 255, 255};
};

/// One cell, or one bar of the crosshair.
struct GlyphInstance {
  std::array<std::int16_t, 4> rectangle_px{};  // x, y, width, height; row 0 is the top
  std::array<std::uint8_t, 4> color_glyph{};   // r g b, number of the glyph; kSolidGlyph: all ink
};
static_assert(sizeof(GlyphInstance) == 12);
inline constexpr std::uint8_t kSolidGlyph = 255;

inline constexpr std::size_t kCrosshairBars = 8;
inline constexpr std::size_t kGlyphInstancesMax = kTextLinesMax * kTextColumnsMax + kCrosshairBars;

/// Cells of the first kTextLinesMax lines that the picture shows, then the crosshair: four bars with a dark edge.
/// `instances` holds kGlyphInstancesMax. Answers how many. Pure; any phase.
std::size_t build_text(std::span<const TextLine> lines, const std::optional<Crosshair>& crosshair, int width_px,
                       int height_px, std::span<GlyphInstance> instances) noexcept;

}  // namespace tactus::render
