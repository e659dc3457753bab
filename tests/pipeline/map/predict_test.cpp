#include "pipeline/map/predict.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/pipeline/map/fusion.hpp"

namespace tactus::map {
namespace {

using test::FusedMap;
using test::RegisteredFrame;

class OwnedView {
 public:
  explicit OwnedView(const hal::Intrinsics& camera)
      : bytes_(rt::round_up(ModelView::bytes_needed(camera.width, camera.height), 64)),
        memory_(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)), &std::free) {
    rt::Slice slice({memory_.get(), bytes_});
    view.bind(slice, camera);
    for (auto* plane : {&view.z_m, &view.nx, &view.ny, &view.nz})
      std::fill(plane->begin(), plane->end(), 77.0f);
  }
  ModelView view;

 private:
  std::size_t bytes_;
  std::unique_ptr<std::byte, decltype(&std::free)> memory_;
};

::testing::AssertionResult same_bits(const char* what, std::span<const float> a, std::span<const float> b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::memcmp(&a[i], &b[i], sizeof(float)) != 0)
      return ::testing::AssertionFailure()
             << what << " at pixel " << i << ": " << a[i] << " against " << b[i];
  return ::testing::AssertionSuccess();
}

TEST(Predict, EveryInstructionSetEqualsTheReferenceBitForBit) {
  auto renderer = test::renderer_of("synthetic:bedroom?mode=320x240&frames=120");
  RegisteredFrame frame(renderer.calibration().depth);
  FusedMap fused;
  for (int i = 0; i < 6; ++i) {
    frame.measure(renderer, i);
    fused.fuse(frame.at(renderer.pose(i), static_cast<std::uint32_t>(i + 1)));
  }
  OwnedView expected(frame.half_camera);
  const int height = frame.half_camera.height;
  expected.view.T_world_view = renderer.pose(5);
  predict_guided_reference(fused.map(), frame.half_m, 0, height, expected.view);
  predict_normals_reference(0, height, expected.view);
  const auto known =
      std::count_if(expected.view.nz.begin(), expected.view.nz.end(), [](float n) { return n < 0; });
  ASSERT_GT(known, 3000);
  test::for_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    OwnedView sut(frame.half_camera);
    sut.view.T_world_view = renderer.pose(5);
    // In parts, as the threads do it.
    for (int row = 0; row < height; row += 8)
      predict_guided(fused.map(), frame.half_m, row, std::min(row + 8, height), sut.view);
    for (int row = 0; row < height; row += 8) predict_normals(row, std::min(row + 8, height), sut.view);
    EXPECT_TRUE(same_bits("z", sut.view.z_m, expected.view.z_m));
    EXPECT_TRUE(same_bits("row sum", sut.view.row_sum, expected.view.row_sum));
    EXPECT_TRUE(same_bits("row slope", sut.view.row_slope, expected.view.row_slope));
    EXPECT_TRUE(same_bits("nx", sut.view.nx, expected.view.nx));
    EXPECT_TRUE(same_bits("ny", sut.view.ny, expected.view.ny));
    EXPECT_TRUE(same_bits("nz", sut.view.nz, expected.view.nz));
  });
}

struct PlaneView {
  Vec3d normal = Vec3d{0.3, -0.4, -1}.normalized();
  double offset = -normal.dot({0, 0, 1.42});
  RegisteredFrame frame{test::small_camera()};
  FusedMap fused;
  OwnedView owned{frame.half_camera};

  PlaneView() {
    frame.measure([&](double a, double b) { return -offset / normal.dot({a, b, 1}); });
    for (std::uint32_t index = 1; index <= 3; ++index) fused.fuse(frame.at({}, index));
  }
  [[nodiscard]] Vec3d ray(int u, int v) const {
    return {(u - frame.half_camera.cx) / frame.half_camera.fx,
            (v - frame.half_camera.cy) / frame.half_camera.fy, 1};
  }
};

TEST(Predict, GuidedViewOfAPlaneIsThePlane) {
  PlaneView plane;
  ModelView& view = plane.owned.view;
  predict_guided(plane.fused.map(), plane.frame.half_m, 0, view.camera.height, view);
  predict_normals(0, view.camera.height, view);
  int known_count = 0, normals_count = 0;
  for (int v = 8; v < view.camera.height - 8; ++v)
    for (int u = 8; u < view.camera.width - 8; ++u) {
      const auto i = static_cast<std::size_t>(v * view.camera.width + u);
      if (!(view.z_m[i] > 0)) continue;
      ++known_count;
      EXPECT_NEAR(view.z_m[i], -plane.offset / plane.normal.dot(plane.ray(u, v)), 0.0005) << u << ' ' << v;
      if (!(view.nz[i] < 0)) continue;
      ++normals_count;
      EXPECT_GT(plane.normal.dot(Vec3f{view.nx[i], view.ny[i], view.nz[i]}.cast<double>()), 0.9995)
          << u << ' ' << v;
    }
  const int all = (view.camera.height - 16) * (view.camera.width - 16);
  EXPECT_GT(known_count, all * 98 / 100);
  EXPECT_GT(normals_count, all * 95 / 100);
}

TEST(Predict, MarchingFindsThePlaneFromAnotherPose) {
  PlaneView plane;
  ModelView& view = plane.owned.view;
  const T_WorldDepth elsewhere{Rotation::from(Quaternion{1, 0.03, -0.06, 0.02}.normalized()),
                               {0.06, -0.04, -0.2}};
  view.T_world_view = elsewhere;
  constexpr int kStride = 2;
  predict_marching(plane.fused.map(), 0, view.camera.height, kStride, 5.0f, view);
  int hits_count = 0;
  for (int v = 0; v < view.camera.height; ++v)
    for (int u = 0; u < view.camera.width; ++u) {
      const auto i = static_cast<std::size_t>(v * view.camera.width + u);
      if (u % kStride != 0 || v % kStride != 0) {
        ASSERT_EQ(view.z_m[i], 0) << u << ' ' << v;
        continue;
      }
      if (!(view.z_m[i] > 0)) continue;
      ++hits_count;
      const Vec3d p = elsewhere * (plane.ray(u, v) * static_cast<double>(view.z_m[i]));
      EXPECT_NEAR(plane.normal.dot(p) + plane.offset, 0, 0.001) << u << ' ' << v;
      const Vec3d n = elsewhere.rotation * Vec3f{view.nx[i], view.ny[i], view.nz[i]}.cast<double>();
      EXPECT_GT(plane.normal.dot(n), 0.98);
    }
  EXPECT_GT(hits_count, view.camera.width * view.camera.height / 4 * 6 / 10);
}

TEST(Predict, NoMeasurementNoPrediction) {
  PlaneView plane;
  ModelView& view = plane.owned.view;
  std::vector<float> none(plane.frame.half_m.size(), 0.0f);
  predict_guided(plane.fused.map(), none, 0, view.camera.height, view);
  predict_normals(0, view.camera.height, view);
  for (std::size_t i = 0; i < none.size(); ++i) {
    ASSERT_EQ(view.z_m[i], 0);
    ASSERT_EQ(view.nz[i], 0);
  }
}

TEST(Predict, MeasurementFarFromTheModelIsLeftOut) {
  PlaneView plane;
  ModelView& view = plane.owned.view;
  std::vector<float> nearer = plane.frame.half_m;
  for (float& z : nearer) z *= 0.8f;
  predict_guided(plane.fused.map(), nearer, 0, view.camera.height, view);
  EXPECT_TRUE(std::all_of(view.z_m.begin(), view.z_m.end(), [](float z) { return z == 0; }));
}

}  // namespace
}  // namespace tactus::map
