#include "pipeline/map/integrate.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "pipeline/map/reader.hpp"
#include "tests/pipeline/map/fusion.hpp"

namespace tactus::map {
namespace {

using test::FusedMap;
using test::RegisteredFrame;

// The first voxel that differs, if any.
::testing::AssertionResult same_bits(const Map& a, const Map& b) {
  if (a.blocks_used() != b.blocks_used())
    return ::testing::AssertionFailure() << a.blocks_used() << " blocks against " << b.blocks_used();
  for (std::uint32_t i = 0; i < a.config().blocks_capacity; ++i) {
    const auto block = static_cast<BlockIndex>(i);
    if (a.key(block) == kNoKey) continue;
    const BlockIndex other = b.find(a.key(block));
    if (other == kNoBlock) return ::testing::AssertionFailure() << "block " << a.key(block) << " is missing";
    for (int v = 0; v < kBlockVoxels; ++v)
      if (a.tsdf(block)[v] != b.tsdf(other)[v] || a.weight(block)[v] != b.weight(other)[v])
        return ::testing::AssertionFailure()
               << "block " << a.key(block) << " voxel " << v << ": " << a.tsdf(block)[v] << " weight "
               << int{a.weight(block)[v]} << " against " << b.tsdf(other)[v] << " weight "
               << int{b.weight(other)[v]};
    if (std::memcmp(a.color(block), b.color(other), kBlockCells * sizeof(ColorCell)) != 0)
      return ::testing::AssertionFailure() << "colours of block " << a.key(block);
  }
  return ::testing::AssertionSuccess();
}

// Noise, holes, glancing angles, colours, views from frames apart: what the kernel meets in earnest.
TEST(Integrate, EveryInstructionSetEqualsTheReferenceBitForBit) {
  auto renderer = test::renderer_of("synthetic:bedroom?mode=320x240&frames=120");
  std::vector<RegisteredFrame> frames;
  const std::vector<int> indices = {0, 1, 25, 50, 51};
  for (const int i : indices) {
    frames.emplace_back(renderer.calibration().depth);
    frames.back().measure(renderer, i);
  }
  const auto fuse_all = [&](FusedMap& into, auto integrate) {
    for (std::size_t i = 0; i < frames.size(); ++i)
      into.fuse(frames[i].at(renderer.pose(indices[i]), static_cast<std::uint32_t>(i + 1)), integrate);
  };
  FusedMap expected;
  fuse_all(expected, integrate_blocks_reference);
  ASSERT_GT(expected.map().blocks_used(), 500U);
  int sets_count = 0;
  test::for_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    ++sets_count;
    FusedMap sut;
    fuse_all(sut, integrate_blocks);
    EXPECT_TRUE(same_bits(expected.map(), sut.map()));
  });
  EXPECT_GE(sets_count, 1);
}

// Beside the camera, behind it, through its centre: where projections overflow.
TEST(Integrate, EqualsTheReferenceForBlocksAllAroundTheCamera) {
  RegisteredFrame frame(test::small_camera());
  frame.measure([](double a, double b) { return 0.4 / (1 + 0.3 * a - 0.2 * b); });
  FusedMap expected, sut;
  for (int z = -8; z < 8; ++z)
    for (int y = -8; y < 8; ++y)
      for (int x = -8; x < 8; ++x) {
        static_cast<void>(expected.map().find_or_allocate(key_of({x, y, z})));
        static_cast<void>(sut.map().find_or_allocate(key_of({x, y, z})));
      }
  std::vector<BlockIndex> blocks;
  test::live_blocks(sut.map(), blocks);
  const T_WorldDepth oblique{Rotation::from(Quaternion{0.9, 0.2, -0.3, 0.1}.normalized()),
                             {0.013, -0.02, 0.005}};
  integrate_blocks_reference(expected.map(), frame.at(oblique, 1), blocks);
  integrate_blocks(sut.map(), frame.at(oblique, 1), blocks);
  EXPECT_TRUE(same_bits(expected.map(), sut.map()));
}

TEST(Integrate, AnyPartitionOfTheBlocksGivesTheSameMap) {
  auto renderer = test::renderer_of("synthetic:office?mode=320x240&frames=30");
  RegisteredFrame frame(renderer.calibration().depth);
  frame.measure(renderer, 3);
  FusedMap whole, parts;
  const auto in_parts = [](Map& map, const IntegrationFrame& f, std::span<const BlockIndex> blocks) {
    for (std::size_t first = blocks.size(); first > 0;) {
      const std::size_t count = std::min<std::size_t>(37, first);
      first -= count;
      integrate_blocks(map, f, blocks.subspan(first, count));
    }
  };
  for (std::uint32_t index = 1; index <= 3; ++index) {
    whole.fuse(frame.at(renderer.pose(3), index));
    parts.fuse(frame.at(renderer.pose(3), index), in_parts);
  }
  EXPECT_TRUE(same_bits(whole.map(), parts.map()));
}

struct Tilt {
  double about_x_degrees, about_y_degrees;
};

class IntegratePlane : public testing::TestWithParam<Tilt> {};

