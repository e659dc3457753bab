#include "pipeline/render/text.hpp"

#include <algorithm>

#include "pipeline/render/font.hpp"
#include "rt/assert.hpp"

namespace tactus::render {
namespace {

constexpr int kScaleMax = 8;

GlyphInstance instance(int x, int y, int width, int height, Rgb8 color, std::uint8_t glyph) {
  const auto pixels = [](int value) { return static_cast<std::int16_t>(value); };
  return {{pixels(x), pixels(y), pixels(width), pixels(height)}, {color.r, color.g, color.b, glyph}};
}

}  // namespace

std::size_t build_text(std::span<const TextLine> lines, const std::optional<Crosshair>& crosshair, int width_px,
                       int height_px, std::span<GlyphInstance> instances) noexcept {
  TACTUS_ASSERT(instances.size() >= kGlyphInstancesMax);
  std::size_t count = 0;
  for (const TextLine& line : lines.first(std::min(lines.size(), kTextLinesMax))) {
    const int scale = std::clamp(line.scale, 1, kScaleMax);
    const int width = kGlyphWidth * scale, height = kGlyphHeight * scale;
    if (line.y_px <= -height || line.y_px >= height_px) continue;
    // No int overflows: lines that begin farther left than they are long are not seen.
    if (line.x_px < -width * static_cast<int>(kTextColumnsMax) || line.x_px >= width_px) continue;
    for (std::size_t i = 0; i < std::min(line.text.size(), kTextColumnsMax); ++i) {
      const int x = line.x_px + width * static_cast<int>(i);
      if (x <= -width || x >= width_px) continue;
      const char c = line.text[i];
      const bool has_glyph = c >= kGlyphFirst && c <= kGlyphLast;
      const auto glyph = static_cast<std::uint8_t>((has_glyph ? c : '?') - kGlyphFirst);
      instances[count++] = instance(x, line.y_px, width, height, line.color, glyph);
    }
  }
  if (!crosshair) return count;
  constexpr int kGap = 4, kLength = 8, kThickness = 2, kEdge = 1;
  // Far outside it is cut to where it is not seen, so that no 16-bit corner overflows.
  const int x = std::clamp(crosshair->x_px, -100, width_px + 100) - 1, y = std::clamp(crosshair->y_px, -100, height_px + 100) - 1;
  for (const int edge : {kEdge, 0}) {
    const Rgb8 color = edge > 0 ? Rgb8{0, 0, 0} : crosshair->color;
    const auto bar = [&](int left, int top, int width, int height) {
      instances[count++] =
          instance(left - edge, top - edge, width + 2 * edge, height + 2 * edge, color, kSolidGlyph);
    };
    bar(x - kGap - kLength + 1, y, kLength, kThickness);
    bar(x + kGap + 1, y, kLength, kThickness);
    bar(x, y - kGap - kLength + 1, kThickness, kLength);
    bar(x, y + kGap + 1, kThickness, kLength);
  }
  return count;
}

}  // namespace tactus::render
