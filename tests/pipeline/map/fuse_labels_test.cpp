#include "pipeline/map/fuse_labels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "pipeline/register/half_color.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map::test {
namespace {

// A corner of a room: a wooden wall at z = 1.5 and a carpet at y = 0.4 (the first camera's axes are the
// world's).
constexpr double kWallZ = 1.5, kFloorY = 0.4;
constexpr MaterialId kWood = 22, kCarpet = 1;

double corner_distance(const Vec3d& p) { return std::min(kWallZ - p.z, kFloorY - p.y); }
MaterialId material_at(const Vec3d& p) { return kWallZ - p.z < kFloorY - p.y ? kWood : kCarpet; }

// Where a ray from `origin` meets the corner; the distance along it in units of `direction`.
double hit_corner(const Vec3d& origin, const Vec3d& direction) {
  double t = 1e9;
  if (direction.z > 0) t = std::min(t, (kWallZ - origin.z) / direction.z);
  if (direction.y > 0) t = std::min(t, (kFloorY - origin.y) / direction.y);
  return t;
}

Rotation turned(double right_rad, double down_rad) {
  const Quaternion yaw{std::cos(right_rad / 2), 0, std::sin(right_rad / 2), 0};
  const Quaternion pitch{std::cos(down_rad / 2), -std::sin(down_rad / 2), 0, 0};
  return Rotation::from(yaw * pitch);
}

// Owns the images of one keyframe.
struct Shot {
  std::vector<float> half_depth_m;
  std::vector<std::uint8_t> probability;
  LabelKeyframe keyframe;
};

constexpr int kScoreWidth = 128, kScoreHeight = 96;

hal::RigCalibration registered_rig() {
  hal::RigCalibration rig;
  rig.has_color = rig.registered = true;
  rig.depth.width = 320;
  rig.depth.height = 240;
  rig.depth.fx = rig.depth.fy = 260;
  rig.depth.cx = 159.5;
  rig.depth.cy = 119.5;
  rig.color = rig.depth;
  return rig;
}

hal::RigCalibration two_camera_rig() {
  hal::RigCalibration rig = registered_rig();
  rig.registered = false;
  rig.color.width = 640;
  rig.color.height = 480;
  rig.color.fx = rig.color.fy = 420;
  rig.color.cx = 330;
  rig.color.cy = 235;
  rig.color.k1 = 0.12;
  rig.color.k2 = -0.2;
  rig.color.p1 = 0.002;
  rig.color.p2 = -0.001;
  rig.T_color_depth = {turned(0.02, -0.01), {-0.02, -0.08, 0.005}};
  return rig;
}

// What a network would say of the colour image: the true material per score pixel (0.7, the rest spread), and
// with `wrong_share` something else.
Shot shoot(const T_WorldDepth& T_world_depth, const hal::RigCalibration& rig, std::uint32_t index,
           double wrong_share = 0, std::uint32_t seed = 0) {
  Shot shot;
  std::mt19937 random(seed * 1000 + index);
  hal::Intrinsics half = rig.depth;
  half.width /= 2;
  half.height /= 2;
  half.fx /= 2;
  half.fy /= 2;
  half.cx = (rig.depth.cx - 0.5) / 2;
  half.cy = (rig.depth.cy - 0.5) / 2;
  for (int v = 0; v < half.height; ++v)
    for (int u = 0; u < half.width; ++u) {
      const Vec3d ray{(u - half.cx) / half.fx, (v - half.cy) / half.fy, 1};
      shot.half_depth_m.push_back(
          static_cast<float>(hit_corner(T_world_depth.translation, T_world_depth.rotation * ray)));
    }
  const hal::Intrinsics& color = rig.registered ? rig.depth : rig.color;
  const auto T_depth_color = rig.registered ? T_DepthColor{} : rig.T_color_depth.inverse();
  const auto T_world_color = T_world_depth * T_depth_color;
  const double scale_u = static_cast<double>(kScoreWidth) / color.width,
               scale_v = static_cast<double>(kScoreHeight) / color.height;
  for (int y = 0; y < kScoreHeight; ++y)
    for (int x = 0; x < kScoreWidth; ++x) {
      const double u = (x + 0.5) / scale_u - 0.5, v = (y + 0.5) / scale_v - 0.5;
      const Normalized lens{static_cast<float>((u - color.cx) / color.fx),
                            static_cast<float>((v - color.cy) / color.fy)};
      const Normalized ideal = undistort(color, lens);
      const Vec3d direction = T_world_color.rotation * Vec3d{double{ideal.x}, double{ideal.y}, 1};
      const Vec3d p =
          T_world_color.translation + direction * hit_corner(T_world_color.translation, direction);
      MaterialId said = material_at(p);
      if (std::uniform_real_distribution<double>(0, 1)(random) < wrong_share)
        said = static_cast<MaterialId>(std::uniform_int_distribution(0, kMaterialCount - 1)(random));
      for (int m = 0; m < kMaterialCount; ++m)
        shot.probability.push_back(m == said ? std::uint8_t{178} : std::uint8_t{3});
    }
  shot.keyframe.T_world_depth = T_world_depth;
  shot.keyframe.half_camera = half;
  shot.keyframe.half_depth_m = shot.half_depth_m;
  shot.keyframe.rig = rig;
  shot.keyframe.scores = {shot.probability.data(),
                          kScoreWidth,
                          kScoreHeight,
                          static_cast<float>(scale_u),
                          static_cast<float>(0.5 * scale_u - 0.5),
                          static_cast<float>(scale_v),
                          static_cast<float>(0.5 * scale_v - 0.5)};
  shot.keyframe.index = index;
  return shot;
}

class FuseLabels : public ::testing::Test {
 protected:
  FuseLabels() : owned_({0.01f, 0.04f, 4096}) {
    fill(owned_.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
    live_blocks(owned_.map, blocks_);
  }
  // Cells with a label: how many, and how many of them right, without those nearer to the crease than
  // `edge_m`.
  struct Count {
    std::size_t labelled = 0, right = 0;
    [[nodiscard]] double share() const { return static_cast<double>(right) / static_cast<double>(labelled); }
  };
  void for_each_cell(const std::function<void(const Vec3d&, LabelWord)>& visit) const {
    for (const BlockIndex block : blocks_) {
      if (sut_.key(block) == kNoKey) continue;
      const BlockCoord c = coord_of(sut_.key(block));
      for (int cell = 0; cell < kBlockCells; ++cell)
        visit({(c.x * 8 + 2 * (cell & 3) + 0.5) * 0.01, (c.y * 8 + 2 * (cell >> 2 & 3) + 0.5) * 0.01,
               (c.z * 8 + 2 * (cell >> 4) + 0.5) * 0.01},
              sut_.labels(block)[static_cast<std::size_t>(cell)]);
    }
  }
  [[nodiscard]] Count count(double edge_m) const {
    Count result;
    for_each_cell([&](const Vec3d& p, LabelWord word) {
      if (word == 0 || std::fabs((kWallZ - p.z) - (kFloorY - p.y)) < edge_m) return;
      ++result.labelled;
      result.right += label::best(word) == material_at(p);
    });
    return result;
  }

  OwnedMap owned_;
  Map& sut_ = owned_.map;
  std::vector<BlockIndex> blocks_;
};

T_WorldDepth pose(int k) {
  return {turned(0.02 * (k % 5 - 2), 0.15 + 0.01 * (k % 3)), {0.03 * (k % 4), -0.02 * (k % 3), 0.01 * k}};
}

TEST_F(FuseLabels, TenKeyframesWithOneWrongLabelInFiveAreRight) {
  constexpr std::uint32_t kSeed = 11;
  Count first;
  for (int k = 0; k < 10; ++k) {
    const Shot shot = shoot(pose(k), registered_rig(), static_cast<std::uint32_t>(12 * k + 1), 0.2, kSeed);
    const FuseLabelsResult result = fuse_labels(sut_, shot.keyframe, blocks_);
    EXPECT_EQ(result.blocks_done, blocks_.size());
    EXPECT_GT(result.cells_fused, 3000u);
    if (k == 0) first = count(0.04);
  }
  const Count last = count(0.04);
  std::printf("seed %u: %zu cells, %.2f %% right after 1 keyframe, %.3f %% after 10\n", kSeed, last.labelled,
              100 * first.share(), 100 * last.share());
  EXPECT_LT(first.share(), 0.9) << "the noise is as strong as said";
  EXPECT_GE(last.share(), 0.99);
}

TEST_F(FuseLabels, SurfaceInViewIsLabelledAndOnlySurface) {
  const Shot shot = shoot(pose(0), registered_rig(), 1);
  (void)fuse_labels(sut_, shot.keyframe, blocks_);
  std::size_t in_view = 0, labelled = 0;
  for_each_cell([&](const Vec3d& p, LabelWord word) {
    EXPECT_TRUE(word == 0 ||
                std::fabs(corner_distance(p)) < 0.02);  // a voxel, and from there to the cell's centre
    if (std::fabs(corner_distance(p)) > 0.008 || std::fabs(p.x) > 0.25 || p.y < -0.1) return;
    ++in_view;
    labelled += word != 0;
    EXPECT_LE(label::observations(word), 1u);
  });
  EXPECT_GT(in_view, 500u);
  EXPECT_EQ(labelled, in_view);
}

TEST_F(FuseLabels, CellsOutOfViewOrHiddenStayZero) {
  Shot shot = shoot(pose(0), registered_rig(), 1);
  const int width = shot.keyframe.half_camera.width;
  for (std::size_t i = 0; i < shot.half_depth_m.size(); ++i)  // something stands in front of the left half
    if (static_cast<int>(i) % width < width / 2) shot.half_depth_m[i] = 0.8f;
  (void)fuse_labels(sut_, shot.keyframe, blocks_);
  std::size_t left = 0, right = 0;
  const auto T_depth_world = shot.keyframe.T_world_depth.inverse();
  for_each_cell([&](const Vec3d& p, LabelWord word) {
    const Vec3d q = T_depth_world * p;
    const double u = 130 * q.x / q.z + 79.5, v = 130 * q.y / q.z + 59.5;
    const bool is_outside = u < -2 || v < -2 || u > 161 || v > 121;
    EXPECT_TRUE(!is_outside || word == 0);
    (u < 78 ? left : right) += word != 0;
  });
  EXPECT_EQ(left, 0u);
  EXPECT_GT(right, 1000u);
}

TEST_F(FuseLabels, MissingDepthAndUnwrittenScoresLabelNothing) {
  Shot blind = shoot(pose(0), registered_rig(), 1), silent = blind;
  std::fill(blind.half_depth_m.begin(), blind.half_depth_m.end(), 0.0f);
  blind.keyframe.half_depth_m = blind.half_depth_m;
  EXPECT_EQ(fuse_labels(sut_, blind.keyframe, blocks_).cells_fused, 0u);
  std::fill(silent.probability.begin(), silent.probability.end(), std::uint8_t{0});
  silent.keyframe.half_depth_m = silent.half_depth_m;
  silent.keyframe.scores.probability = silent.probability.data();
  EXPECT_EQ(fuse_labels(sut_, silent.keyframe, blocks_).cells_fused, 0u);
  EXPECT_EQ(sut_.label_frame_concurrent(blocks_[0]), 0u);
}

TEST_F(FuseLabels, FlatLinesOfSightAreSkipped) {
  // 6 cm above the floor, looking along it: at 0.9 m the line of sight is 4 degrees flat, a cosine of 0.07.
  const Shot shot = shoot({turned(0, 0.05), {0, kFloorY - 0.06, 0}}, registered_rig(), 1);
  (void)fuse_labels(sut_, shot.keyframe, blocks_);
  std::size_t wall = 0;
  for_each_cell([&](const Vec3d& p, LabelWord word) {
    EXPECT_TRUE(kWallZ - p.z <= 0.06 || word == 0) << "floor at z " << p.z;
    wall += word != 0;
  });
  EXPECT_GT(wall, 500u);
}

TEST_F(FuseLabels, KeyframesPoseCountsWhenTheCameraMovedMeanwhile) {
  // The network took its time: the head turned by 20 degrees and moved 30 cm. With the pose of today the
  // scores would land elsewhere; the reference map shows how wrong that is.
  const T_WorldDepth at_keyframe = pose(0), today{turned(0.1, 0.5), {-0.1, -0.25, 0.1}};
  Shot shot = shoot(at_keyframe, registered_rig(), 1);
  (void)fuse_labels(sut_, shot.keyframe, blocks_);
  const Count count_keyframe = count(0.03);
  EXPECT_GE(count_keyframe.share(), 0.999);

  // Today's depth image with today's pose passes every visibility test; only the scores are old.
  OwnedMap wrong({0.01f, 0.04f, 4096});
  fill(wrong.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  Shot mixed = shoot(today, registered_rig(), 1);
  mixed.keyframe.scores.probability = shot.probability.data();
  (void)fuse_labels(wrong.map, mixed.keyframe, blocks_);
  std::size_t differ = 0, both = 0;
  for (const BlockIndex block : blocks_)
    for (std::size_t cell = 0; cell < kBlockCells; ++cell) {
      const LabelWord a = sut_.labels(block)[cell], b = wrong.map.labels(block)[cell];
      if (a == 0 || b == 0) continue;
      ++both;
      differ += label::best(a) != label::best(b);
    }
  EXPECT_GT(both, 1000u);
  EXPECT_GT(static_cast<double>(differ) / static_cast<double>(both), 0.1);
}

TEST_F(FuseLabels, SecondCameraIsReachedThroughItsPoseAndLens) {
  const hal::RigCalibration rig = two_camera_rig();
  for (int k = 0; k < 3; ++k) {
    const Shot shot = shoot(pose(k), rig, static_cast<std::uint32_t>(k + 1));
    (void)fuse_labels(sut_, shot.keyframe, blocks_);
  }
  const Count through_lens = count(0.02);
  EXPECT_GT(through_lens.labelled, 3000u);
  EXPECT_GE(through_lens.share(), 0.999);

  // Taken as registered the border lands 2 to 10 cm away.
  OwnedMap other({0.01f, 0.04f, 4096});
  fill(other.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  Shot shot = shoot(pose(0), rig, 1);
  shot.keyframe.rig.color.k1 = shot.keyframe.rig.color.k2 = 0;
  shot.keyframe.rig.T_color_depth = {};
  (void)fuse_labels(other.map, shot.keyframe, blocks_);
  std::size_t labelled = 0, right = 0;
  for (const BlockIndex block : blocks_) {
    const BlockCoord c = coord_of(other.map.key(block));
    for (int cell = 0; cell < kBlockCells; ++cell) {
      const LabelWord word = other.map.labels(block)[static_cast<std::size_t>(cell)];
      const Vec3d p{(c.x * 8 + 2 * (cell & 3) + 0.5) * 0.01, (c.y * 8 + 2 * (cell >> 2 & 3) + 0.5) * 0.01,
                    (c.z * 8 + 2 * (cell >> 4) + 0.5) * 0.01};
      if (word == 0 || std::fabs((kWallZ - p.z) - (kFloorY - p.y)) < 0.02) continue;
      ++labelled;
      right += label::best(word) == material_at(p);
    }
  }
  EXPECT_LT(static_cast<double>(right) / static_cast<double>(labelled), 0.99);
}

TEST_F(FuseLabels, SurfaceHiddenFromTheColorCameraIsLeftOut) {
  Shot shot = shoot(pose(0), two_camera_rig(), 1);
  std::vector<std::uint32_t> color_pixels(shot.half_depth_m.size(), kNoColorPixel);
  shot.keyframe.color_pixels = color_pixels;
  EXPECT_EQ(fuse_labels(sut_, shot.keyframe, blocks_).cells_fused, 0u);
  std::fill(color_pixels.begin(), color_pixels.end(), 0u);
  EXPECT_GT(fuse_labels(sut_, shot.keyframe, blocks_).cells_fused, 1000u);
}

TEST_F(FuseLabels, EvictedBlockIsSkipped) {
  const Shot shot = shoot(pose(0), registered_rig(), 1);
  const BlockIndex gone = sut_.find(key_of({0, 0, 18}));  // z 1.44 .. 1.51, in the middle of the view
  ASSERT_NE(gone, kNoBlock);
  sut_.evict(gone);
  const std::uint32_t sequence = sut_.sequence_begin(gone);
  const FuseLabelsResult result = fuse_labels(sut_, shot.keyframe, blocks_);
  EXPECT_EQ(result.blocks_done, blocks_.size());
  EXPECT_GT(result.cells_fused, 1000u);
  EXPECT_EQ(sut_.sequence_begin(gone), sequence) << "nothing was written";
}

TEST_F(FuseLabels, PartsOfTheListGiveTheSameMapAsTheWhole) {
  OwnedMap other({0.01f, 0.04f, 4096});
  fill(other.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  const Shot shot = shoot(pose(0), registered_rig(), 1, 0.2);
  const FuseLabelsResult whole = fuse_labels(sut_, shot.keyframe, blocks_);
  std::span<const BlockIndex> left = blocks_;
  std::size_t calls = 0, cells = 0;
  while (!left.empty()) {
    const FuseLabelsResult part = fuse_labels(other.map, shot.keyframe, left, LabelRule::bayes, 500);
    EXPECT_GT(part.blocks_done, 0u);
    EXPECT_LT(part.cells_fused, 500u + kBlockCells);
    left = left.subspan(part.blocks_done);
    cells += part.cells_fused;
    ++calls;
  }
  EXPECT_GT(calls, 5u);
  EXPECT_EQ(cells, whole.cells_fused);
  EXPECT_EQ(other.map.hash_content().labels, sut_.hash_content().labels);
}

TEST_F(FuseLabels, BlocksInKeyframeHoldEveryCellThatItLabels) {
  OwnedMap other({0.01f, 0.04f, 4096});
  fill(other.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  const Shot shot = shoot({turned(0.4, 0.1), {0.1, 0, 0.2}}, registered_rig(), 1);
  const FuseLabelsResult all = fuse_labels(sut_, shot.keyframe, blocks_);
  std::vector<BlockIndex> seen(blocks_.size());
  seen.resize(blocks_in_keyframe(other.map, shot.keyframe, seen));
  EXPECT_LT(seen.size(), blocks_.size()) << "part of the corner is out of view";
  EXPECT_EQ(fuse_labels(other.map, shot.keyframe, seen).cells_fused, all.cells_fused);
  EXPECT_EQ(other.map.hash_content().labels, sut_.hash_content().labels);
  std::array<BlockIndex, 3> few{};
  EXPECT_EQ(blocks_in_keyframe(sut_, shot.keyframe, few), 3u);
}

TEST_F(FuseLabels, PixelsClosedAsAPaneCarryItsEvidenceAndTheOthersNone) {
  Shot shot = shoot(pose(0), registered_rig(), 1);
  std::vector<std::uint64_t> pane_bits(shot.half_depth_m.size() / 64);
  for (std::size_t i = 0; i < shot.half_depth_m.size(); ++i)
    if (i % 160 < 80) pane_bits[i / 64] |= std::uint64_t{1} << (i % 64);  // the left half
  OwnedMap without({0.01f, 0.04f, 4096});
  fill(without.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  (void)fuse_labels(without.map, shot.keyframe, blocks_);
  shot.keyframe.pane_bits = pane_bits;
  (void)fuse_labels(sut_, shot.keyframe, blocks_);
  std::size_t panes = 0, others = 0;
  for (const BlockIndex block : blocks_)
    for (std::size_t cell = 0; cell < static_cast<std::size_t>(kBlockCells); ++cell) {
      const LabelWord word = sut_.labels(block)[cell];
      ASSERT_EQ(word == 0, without.map.labels(block)[cell] == 0);
      if (word == 0) continue;
      if (word == without.map.labels(block)[cell]) {
        ++others;
      } else {
        EXPECT_EQ(label::best(word), material_from_name("mirror"));
        ++panes;
      }
    }
  EXPECT_GT(panes, 1000u);
  EXPECT_GT(others, 1000u);
}

TEST_F(FuseLabels, DirectMappingKeepsTheNewestOnly) {
  const Shot right = shoot(pose(0), registered_rig(), 1);
  Shot wrong = right;
  for (std::size_t i = 0; i < wrong.probability.size(); i += kMaterialCount) {
    std::fill_n(&wrong.probability[i], kMaterialCount, std::uint8_t{3});
    wrong.probability[i + 9] = 178;
  }
  wrong.keyframe.scores.probability = wrong.probability.data();
  wrong.keyframe.half_depth_m = wrong.half_depth_m;
  OwnedMap bayes({0.01f, 0.04f, 4096});
  fill(bayes.map, {-0.5, -0.3, 1.0}, {0.5, 0.45, 1.55}, corner_distance);
  for (const Shot* shot : {&right, &right, static_cast<const Shot*>(&wrong)}) {
    (void)fuse_labels(sut_, shot->keyframe, blocks_, LabelRule::direct);
    (void)fuse_labels(bayes.map, shot->keyframe, blocks_, LabelRule::bayes);
  }
  for_each_cell([&](const Vec3d&, LabelWord word) { EXPECT_TRUE(word == 0 || label::best(word) == 9); });
  for (const BlockIndex block : blocks_)
    for (const LabelWord word : bayes.map.labels(block)) EXPECT_NE(label::best(word), 9);
}

}  // namespace
}  // namespace tactus::map::test
