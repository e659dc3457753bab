#include "pipeline/render/camera.hpp"

#include "rt/assert.hpp"

namespace tactus::render {

Projection projection_matrix(const hal::Intrinsics& camera, const ClipRange& range) {
  TACTUS_ASSERT(!camera.has_distortion());
  TACTUS_ASSERT(camera.width > 0 && camera.height > 0 && 0 < range.near_m && range.near_m < range.far_m);
  const double width = camera.width, height = camera.height;
  const double near_m = static_cast<double>(range.near_m), far_m = static_cast<double>(range.far_m);
  Projection m{};
  m[0] = static_cast<float>(2 * camera.fx / width);
  m[5] = static_cast<float>(-2 * camera.fy / height);
  m[8] = static_cast<float>((2 * camera.cx + 1) / width - 1);
  m[9] = static_cast<float>(1 - (2 * camera.cy + 1) / height);
  m[10] = static_cast<float>((far_m + near_m) / (far_m - near_m));
  m[11] = 1;
  m[14] = static_cast<float>(-2 * far_m * near_m / (far_m - near_m));
  return m;
}

}  // namespace tactus::render
