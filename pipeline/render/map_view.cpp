#include "pipeline/render/map_view.hpp"

#include <algorithm>
#include <cmath>

#include "rt/assert.hpp"

namespace tactus::render {
namespace {

constexpr float kShadeLow = 64, kShadeHigh = 255;

/// 0 -> 64, 1 -> 255.
Shade shade_of(float part) {
  return static_cast<Shade>(kShadeLow + (kShadeHigh - kShadeLow) * std::clamp(part, 0.0F, 1.0F) + 0.5F);
}

void put(std::span<std::uint8_t> rgb, std::size_t i, Rgb8 color) {
  rgb[3 * i] = color.r;
  rgb[3 * i + 1] = color.g;
  rgb[3 * i + 2] = color.b;
}

Rgb8 shaded(Rgb8 color, Shade shade) {
  const auto scale = [shade](std::uint8_t channel) {
    return static_cast<std::uint8_t>((channel * shade + 127) / 255);
  };
  return {scale(color.r), scale(color.g), scale(color.b)};
}

template <typename ColorOf>
void paint(std::span<const Shade> shades, std::span<std::uint8_t> rgb, ColorOf&& color_of) {
  TACTUS_ASSERT(rgb.size() == shades.size() * 3);
  for (std::size_t i = 0; i < shades.size(); ++i)
    put(rgb, i, shades[i] == 0 ? kNoSurfaceColor : shaded(color_of(i), shades[i]));
}

bool is_depth(float z_m) { return std::isfinite(z_m) && z_m > 0; }

}  // namespace

void shade_normals(std::span<const Vec3f> normals, const Vec3f& toward_eye,
                   std::span<Shade> shades) noexcept {
  TACTUS_ASSERT(shades.size() == normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3f& n = normals[i];
    const float facing = n.dot(toward_eye);
    shades[i] = n == Vec3f{} || !std::isfinite(facing) ? Shade{0} : shade_of(facing);
  }
}

void shade_depth(std::span<const float> depth_m, float near_m, float far_m,
                 std::span<Shade> shades) noexcept {
  TACTUS_ASSERT(shades.size() == depth_m.size() && near_m < far_m);
  for (std::size_t i = 0; i < depth_m.size(); ++i)
    shades[i] = is_depth(depth_m[i]) ? shade_of((far_m - depth_m[i]) / (far_m - near_m)) : Shade{0};
}

void normals_of_depth(std::span<const float> depth_m, const hal::Intrinsics& camera,
                      std::span<Vec3f> normals_depth) noexcept {
  const auto width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  TACTUS_ASSERT(depth_m.size() == width * height && normals_depth.size() == depth_m.size());
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  std::fill(normals_depth.begin(), normals_depth.end(), Vec3f{});
  for (std::size_t v = 1; v + 1 < height; ++v)
    for (std::size_t u = 1; u + 1 < width; ++u) {
      const std::size_t i = v * width + u;
      const float z = depth_m[i];
      const auto belongs = [z](float neighbour_m) {
        return is_depth(neighbour_m) && std::fabs(neighbour_m - z) <= 0.05F + 0.02F * z;
      };
      const float left = depth_m[i - 1], right = depth_m[i + 1], above = depth_m[i - width],
                  below = depth_m[i + width];
      if (!is_depth(z) || !belongs(left) || !belongs(right) || !belongs(above) || !belongs(below)) continue;
      const float x = (static_cast<float>(u) - cx) / fx, y = (static_cast<float>(v) - cy) / fy;
      const Vec3f along_u = Vec3f{x + 1 / fx, y, 1} * right - Vec3f{x - 1 / fx, y, 1} * left;
      const Vec3f along_v = Vec3f{x, y + 1 / fy, 1} * below - Vec3f{x, y - 1 / fy, 1} * above;
      normals_depth[i] = along_v.cross(along_u).normalized();
    }
}

void paint_grey(std::span<const Shade> shades, std::span<std::uint8_t> rgb) noexcept {
  paint(shades, rgb, [](std::size_t) { return Rgb8{255, 255, 255}; });
}

void paint_labels(std::span<const Shade> shades, std::span<const MaterialId> labels,
                  std::span<std::uint8_t> rgb) noexcept {
  TACTUS_ASSERT(labels.size() == shades.size());
  paint(shades, rgb, [labels](std::size_t i) { return material_color(labels[i]); });
}

void paint_colors(std::span<const Shade> shades, std::span<const Rgb8> colors,
                  std::span<std::uint8_t> rgb) noexcept {
  TACTUS_ASSERT(colors.size() == shades.size());
  paint(shades, rgb, [colors](std::size_t i) { return colors[i]; });
}

}  // namespace tactus::render
