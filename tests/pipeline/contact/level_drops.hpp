// Bodies above level surfaces that a camera sees on a map.
#pragma once

#include <random>
#include <vector>

#include "hal/calibration.hpp"
#include "pipeline/map/reader.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::test {

/// Up to `count` mixed bodies of 2 to 8 cm, 2 cm above where rays of the camera meet a level surface.
inline std::vector<contact::BodySpec> level_drops(const map::Reader& reader, const hal::Intrinsics& camera,
                                                  const T_WorldDepth& T_world_depth, std::size_t count,
                                                  std::mt19937& random) {
  std::vector<contact::BodySpec> specs;
  for (int tries = 0; tries < 20000 && specs.size() < count; ++tries) {
    const double u = static_cast<double>(random() % static_cast<unsigned>(camera.width)),
                 v = static_cast<double>(random() % static_cast<unsigned>(camera.height));
    const Vec3d ray{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
    map::SurfacePoint hit;
    if (!reader.raycast(T_world_depth.translation.cast<float>(), (T_world_depth.rotation * ray).cast<float>(),
                        4, hit) ||
        hit.normal_world.y < 0.9F)
      continue;
    contact::BodySpec spec;
    spec.shape = small_shape(static_cast<int>(specs.size()), random);
    spec.position_world_m =
        hit.position_world_m.cast<double>() + Vec3d{0, contact::reach_m(spec.shape) + 0.02, 0};
    const auto turn = [&random] { return static_cast<double>(random()) / 2147483648.0 - 1; };
    spec.q_world_body = Quaternion{1, turn(), turn(), turn()}.normalized();
    specs.push_back(spec);
  }
  return specs;
}

}  // namespace tactus::test
