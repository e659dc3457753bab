#include "pipeline/register/panes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "pipeline/register/depth_images.hpp"
#include "tests/rt/aligned_memory.hpp"

namespace tactus {
namespace {

hal::Intrinsics camera() { return {320, 240, 262.5, 262.5, 159.5, 119.5}; }

// A depth image by a formula: z in metres at a ray, 0 where nothing comes back.
struct Shot {
  explicit Shot(const std::function<double(double x, double y)>& z_at, const hal::Intrinsics& c = camera(),
                std::uint32_t noise_seed = 0)
      : full(c), memory(PaneFiller::bytes_needed(c)) {
    rt::Slice slice = memory.slice();
    filler.bind(slice, c);
    std::mt19937 random(noise_seed);
    std::normal_distribution<double> normal;
    for (int v = 0; v < c.height; ++v)
      for (int u = 0; u < c.width; ++u) {
        double z = z_at((u - c.cx) / c.fx, (v - c.cy) / c.fy);
        if (noise_seed != 0 && z > 0) z += normal(random) * static_cast<double>(depth_sigma_m(static_cast<float>(z)));
        depth.push_back(static_cast<std::uint16_t>(std::nearbyint(z * 8000)));
      }
    measured = depth;
    half_m.resize(depth.size() / 4);
    half_depth(depth, c.width, c.height, half_m);
    closed_half_m = filler.fill(depth, half_m);
  }

  [[nodiscard]] std::size_t pane_count() const {
    std::size_t count = 0;
    for (const std::uint64_t word : filler.pane_bits()) count += static_cast<std::size_t>(std::popcount(word));
    return count;
  }
  [[nodiscard]] bool is_pane(std::size_t half_pixel) const { return tactus::is_pane(filler.pane_bits(), half_pixel); }

