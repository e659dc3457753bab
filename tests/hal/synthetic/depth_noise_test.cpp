#include "hal/synthetic/depth_noise.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "hal/synthetic/options.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "hal/synthetic/trajectory.hpp"

namespace tactus::hal::synthetic {
namespace {

using namespace noise_model;

constexpr double kUnit_m = kDepth_m_per_unit;

/// One noisy frame with all that is known of it.
struct NoisyFrame {
  explicit NoisyFrame(const Scene& room, const SyntheticOptions& options)
      : scene(room),
        k(calibration_of(options).depth),
        caster(room, k),
        hits(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height)),
        raw(hits.pixels_count()) {}

  void take(const T_WorldDepth& at, std::uint64_t seed, int frame) {
    pose = at;
    caster.cast(pose, hits);
    caster.find_normals(pose, hits);
    apply_depth_noise(scene, caster.rays(), pose, hits, seed, frame, raw);
  }
  [[nodiscard]] Vec3d ray(std::size_t pixel) const {
    const auto width = static_cast<std::size_t>(k.width);
    return {(static_cast<double>(pixel % width) - k.cx) / k.fx,
            (static_cast<double>(pixel / width) - k.cy) / k.fy, 1};
  }
  [[nodiscard]] Vec3d normal_camera(std::size_t pixel) const {
    const Vec3d n{static_cast<double>(hits.normal_x[pixel]), static_cast<double>(hits.normal_y[pixel]),
                  static_cast<double>(hits.normal_z[pixel])};
    return pose.rotation.transposed() * n;
  }
  [[nodiscard]] double incidence_cosine(std::size_t pixel) const {
    return -normal_camera(pixel).dot(ray(pixel)) / ray(pixel).norm();
  }
  [[nodiscard]] Material material(std::size_t pixel) const {
    return scene.finishes()[scene.primitives()[hits.primitive[pixel]].finish].material;
  }
  [[nodiscard]] bool is_pane(std::size_t pixel) const {
    return material(pixel) == Material::glass || material(pixel) == Material::mirror;
  }
  /// Every pixel within `reach` lies on the same solid.
  [[nodiscard]] bool is_interior(std::size_t pixel, int reach) const {
    const int column = static_cast<int>(pixel) % k.width, row = static_cast<int>(pixel) / k.width;
    if (column < reach || row < reach || column >= k.width - reach || row >= k.height - reach) return false;
    for (int r = row - reach; r <= row + reach; ++r)
      for (int c = column - reach; c <= column + reach; ++c)
        if (hits.primitive[static_cast<std::size_t>(r * k.width + c)] != hits.primitive[pixel]) return false;
    return true;
  }

