// The reader, an octree and an even march must find the same surfaces.
#include "tests/bench/query_peers.hpp"

#include <gtest/gtest.h>

#include <random>

#include "pipeline/label/label_cell.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::bench {
namespace {

using map::kNoBlock;
using map::kNoKey;

/// A room of 3 m with a sphere in it, labelled cell by cell.
class Room : public testing::Test {
 protected:
  Room() {
    map::test::fill(map, {-0.1, -0.1, -0.1}, {3.1, 3.1, 3.1}, [](const Vec3d& p) {
      const double walls = std::min({p.x, p.y, p.z, 3 - p.x, 3 - p.y, 3 - p.z});
      return std::min(walls, (p - Vec3d{1.2, 0.8, 1.7}).norm() - 0.5);
    });
    std::vector<map::BlockIndex> blocks;
    map::test::live_blocks(map, blocks);
    for (const map::BlockIndex block : blocks) {
      std::array<map::LabelWord, map::kBlockCells> words;
      for (std::size_t c = 0; c < words.size(); ++c) {
        MaterialDistribution p{};
        p.fill(0.01F);
        p[random() % kMaterialCount] = 1;
        words[c] = label::encode(p, 3);
      }
      map.publish_labels(block, words, 1);
    }
  }
  Vec3f direction() {
    Vec3f d;
    do d = {uniform(random), uniform(random), uniform(random)};
    while (!(d.norm() > 0.1F && d.norm() < 1));
    return d.normalized();
  }

  map::test::OwnedMap owned{{0.01F, 0.04F, 32768}};
  map::Map& map = owned.map;
  std::mt19937 random{7};
  std::uniform_real_distribution<float> uniform{-1, 1};
};

TEST_F(Room, RaysAndPointsFindTheSameSurfacesAndLabelsByAllThreeWays) {
  const map::Reader reader(map);
  const BlockOctree octree(map);
  int hits = 0, labels_differ = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3f from{2.2F + 0.6F * uniform(random), 1.5F + uniform(random), 0.8F + 0.6F * uniform(random)};
    const Vec3f d = direction();
    map::SurfacePoint ours;
    PeerHit by_octree, by_march;
    ASSERT_TRUE(reader.raycast(from, d, 6, ours)) << i;
    ASSERT_TRUE(raycast_octree(map, octree, from, d, 6, by_octree)) << i;
    ASSERT_TRUE(raycast_march(map, from, d, 6, by_march)) << i;
    EXPECT_LT((by_octree.position_world_m - ours.position_world_m).norm(), 0.0005F) << i;
    EXPECT_LT((by_march.position_world_m - ours.position_world_m).norm(), 0.001F) << i;
    labels_differ += label::best(by_octree.label) != ours.material;
    ++hits;

    const Vec3f p = ours.position_world_m + ours.normal_world * (0.015F * uniform(random));
    map::SurfacePoint nearest;
    PeerHit nearest_by_octree;
    ASSERT_EQ(reader.nearest_surface(p, nearest), nearest_octree(map, octree, p, nearest_by_octree)) << i;
    EXPECT_LT((nearest_by_octree.position_world_m - nearest.position_world_m).norm(), 1e-5F) << i;
  }
  // A hit on the border of two cells may fall to either.
  EXPECT_LT(labels_differ, hits / 50);
}

TEST_F(Room, OctreeFindsEveryBlockAndSaysHowLargeTheEmptinessIs) {
  const BlockOctree octree(map);
  int side = 0;
  for (std::uint32_t b = 0; b < map.config().blocks_capacity; ++b)
    if (const auto block = static_cast<map::BlockIndex>(b); map.key(block) != kNoKey) {
      EXPECT_EQ(octree.find(map::coord_of(map.key(block)), side), block);
    }
  for (int i = 0; i < 2000; ++i) {
    const auto random_block = [&] { return static_cast<int>(random() % 60) - 10; };
    const map::BlockCoord at{random_block(), random_block(), random_block()};
    if (octree.find(at, side) != kNoBlock) continue;
    const auto low = [&](int v) { return v & -side; };
    for (int k = 0; k < 20; ++k) {
      const auto inside = [&](int v) {
        return low(v) + static_cast<int>(random() % static_cast<unsigned>(side));
      };
      const map::BlockCoord other{inside(at.x), inside(at.y), inside(at.z)};
      EXPECT_EQ(map.find(map::key_of(other)), kNoBlock);
    }
  }
}

}  // namespace
}  // namespace tactus::bench