  hal::Intrinsics full;
  test::AlignedMemory memory;
  PaneFiller filler;
  std::vector<std::uint16_t> depth, measured;
  std::vector<float> half_m;
  std::span<const float> closed_half_m;
};

// z of the plane n . p = d on a ray.
double plane_z(double nx, double ny, double nz, double d, double x, double y) { return d / (nx * x + ny * y + nz); }

// A cupboard's front, turned to the camera at a slant, with a mirror in its middle.
double slanted_front(double x, double y) { return plane_z(0.5, 0.1, 0.86, 1.5, x, y); }
bool in_mirror(double x, double y) { return std::fabs(x) < 0.2 && std::fabs(y) < 0.3; }

TEST(PaneFiller, MirrorInAFrontGetsTheFrontsPlane) {
  for (const std::uint32_t seed : {0u, 1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    const Shot sut([](double x, double y) { return in_mirror(x, y) ? 0.0 : slanted_front(x, y); }, camera(), seed);
    ASSERT_EQ(sut.filler.panes_count(), 1);
    const double tolerance_m = seed == 0 ? 0.001 : 0.004;  // rays of tiles at the edge; sigma at the border is 3 mm, over 200 tiles
    double worst_m = 0;
    for (int v = 0; v < sut.full.height; ++v)
      for (int u = 0; u < sut.full.width; ++u) {
        const auto pixel = static_cast<std::size_t>(v * sut.full.width + u);
        const double x = (u - sut.full.cx) / sut.full.fx, y = (v - sut.full.cy) / sut.full.fy;
        if (sut.measured[pixel] != 0) {
          ASSERT_EQ(sut.depth[pixel], sut.measured[pixel]) << "a measured pixel was changed";
        } else {
          // A pixel whose 2x2 group was measured in part stays as it is.
          const auto half_pixel = static_cast<std::size_t>(v / 2 * sut.full.width / 2 + u / 2);
          if (!sut.is_pane(half_pixel)) continue;
          worst_m = std::max(worst_m, std::fabs(sut.depth[pixel] / 8000.0 - slanted_front(x, y)));
          ASSERT_GT(sut.closed_half_m[half_pixel], 0);
        }
      }
    EXPECT_LT(worst_m, tolerance_m);
    const auto holes = static_cast<std::size_t>(std::count(sut.measured.begin(), sut.measured.end(), 0));
    EXPECT_GT(sut.pane_count() * 4, holes * 95 / 100);
  }
}

TEST(PaneFiller, NothingToCloseGivesTheImageItself) {
  const Shot sut([](double x, double y) { return slanted_front(x, y); });
  EXPECT_EQ(sut.filler.panes_count(), 0);
  EXPECT_EQ(sut.closed_half_m.data(), sut.half_m.data());
  EXPECT_EQ(sut.depth, sut.measured);
}

TEST(PaneFiller, ClearForgetsThePanes) {
  Shot sut([](double x, double y) { return in_mirror(x, y) ? 0.0 : slanted_front(x, y); });
  ASSERT_GT(sut.pane_count(), 0U);
  sut.filler.clear();
  EXPECT_EQ(sut.pane_count(), 0U);
  EXPECT_EQ(sut.filler.panes_count(), 0);
}

TEST(PaneFiller, ShadowBesideANearThingStaysOpen) {
  // A box 0.9 m away before a wall at 2 m; its shadow is as wide as a projector 7.5 cm beside makes it, and wider.
  for (const double width : {0.05, 0.1, 0.2}) {
    SCOPED_TRACE(width);
    const Shot sut([&](double x, double y) {
      if (std::fabs(y) > 0.3) return 2.0;
      if (x < -0.1) return 0.9;
      return x < -0.1 + width ? 0.0 : 2.0;
    });
    EXPECT_EQ(sut.filler.panes_count(), 0);
  }
}

TEST(PaneFiller, OpeningThroughWhichSomethingIsSeenStaysOpen) {
  // A door: wall at 1.5 m, beyond it the floor and, out of range, nothing.
  const Shot sut([](double x, double y) {
    if (!(std::fabs(x) < 0.25 && y > -0.4)) return 1.5;
    return y > 0.1 ? 0.9 / y * 0.5 + 1.4 : 0.0;
  });
  EXPECT_EQ(sut.filler.panes_count(), 0);
}

TEST(PaneFiller, WorktopBesideAFrontStaysOpen) {
  // Only one side of the hole has a border in the plane (7-Scenes kitchen, frame 71).
  const Shot sut([](double, double y) { return y < -0.3 ? 0.0 : 1.5; });
  EXPECT_EQ(sut.filler.panes_count(), 0);
}

TEST(PaneFiller, MirrorCutOffByThePicturesEdgeIsClosedWhileMostOfItShows) {
  const Shot most([](double x, double y) { return std::fabs(x + 0.5) < 0.25 && std::fabs(y) < 0.2 ? 0.0 : 1.5; });
  EXPECT_EQ(most.filler.panes_count(), 1);
  const Shot corner([](double x, double y) { return x < -0.3 && y < -0.2 ? 0.0 : 1.5; });
  EXPECT_EQ(corner.filler.panes_count(), 0);
}

TEST(PaneFiller, FarAndSlantedSurfacesAreLeftAlone) {
  const Shot far([](double x, double y) { return in_mirror(x, y) ? 0.0 : 4.7; });
  EXPECT_EQ(far.filler.panes_count(), 0);
  const Shot floor([](double x, double y) {
    const double z = plane_z(0, 1, 0.02, 0.35, x, y);
    return y < 0.1 || (std::fabs(x) < 0.2 && y < 0.3) ? 0.0 : z;
  });
  EXPECT_EQ(floor.filler.panes_count(), 0);
}

TEST(PaneFiller, FourPanesInOneFrontAreFour) {
  const Shot sut([](double x, double y) {
    return std::fabs(std::fabs(x) - 0.25) < 0.15 && std::fabs(std::fabs(y) - 0.2) < 0.12 ? 0.0 : 1.5;
  });
  EXPECT_EQ(sut.filler.panes_count(), 4);
}

TEST(PaneFiller, AnyImageIsSurvivedAndMeasurementsAreKept) {
  for (std::uint32_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    const double blob = 0.02 + 0.3 * uniform(random), share = uniform(random);
    std::vector<double> z_of_cell(4096);
    for (double& z : z_of_cell) z = uniform(random) < share ? 0.0 : 0.3 + 7.8 * uniform(random);
    const Shot sut([&](double x, double y) {
      const auto column = static_cast<std::size_t>((x + 1) / blob), row = static_cast<std::size_t>((y + 1) / blob);
      return z_of_cell[(row * 61 + column) % z_of_cell.size()];
    });
    for (std::size_t i = 0; i < sut.depth.size(); ++i)
      ASSERT_TRUE(sut.measured[i] == 0 || sut.depth[i] == sut.measured[i]);
    for (std::size_t i = 0; i < sut.half_m.size(); ++i) {
      if (sut.is_pane(i)) {
        ASSERT_GT(sut.closed_half_m[i], 0.0f);
        ASSERT_LT(sut.closed_half_m[i], 4.6f);
      } else {
        ASSERT_EQ(sut.closed_half_m[i], sut.half_m[i]);
      }
    }
  }
}

TEST(PaneFiller, ReturnsInsideAPaneBelongToItAndThoseBehindForbidIt) {
  // A tile in eight comes back, as glass does it at times.
  const auto with_strays = [](double stray_z) {
    return [=](double x, double y) {
      if (!in_mirror(x, y)) return 1.5;
      const auto column = static_cast<int>(std::nearbyint(x * 262.5 + 159.5)) / 4,
                 row = static_cast<int>(std::nearbyint(y * 262.5 + 119.5)) / 4;
      return (column * 3 + row) % 8 == 0 ? stray_z : 0.0;
    };
  };
  const Shot pane(with_strays(1.5));
  EXPECT_EQ(pane.filler.panes_count(), 1);
  EXPECT_GT(pane.pane_count(), 52u * 78u * 95u / 100u) << "returns inside are of the pane, too";
  const Shot set_back(with_strays(1.512));
  ASSERT_EQ(set_back.filler.panes_count(), 1);
  for (std::size_t i = 0; i < set_back.half_m.size(); ++i) {
    if (set_back.is_pane(i)) { EXPECT_NEAR(set_back.closed_half_m[i], 1.512f, 0.0005f) << "the pane's own, not its frame's"; }
  }
  const Shot opening(with_strays(2.5));
  EXPECT_EQ(opening.filler.panes_count(), 0);
}

// The made rooms know what is there: a wardrobe's mirror, and windows of which one wing is shut and one stands open, with
// nothing within range behind it.
TEST(PaneFiller, InTheRoomsMirrorsAndShutWindowsAreClosedAndOpenOnesStayOpen) {
  std::size_t right = 0, wrong = 0, holes = 0;  // half-resolution pixels
  for (const char* name : {"synthetic:bedroom", "synthetic:office"}) {
    const auto options = hal::parse_synthetic_name(name);
    ASSERT_TRUE(options.has_value());
    hal::synthetic::FrameRenderer renderer(
        std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options->scene)), *options);
    const hal::Intrinsics& full = renderer.calibration().depth;
    test::AlignedMemory memory(PaneFiller::bytes_needed(full));
    rt::Slice slice = memory.slice();
    PaneFiller filler;
    filler.bind(slice, full);
    const auto n = static_cast<std::size_t>(full.width * full.height), width = static_cast<std::size_t>(full.width);
    std::vector<std::uint16_t> raw(n), depth(n);
    std::vector<float> exact_m(n), half_m(n / 4);
    std::vector<std::uint8_t> material(n);
    for (int frame = 0; frame < options->frames_count; frame += 15) {
      renderer.depth(frame, raw);
      renderer.exact_depth(frame, exact_m);
      renderer.labels(frame, material);
      normalize_depth(raw, hal::synthetic::kDepth_m_per_unit, 5.0f, depth);
      half_depth(depth, full.width, full.height, half_m);
      const auto closed = filler.fill(depth, half_m);
      for (std::size_t i = 0; i < closed.size(); ++i) {
        const std::size_t pixel = i / (width / 2) * 2 * width + i % (width / 2) * 2;
        const bool is_pane = material[pixel] == 6 || material[pixel] == 10;  // glass, mirror
        if (half_m[i] > 0) continue;
        holes += is_pane;
        if (!tactus::is_pane(filler.pane_bits(), i)) continue;
        (std::fabs(closed[i] - exact_m[pixel]) < 0.03f ? right : wrong) += 1;
      }
    }
  }
  std::printf("%zu pixels of glass and mirrors without depth; closed %zu at the true surface, %zu elsewhere\n", holes, right,
              wrong);
  EXPECT_GT(right, holes * 8 / 10);
  EXPECT_LT(wrong, right / 50);
}

}  // namespace
}  // namespace tactus
