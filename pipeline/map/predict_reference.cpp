#include <algorithm>
#include <cmath>

#include "pipeline/map/field.hpp"
#include "pipeline/map/predict_rules.hpp"
#include "pipeline/register/depth_images.hpp"

namespace tactus::map {
namespace {

struct PixelRay {
  float a, b;  // ray (a, b, 1) in the view
  Vec3f d;     // the same in the lattice, voxels per metre of depth
};

PixelRay ray_of(const PredictConstants& c, int u, int v) {
  PixelRay ray;
  ray.a = (static_cast<float>(u) - c.cx) * c.inverse_fx;
  ray.b = (static_cast<float>(v) - c.cy) * c.inverse_fy;
  ray.d = {(c.r[0] * ray.a + c.r[1] * ray.b + c.r[2]) * c.scale,
           (c.r[3] * ray.a + c.r[4] * ray.b + c.r[5]) * c.scale,
           (c.r[6] * ray.a + c.r[7] * ray.b + c.r[8]) * c.scale};
  return ray;
}

bool read(const Map& map, const PredictConstants& c, const PixelRay& ray, float z, float& value,
          Vec3f& gradient) {
  return sample_field(map, c.ox + ray.d.x * z, c.oy + ray.d.y * z, c.oz + ray.d.z * z, value, gradient);
}

void store(const PredictConstants& c, const PixelRay& ray, float z, const Vec3f& g, std::size_t pixel,
           ModelView& view) {
  const float nx = c.r[0] * g.x + c.r[3] * g.y + c.r[6] * g.z;
  const float ny = c.r[1] * g.x + c.r[4] * g.y + c.r[7] * g.z;
  const float nz = c.r[2] * g.x + c.r[5] * g.y + c.r[8] * g.z;
  const float norm = std::sqrt(nx * nx + ny * ny + nz * nz);
  const float inverse = 1.0f / std::max(norm, 1e-20f);
  const float facing = -((nx * ray.a + ny * ray.b + nz) * inverse);
  const float length = std::sqrt(ray.a * ray.a + ray.b * ray.b + 1.0f);
  if (!(z > 0) || !(facing > PredictConstants::kFacingMin * length)) return;
  view.z_m[pixel] = z;
  view.nx[pixel] = nx * inverse;
  view.ny[pixel] = ny * inverse;
  view.nz[pixel] = nz * inverse;
}

void clear_rows(int row_begin, int row_end, ModelView& view) {
  const auto first = static_cast<std::size_t>(row_begin) * static_cast<std::size_t>(view.camera.width);
  const auto count =
      static_cast<std::size_t>(row_end - row_begin) * static_cast<std::size_t>(view.camera.width);
  for (auto plane : {view.z_m, view.nx, view.ny, view.nz})
    std::fill_n(plane.begin() + static_cast<std::ptrdiff_t>(first), count, 0.0f);
}

}  // namespace

void predict_guided_reference(const Map& map, std::span<const float> depth_m, int row_begin, int row_end,
                              ModelView& view) noexcept {
  const PredictConstants c(map, view);
  const int width = view.camera.width;
  for (int v = row_begin; v < row_end; ++v) {
    const auto row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    for (int u = 0; u < width; ++u) {
      const std::size_t pixel = row + static_cast<std::size_t>(u);
      view.z_m[pixel] = 0;
      const float z0 = depth_m[pixel];
      if (!(z0 > 0)) continue;
      const PixelRay ray = ray_of(c, u, v);
      float f0 = 0, f1 = 0;
      Vec3f gradient;
      if (!read(map, c, ray, z0, f0, gradient) || !(std::fabs(f0) < PredictConstants::kValueMax)) continue;
      const float z1 = z0 + f0 * c.truncation_m;
      if (!read(map, c, ray, z1, f1, gradient) || !(std::fabs(f1) < PredictConstants::kResidualMax)) continue;
      const float change = f0 - f1;
      const bool secant = std::fabs(change) > PredictConstants::kSlopeMin;
      const float step = secant ? (z1 - z0) / change : c.truncation_m;
      const float z = z1 + f1 * step;
      view.z_m[pixel] = z > 0 ? z : 0.0f;
    }
    for (int u = 0; u < width; ++u) {
      const std::size_t pixel = row + static_cast<std::size_t>(u);
      bool complete = u >= kFitPixels && u < width - kFitPixels;
      float sum = 0, slope = 0;
      for (int k = -kFitPixels; complete && k <= kFitPixels; ++k) {
        const float z = view.z_m[pixel + static_cast<std::size_t>(k)];
        complete = z > 0;
        const float inverse = complete ? 1.0f / z : 0.0f;
        sum = sum + inverse;
        slope = slope + static_cast<float>(k) * inverse;
      }
      view.row_sum[pixel] = complete ? sum : 0.0f;
      view.row_slope[pixel] = complete ? slope : 0.0f;
    }
  }
}

void predict_normals_reference(int row_begin, int row_end, ModelView& view) noexcept {
  const int width = view.camera.width, height = view.camera.height;
  const PredictNormalConstants c(view);
  for (int v = row_begin; v < row_end; ++v)
    for (int u = 0; u < width; ++u) {
      const auto pixel =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      view.nx[pixel] = view.ny[pixel] = view.nz[pixel] = 0;
      if (v < kFitPixels || v >= height - kFitPixels || u < kFitPixels || u >= width - kFitPixels) continue;
      bool complete = true;
      float slope_u = 0, slope_v = 0;
      for (int k = -kFitPixels; k <= kFitPixels; ++k) {
        const auto other = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(pixel) + k * width);
        complete = complete && view.row_sum[other] > 0;
        slope_u = slope_u + view.row_slope[other];
        slope_v = slope_v + static_cast<float>(k) * view.row_sum[other];
      }
      if (!complete) continue;
      const auto inverse = [&](int du, int dv) {
        return 1.0f /
               view.z_m[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(pixel) + dv * width + du)];
      };
      const float z = view.z_m[pixel], here = inverse(0, 0);
      const float off = z - 0.4f;
      const float limit = kBendBaseM + kBendSigmas * (0.0012f + 0.0019f * off * off);
      const float bend_u =
          std::fabs(inverse(-kFitPixels, 0) + inverse(kFitPixels, 0) - (here + here)) * (z * z);
      const float bend_v =
          std::fabs(inverse(0, -kFitPixels) + inverse(0, kFitPixels) - (here + here)) * (z * z);
      if (!(bend_u < limit) || !(bend_v < limit)) continue;
      // Plane n . X = d: 1 / z = n . ((u - cx) / fx, (v - cy) / fy, 1) / d; d < 0 turns the normal to the
      // camera.
      const float a = slope_u * c.per_pixel, b = slope_v * c.per_pixel;
      const float nx = c.fx * a, ny = c.fy * b;
      const float nz = here - (a * (static_cast<float>(u) - c.cx) + b * (static_cast<float>(v) - c.cy));
      const float scale = -1.0f / std::sqrt(nx * nx + ny * ny + nz * nz);
      view.nx[pixel] = nx * scale;
      view.ny[pixel] = ny * scale;
      view.nz[pixel] = nz * scale;
    }
}

