#include "hal/synthetic/shade.hpp"

#include <array>
#include <cmath>

#include "hal/synthetic/pixel_kernels.hpp"

namespace tactus::hal::synthetic {
namespace {

std::uint8_t lit(std::uint8_t albedo, float light) {
  const float v = static_cast<float>(albedo) * light;
  // Compresses the highlights above 200 instead of cutting them off.
  const float w = v < 200.0F ? v : 200.0F + (v - 200.0F) * 55.0F / (v - 145.0F);
  return static_cast<std::uint8_t>(w + 0.5F);
}

/// Camera coordinates to a solid's texture point, single precision.
struct CameraToTexture {
  std::array<float, 9> m;
  Vec3f origin;
  [[nodiscard]] Vec3f operator()(float x, float y, float z) const {
    return {origin.x + z * (m[0] * x + m[1] * y + m[2]), origin.y + z * (m[3] * x + m[4] * y + m[5]),
            origin.z + z * (m[6] * x + m[7] * y + m[8])};
  }
};

CameraToTexture camera_to_texture(const Primitive& solid, const T_WorldDepth& T_world_camera) {
  const Rotation r = solid.R_local_world * T_world_camera.rotation;
  CameraToTexture result{};
  for (std::size_t i = 0; i < 9; ++i) result.m[i] = static_cast<float>(r.m[i]);
  result.origin = texture_point(solid, solid.to_local(T_world_camera.translation).cast<float>());
  return result;
}

/// Axis of the local normal that a world normal stands for.
int axis_of(const Primitive& solid, const Vec3f& n) {
  const Vec3d n_world = n.cast<double>();
  return dominant_axis((solid.R_local_world * n_world).cast<float>());
}

}  // namespace

int dominant_axis(const Vec3f& n) {
  const float x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
  if (y >= x && y >= z) return 1;
  return x >= z ? 0 : 2;
}

Vec3f texture_point(const Primitive& solid, const Vec3f& p_local) {
  return p_local + (solid.center_world_m * 0.37).cast<float>();
}

Rgb8 sample_along(const Texture& texture, const Vec3f& p, int axis, float footprint_m) {
  if (axis == 1) return texture.sample(p.x, p.z, footprint_m);
  return texture.sample(axis == 0 ? p.z : p.x, -p.y, footprint_m);
}

void shade(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_camera, const Hits& hits,
           std::span<std::uint8_t> rgb) {
  const auto primitives = scene.primitives();
  const auto finishes = scene.finishes();
  const auto textures = scene.textures();
  const auto m_per_px_at_1m = static_cast<float>(1 / rays.focal_px());
  PixelRow row_rays;
  alignas(64) std::array<float, kRowCapacity> light;
  // Neighbours mostly lie on the same solid: its transform is made when it changes.
  std::uint16_t solid_index = kNoPrimitive;
  CameraToTexture to_texture{};
  std::size_t pixel = 0;
  for (int row = 0; row < rays.height(); ++row) {
    const auto width = static_cast<std::size_t>(rays.width());
    rays.copy_row(row, std::span(row_rays.x).first(width), std::span(row_rays.y).first(width));
    light_row(scene, T_world_camera, row_rays, width, hits, pixel, light);
    for (std::size_t column = 0; column < width; ++column, ++pixel) {
      std::uint8_t* out = rgb.data() + pixel * 3;
      const std::uint16_t index = hits.primitive[pixel];
      if (index == kNoPrimitive) {
        out[0] = out[1] = out[2] = 0;
        continue;
      }
      const Primitive& solid = primitives[index];
      if (index != solid_index) {
        to_texture = camera_to_texture(solid, T_world_camera);
        solid_index = index;
      }
      const float z = hits.depth_m[pixel];
      const int face = hits.face[pixel];
      const int axis =
          face != 0 ? (face - 1) / 2
                    : axis_of(solid, {hits.normal_x[pixel], hits.normal_y[pixel], hits.normal_z[pixel]});
      const Finish& finish = finishes[solid.finish];
      const Rgb8 albedo =
          sample_along(textures[finish.texture], to_texture(row_rays.x[column], row_rays.y[column], z), axis,
                       z * m_per_px_at_1m);
      const float brightness = finish.emission + (1 - finish.emission) * light[column];
      out[0] = lit(albedo.r, brightness);
      out[1] = lit(albedo.g, brightness);
      out[2] = lit(albedo.b, brightness);
    }
  }
}

}  // namespace tactus::hal::synthetic