  const Scene& scene;
  Intrinsics k;
  Raycaster caster;
  Hits hits;
  std::vector<std::uint16_t> raw;
  T_WorldDepth pose;
};

struct Moments {
  double sum = 0, squares = 0;
  long count = 0;
  void add(double v) {
    sum += v;
    squares += v * v;
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / static_cast<double>(count); }
  [[nodiscard]] double sigma() const {
    return std::sqrt(squares / static_cast<double>(count) - mean() * mean());
  }
};

double disparity_step_m(double z_m) { return z_m * z_m / kRig_px_m * kDisparityStep_px; }

/// A camera that looks straight at the flat wall from `z_m` away.
T_WorldDepth facing_the_wall(double z_m) { return {{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {0, 1.25, -1.5 + z_m}}; }

TEST(DepthNoise, FrontalWallHasTheModelsMeanAndSigma) {
  const Scene wall = make_scene(SceneId::wall);
  NoisyFrame sut(wall, {});
  for (const double z_m : {0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
    Moments error;
    for (int frame = 0; frame < 2; ++frame) {
      sut.take(facing_the_wall(z_m), 5, frame);
      for (const std::uint16_t raw : sut.raw) {
        ASSERT_NE(raw, 0);
        error.add(raw * kUnit_m - z_m);
      }
    }
    // Rounding to steps adds their variance / 12 when the noise spans the steps, as it does from half a sigma
    // on.
    const double step = disparity_step_m(z_m);
    const double expected = std::sqrt(axial_sigma_m(z_m) * axial_sigma_m(z_m) + step * step / 12);
    EXPECT_NEAR(error.sigma() / expected, 1, 0.05) << z_m;
    // Steps are rounded in disparity, whose reciprocal is convex; and partly undithered steps leave a bias.
    EXPECT_NEAR(error.mean(), 0, 0.02 * step + 0.05 * expected) << z_m;
  }
}

TEST(DepthNoise, AxialErrorsAreNearNormalAndIndependent) {
  const Scene wall = make_scene(SceneId::wall);
  NoisyFrame sut(wall, {});
  sut.take(facing_the_wall(1.0), 9, 0);
  const std::vector<std::uint16_t> first = sut.raw;
  sut.take(facing_the_wall(1.0), 9, 1);
  Moments all;
  double fourth = 0, neighbor = 0, next_frame = 0;
  for (std::size_t i = 0; i + 1 < first.size(); ++i) {
    const double a = first[i] * kUnit_m - 1.0, b = first[i + 1] * kUnit_m - 1.0,
                 c = sut.raw[i] * kUnit_m - 1.0;
    all.add(a);
    fourth += a * a * a * a;
    neighbor += a * b;
    next_frame += a * c;
  }
  const double variance = all.sigma() * all.sigma(), n = static_cast<double>(all.count);
  EXPECT_NEAR(fourth / n / (variance * variance), 3, 0.3);
  // Standard error of a correlation from 307199 pairs is 0.0018.
  EXPECT_LT(std::fabs(neighbor / n / variance), 0.01);
  EXPECT_LT(std::fabs(next_frame / n / variance), 0.01);
}

TEST(DepthNoise, SlantedFloorShowsTheLateralJitter) {
  const Scene corner = make_scene(SceneId::corner);
  NoisyFrame sut(corner, {});
  // Looks 30 degrees down: the floor is slanted by about 60 degrees.
  const double s = 0.5, c = std::sqrt(0.75);
  std::array<Moments, 3> by_depth;  // normalised errors at 2.0, 2.5, 3.0 m
  for (int frame = 0; frame < 2; ++frame) {
    sut.take({{{1, 0, 0, 0, -c, -s, 0, s, -c}}, {0, 1.3, 1.5}}, 3, frame);
    for (std::size_t i = 0; i < sut.raw.size(); ++i) {
      if (sut.hits.primitive[i] != 0 || !sut.is_interior(i, 5)) continue;
      const double z_m = static_cast<double>(sut.hits.depth_m[i]);
      const double bin = (z_m - 1.75) / 0.5;
      if (bin < 0 || bin >= 3) continue;
      ASSERT_NE(sut.raw[i], 0);
      // z of a plane: n . (ray z) = const, so dz/du = -z n_x / (f n . ray).
      const Vec3d n = sut.normal_camera(i);
      const double slope = z_m * std::sqrt(n.x * n.x + n.y * n.y) / (sut.k.fx * std::fabs(n.dot(sut.ray(i))));
      const double step = disparity_step_m(z_m);
      const double expected = std::sqrt(axial_sigma_m(z_m) * axial_sigma_m(z_m) + step * step / 12 +
                                        slope * slope * kLateral_px * kLateral_px);
      by_depth[static_cast<std::size_t>(bin)].add((sut.raw[i] * kUnit_m - z_m) / expected);
    }
  }
  for (const Moments& m : by_depth) {
    ASSERT_GT(m.count, 5000);
    EXPECT_NEAR(m.sigma(), 1, 0.05);
    EXPECT_NEAR(m.mean(), 0, 0.05);
  }
}

TEST(DepthNoise, EveryDepthIsAWholeDisparityStep) {
  const Scene room = make_scene(SceneId::bedroom);
  NoisyFrame sut(room, {});
  sut.take(pose_at({}, room.loop(), 20), 1, 20);
  int kept = 0;
  for (const std::uint16_t raw : sut.raw) {
    if (raw == 0) continue;
    ++kept;
    const double steps = kRig_px_m / kDisparityStep_px / (raw * kUnit_m);
    const double rounding = steps / raw;  // half a raw unit either way
    EXPECT_NEAR(steps, std::round(steps), 0.51 * rounding + 1e-4);
  }
  EXPECT_GT(kept, 200000);
}

class HolesIn : public testing::TestWithParam<SceneId> {};
INSTANTIATE_TEST_SUITE_P(Rooms, HolesIn, testing::Values(SceneId::bedroom, SceneId::office),
                         [](const auto& scene) { return std::string(name(scene.param)); });

TEST_P(HolesIn, AreWhereTheSensorIsBlindAndNowhereElse) {
  const Scene room = make_scene(GetParam());
  NoisyFrame sut(room, {});
  SyntheticOptions options;
  options.scene = GetParam();
  long grazing = 0, far = 0, panes = 0, panes_kept = 0, edges = 0, edges_kept = 0, plain = 0;
  for (const int frame : {0, 60, 240}) {
    sut.take(pose_at(options, room.loop(), frame), 1, frame);
    const auto width = static_cast<std::size_t>(sut.k.width);
    for (std::size_t i = width; i + width < sut.raw.size(); ++i) {
      if (i % width == 0 || i % width == width - 1 || sut.hits.primitive[i] == kNoPrimitive) continue;
      const float z = sut.hits.depth_m[i];
      const bool is_hole = sut.raw[i] == 0;
      const double cosine = sut.incidence_cosine(i);
      bool is_edge = false;
      for (const std::size_t j : {i - 1, i + 1, i - width, i + width})
        is_edge = is_edge || std::fabs(sut.hits.depth_m[j] - z) > static_cast<float>(kEdgeJump) * z;
      if (cosine < kGrazing_cosine - 1e-4) {
        ++grazing;
        EXPECT_TRUE(is_hole) << "frame " << frame << " pixel " << i;
      } else if (z > 8.001F || z < 0.399F) {
        ++far;
        EXPECT_TRUE(is_hole) << "frame " << frame << " pixel " << i;
      } else if (sut.is_pane(i)) {
        ++panes;
        panes_kept += is_hole ? 0 : 1;
      } else if (is_edge) {
        ++edges;
        edges_kept += is_hole ? 0 : 1;
      } else if (cosine > kGrazing_cosine + 1e-4 && sut.is_interior(i, 30)) {
        // Far from other solids nothing shades the projector's light.
        ++plain;
        EXPECT_FALSE(is_hole) << "frame " << frame << " pixel " << i;
      }
    }
  }
  EXPECT_GT(grazing, 100);
  EXPECT_GT(far, 100);
  EXPECT_GT(plain, 30000);
  ASSERT_GT(panes, 5000);
  EXPECT_NEAR(static_cast<double>(panes_kept) / static_cast<double>(panes), kPaneReturn, 0.04);
  ASSERT_GT(edges, 5000);
  // Half of them by chance, and what lies in the projector's shadow.
  EXPECT_GT(static_cast<double>(edges_kept) / static_cast<double>(edges), 0.25);
  EXPECT_LT(static_cast<double>(edges_kept) / static_cast<double>(edges), 0.52);
}

TEST_P(HolesIn, LieInTheProjectorsShadow) {
  const Scene room = make_scene(GetParam());
  SyntheticOptions options;
  options.scene = GetParam();
  NoisyFrame sut(room, {});
  long shadowed = 0, shadowed_holes = 0, lit = 0, lit_holes = 0;
  for (const int frame : {60, 150, 225}) {
    sut.take(pose_at(options, room.loop(), frame), 1, frame);
    const Vec3d projector = sut.pose * Vec3d{kBaseline_m, 0, 0};
    const auto width = static_cast<std::size_t>(sut.k.width);
    for (std::size_t i = width + 100; i + width < sut.raw.size(); i += 13) {
      if (i % width < 100 || i % width >= width - 100 || sut.hits.primitive[i] == kNoPrimitive) continue;
      const float z = sut.hits.depth_m[i];
      if (sut.is_pane(i) || sut.incidence_cosine(i) < 0.25 || z > 7.9F) continue;
      bool is_edge = false;
      for (const std::size_t j : {i - 1, i + 1, i - width, i + width})
        is_edge = is_edge || std::fabs(sut.hits.depth_m[j] - z) > static_cast<float>(kEdgeJump) * z;
      if (is_edge) continue;
      const Vec3d n{static_cast<double>(sut.hits.normal_x[i]), static_cast<double>(sut.hits.normal_y[i]),
                    static_cast<double>(sut.hits.normal_z[i])};
      const Vec3d p = sut.pose * (sut.ray(i) * static_cast<double>(z));
      const Vec3d way = projector - p;
      if (n.dot(way) < 0.3 * way.norm()) continue;
      // From 4 cm off the surface to the projector: how near to, or how deep in, any solid does the light
      // pass?
      double clearance_m = 1;
      for (double walked = 0.04 / way.norm(); walked < 1;) {
        const double d = room.distance(p + way * walked);
        clearance_m = std::min(clearance_m, d);
        walked += std::max(d, 2e-3) / way.norm();
      }
      const bool is_hole = sut.raw[i] == 0;
      // Within half a pixel, 3 mm at 3 m, of the shadow's border either answer is right; so it is beside
      // another solid, which may shade from less than 4 cm above.
      if (clearance_m < -0.004) {
        ++shadowed;
        shadowed_holes += is_hole ? 1 : 0;
      } else if (clearance_m > 0.01 && sut.is_interior(i, 8)) {
        ++lit;
        lit_holes += is_hole ? 1 : 0;
      }
    }
  }
  ASSERT_GT(shadowed, 40);
  ASSERT_GT(lit, 10000);
  // The model works on what the camera sees: a shade thrown by something hidden from it is missed.
  EXPECT_GT(static_cast<double>(shadowed_holes) / static_cast<double>(shadowed), 0.9);
  EXPECT_EQ(lit_holes, 0);
}

TEST(DepthNoise, FollowsSeedAndFrameAndNothingElse) {
  const Scene room = make_scene(SceneId::corner);
  NoisyFrame one(room, {}), two(room, {});
  const T_WorldDepth pose = pose_at({}, room.loop(), 0);
  one.take(pose, 4, 10);
  two.take(pose, 4, 11);
  EXPECT_NE(one.raw, two.raw);
  two.take(pose, 5, 10);
  EXPECT_NE(one.raw, two.raw);
  two.take(pose, 4, 10);
  EXPECT_EQ(one.raw, two.raw);
}

TEST(QuantizeExact, RoundsToTheUnitAndDropsWhatDoesNotFit) {
  const std::vector<float> depth_m = {0.0F, 1.0F, 1.00009F, 1.00011F, 13.1F, 13.2F, 0.00005F};
  std::vector<std::uint16_t> raw(depth_m.size());
  quantize_exact(depth_m, raw);
  EXPECT_EQ(raw, (std::vector<std::uint16_t>{0, 5000, 5000, 5001, 65500, 0, 0}));
}

}  // namespace
}  // namespace tactus::hal::synthetic