TEST_P(IntegratePlane, SurfaceLiesWithinAFifthOfAMillimetre) {
  const double to_radians = 3.14159265358979 / 180;
  const double ax = GetParam().about_x_degrees * to_radians, ay = GetParam().about_y_degrees * to_radians;
  // Towards the camera, which looks along +z.
  const Vec3d normal{std::sin(ay), std::sin(ax) * std::cos(ay), -std::cos(ax) * std::cos(ay)};
  const double offset = -normal.dot({0, 0, 1.5037});
  RegisteredFrame frame(test::small_camera());
  frame.measure([&](double a, double b) {
    const double slope = normal.dot({a, b, 1});
    return slope < -0.1 ? -offset / slope : 0.0;
  });
  FusedMap sut;
  for (std::uint32_t index = 1; index <= 4; ++index) sut.fuse(frame.at({}, index));
  const Reader reader(sut.map());
  double worst_m = 0;
  int hits_count = 0, misses_count = 0;
  for (double b = -0.3; b <= 0.3; b += 0.021)
    for (double a = -0.4; a <= 0.4; a += 0.023) {
      const double z = -offset / normal.dot({a, b, 1});
      if (!(z > 0.6 && z < 2.6)) continue;
      // Slopes are stored in a byte: beyond 127 units a pixel the tangent plane is not the surface's.
      const double slope_unit = static_cast<double>(kSlopeUnitM);
      const double slope =
          z * z / offset * std::max(std::fabs(normal.x), std::fabs(normal.y)) / frame.camera.fx;
      if (slope > 120 * slope_unit) continue;
      SurfacePoint hit;
      if (!reader.raycast({0, 0, 0}, Vec3d{a, b, 1}.cast<float>(), 6, hit)) {
        ++misses_count;
        continue;
      }
      ++hits_count;
      worst_m = std::max(worst_m, std::fabs(normal.dot(hit.position_world_m.cast<double>()) + offset));
      EXPECT_GT(hit.normal_world.cast<double>().dot(normal), 0.99);
    }
  EXPECT_GT(hits_count, 300);
  // A block of which the surface cuts off a corner smaller than the grid of rays that allocate is not made:
  // holes a voxel wide, until the camera moves.
  EXPECT_LE(misses_count, hits_count * 3 / 100);
  EXPECT_LT(worst_m, 0.0002);
}

INSTANTIATE_TEST_SUITE_P(Angles, IntegratePlane,
                         testing::Values(Tilt{0, 0}, Tilt{10, 0}, Tilt{0, 25}, Tilt{20, -30}, Tilt{-45, 0},
                                         Tilt{0, 60}));

TEST(Integrate, CarvesWhatIsNoLongerThere) {
  RegisteredFrame with_box(test::small_camera()), without(test::small_camera());
  with_box.measure([](double a, double b) { return std::fabs(a) < 0.2 && std::fabs(b) < 0.2 ? 1.0 : 2.0; });
  without.measure([](double, double) { return 2.0; });
  FusedMap sut;
  const Reader reader(sut.map());
  std::uint32_t index = 0;
  const auto front = [&]() -> float {
    SurfacePoint hit;
    return reader.raycast({0, 0, 0}, {0.01f, 0.02f, 1}, 5, hit) ? hit.position_world_m.z : 0.0f;
  };
  for (int i = 0; i < 3; ++i) sut.fuse(with_box.at({}, ++index));
  EXPECT_NEAR(front(), 1.0, 0.001);
  int frames_count = 0;
  while (std::fabs(front() - 2.0f) > 0.001f && frames_count < 120) {
    sut.fuse(without.at({}, ++index));
    ++frames_count;
  }
  EXPECT_LT(frames_count, 60) << "two seconds";
}

TEST(Integrate, DepthEdgeLeavesNoBridge) {
  RegisteredFrame frame(test::small_camera());
  frame.measure([](double a, double) { return a < 0 ? 1.0 : 2.0; });
  FusedMap sut;
  for (std::uint32_t index = 1; index <= 5; ++index) sut.fuse(frame.at({}, index));
  const Reader reader(sut.map());
  for (double z = 1.2; z < 1.8; z += 0.05) {
    float distance_m = 0;
    const Vec3d p{-0.01, 0, z};
    if (reader.distance(p.cast<float>(), distance_m)) {
      EXPECT_GT(distance_m, 0.02f) << z;
    }
  }
}

TEST(Integrate, BehindTheSurfaceNothingIsKnown) {
  RegisteredFrame frame(test::small_camera());
  frame.measure([](double, double) { return 1.5; });
  FusedMap sut;
  sut.fuse(frame.at({}, 1));
  const Reader reader(sut.map());
  float distance_m = 0;
  EXPECT_TRUE(reader.distance({0, 0, 1.51f}, distance_m));
  EXPECT_LT(distance_m, 0);
  EXPECT_FALSE(reader.distance({0, 0, 1.56f}, distance_m));
}

TEST(Select, EverySurfaceBlockIsListedOnce) {
  auto renderer = test::renderer_of("synthetic:bedroom?mode=320x240&frames=60");
  FusedMap sut;
  for (std::uint32_t i = 0; i < 4; ++i) {
    RegisteredFrame frame(renderer.calibration().depth);
    frame.measure(renderer, static_cast<int>(i));
    sut.fuse(frame.at(renderer.pose(static_cast<int>(i)), i + 1));
    std::vector<BlockIndex> blocks(sut.active.blocks().begin(), sut.active.blocks().end());
    std::sort(blocks.begin(), blocks.end());
    EXPECT_EQ(std::adjacent_find(blocks.begin(), blocks.end()), blocks.end());
    EXPECT_LE(sut.active.surface_count(), blocks.size());
  }
}

// The map full, the session goes on: refused and counted.
TEST(Select, FullPoolIsSurvived) {
  auto renderer = test::renderer_of("synthetic:bedroom?mode=320x240&frames=60");
  RegisteredFrame frame(renderer.calibration().depth);
  frame.measure(renderer, 0);
  FusedMap sut(200);
  for (std::uint32_t index = 1; index <= 3; ++index) sut.fuse(frame.at(renderer.pose(0), index));
  EXPECT_EQ(sut.map().blocks_used(), 200U);
  EXPECT_GT(sut.map().counters().refused, 0U);
}

}  // namespace
}  // namespace tactus::map