void predict_marching(const Map& map, int row_begin, int row_end, int stride, float depth_m_max,
                      ModelView& view) noexcept {
  const PredictConstants c(map, view);
  clear_rows(row_begin, row_end, view);
  const float near = 0.2f;
  const float unknown_step_m = 0.5f * c.truncation_m;
  for (int v = row_begin; v < row_end; ++v) {
    if (v % stride != 0) continue;
    for (int u = 0; u < view.camera.width; u += stride) {
      const PixelRay ray = ray_of(c, u, v);
      float z = near, z_front = 0, f_front = -1;  // last read in front of a surface
      while (z < depth_m_max) {
        float f = 0;
        Vec3f gradient;
        if (!read(map, c, ray, z, f, gradient)) {
          f_front = -1;
          z += unknown_step_m;
          continue;
        }
        if (f > 0) {
          z_front = z;
          f_front = f;
          z += std::max(f * c.truncation_m, 0.25f * c.truncation_m);
          continue;
        }
        if (f_front > 0) {
          const float crossing = z_front + (z - z_front) * (f_front / (f_front - f));
          float f_again = 0;
          if (read(map, c, ray, crossing, f_again, gradient)) {
            // One more secant step between the crossing and whichever read lies on its other side.
            const float z_other = f_again > 0 ? z : z_front, f_other = f_again > 0 ? f : f_front;
            const float change = f_again - f_other;
            const float refined =
                std::fabs(change) > 1e-6f ? crossing + (z_other - crossing) * (f_again / change) : crossing;
            store(c, ray, refined, gradient,
                  static_cast<std::size_t>(v) * static_cast<std::size_t>(view.camera.width) +
                      static_cast<std::size_t>(u),
                  view);
          }
          break;
        }
        z += 0.25f * c.truncation_m;  // behind a surface that was entered from unobserved space: go on
      }
    }
  }
}

}  // namespace tactus::map
