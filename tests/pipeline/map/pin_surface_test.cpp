// Pinning connected surfaces of a corner whose cells are known in closed form.
#include "pipeline/map/pin_surface.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <functional>
#include <random>
#include <vector>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

using test::OwnedMap;

constexpr MaterialId kGlass = 6, kPainted = 12, kWallpaper = 20, kWood = 22;

/// Floor y = 0 of wood and wall x = 0, painted; its half z > 0.5 has wallpaper.
class Corner {
 public:
  Corner() : owned_({0.01F, 0.04F, 2048}), map(owned_.map) {
    test::fill(map, {-0.1, -0.1, -0.1}, {1, 1, 1}, [](const Vec3d& p) { return std::min(p.x, p.y); });
    bytes_ = rt::round_up(SurfacePinner::bytes_needed(map.config()), 64);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)));
    rt::Slice memory({memory_.get(), bytes_});
    sut.bind(memory, map);
    observe(1, [](const Vec3f& p) { return truth(p); });
  }

  static bool is_on_wall(const Vec3f& p) { return p.x < 0.015F && p.y > 0.03F; }
  static bool is_on_floor(const Vec3f& p) { return p.y < 0.015F && p.x > 0.03F; }
  static MaterialId truth(const Vec3f& p) { return p.x > p.y ? kWood : p.z > 0.5F ? kWallpaper : kPainted; }

  /// A keyframe that sees every cell.
  void observe(std::uint32_t frame, const std::function<MaterialId(const Vec3f&)>& said) {
    for (const SurfaceCell& cell : cells()) {
      const BlockIndex block = map.find(cell.address.key);
      std::array<LabelWord, kBlockCells> words;
      std::copy_n(map.labels(block).begin(), kBlockCells, words.begin());
      std::array<std::uint8_t, kMaterialCount> scores{};
      scores[said(cell.position_world_m)] = 250;
      words[cell.address.cell] = label::fuse(words[cell.address.cell], label::costs_of(scores));
      map.publish_labels(block, words, frame);
    }
    map.set_frame(frame);
  }

  [[nodiscard]] std::vector<SurfaceCell> cells() const {
    std::vector<SurfaceCell> out(count_surface_cells(map));
    (void)gather_surface_cells(map, out);
    return out;
  }
  [[nodiscard]] label::RefinedWord refined(const SurfaceCell& cell) const {
    return map.refined_concurrent(map.find(cell.address.key), static_cast<int>(cell.address.cell));
  }
  [[nodiscard]] bool is_pinned(const SurfaceCell& cell) const { return label::is_pinned(refined(cell)); }
  [[nodiscard]] SurfacePoint at(const Vec3f& p) const {
    SurfacePoint point;
    EXPECT_TRUE(Reader(map).nearest_surface(p, point));
    return point;
  }

  rt::Status pin(const SurfacePin& pin, std::size_t cells_a_step = 1000) {
    const rt::Status begun = sut.begin(pin);
    while (sut.step(cells_a_step) == rt::Status::ok) {
    }
    return begun;
  }

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  OwnedMap owned_;
  std::size_t bytes_ = 0;
  std::unique_ptr<std::byte, Free> memory_;

 public:
  Map& map;
  SurfacePinner sut;
};

const Vec3f kOnWall{0.004F, 0.4F, 0.2F};

TEST(PinSurface, EndsWhereReadersSeeAnotherMaterialAndAtTheCrease) {
  Corner room;
  ASSERT_EQ(room.pin({kOnWall, kGlass}), rt::Status::ok);
  std::size_t pinned = 0;
  for (const SurfaceCell& cell : room.cells()) {
    const Vec3f& p = cell.position_world_m;
    pinned += room.is_pinned(cell);
    if (Corner::is_on_wall(p) && p.z < 0.48F) {
      EXPECT_TRUE(room.is_pinned(cell)) << p.y << " " << p.z;
    }
    if (Corner::is_on_floor(p) || p.z > 0.52F) {
      EXPECT_FALSE(room.is_pinned(cell)) << p.x << " " << p.z;
    }
  }
  EXPECT_GT(pinned, 1000U);
  EXPECT_EQ(room.sut.counters().cells, pinned);
  EXPECT_EQ(room.sut.counters().pinned, 1U);
  EXPECT_EQ(room.sut.counters().cut_short, 0U);
  const SurfacePoint point = room.at(kOnWall);
  EXPECT_TRUE(point.is_pinned);
  EXPECT_EQ(point.material, kGlass);
  EXPECT_EQ(point.materials[kGlass], 1.0F);
  EXPECT_EQ(point.materials[kPainted], 0.0F);
  SurfacePoint as_observed;
  ASSERT_TRUE(Reader(room.map, LabelView::fused).nearest_surface(kOnWall, as_observed));
  EXPECT_EQ(as_observed.material, kPainted);
  EXPECT_FALSE(as_observed.is_pinned);
}

TEST(PinSurface, WithinADistanceTakesTheSurfaceWhateverItsLabels) {
  Corner room;
  const Vec3f seed{0, 0.5F, 0.5F};
  ASSERT_EQ(room.pin({seed, kGlass, 0.2F}), rt::Status::ok);
  for (const SurfaceCell& cell : room.cells()) {
    const float away = (cell.position_world_m - seed).norm();
    if (Corner::is_on_wall(cell.position_world_m) && away < 0.18F) {
      EXPECT_TRUE(room.is_pinned(cell)) << away;
    }
    if (away > 0.22F) {
      EXPECT_FALSE(room.is_pinned(cell)) << away;
    }
  }
}

TEST(PinSurface, SurvivesContradictionAndGivesBackWhatWasObserved) {
  Corner room, never_pinned;
  ASSERT_EQ(room.pin({kOnWall, kGlass}), rt::Status::ok);
  const std::uint64_t cells = room.sut.counters().cells;
  const auto everything_is_wood = [](const Vec3f&) { return kWood; };
  std::array<label::RefinedWord, kBlockCells> wood;
  MaterialDistribution distribution{};
  distribution[kWood] = 1;
  wood.fill(label::refined_word(distribution));
  for (std::uint32_t frame = 2; frame < 202; ++frame)
    for (Corner* both : {&room, &never_pinned}) both->observe(frame, everything_is_wood);
  for (const SurfaceCell& cell : room.cells()) {
    if (!room.is_pinned(cell)) continue;
    room.map.publish_refined(room.map.find(cell.address.key), wood);
    EXPECT_EQ(label::refined_best(room.refined(cell)), kGlass);
  }
  EXPECT_EQ(room.at(kOnWall).material, kGlass);
  EXPECT_EQ(room.at(kOnWall).label_age_frames, 0U);
  ASSERT_EQ(room.pin({kOnWall, kUnknownMaterial}), rt::Status::ok);
  EXPECT_EQ(room.sut.counters().cells, 2 * cells) << "as many given back as pinned";
  for (const SurfaceCell& cell : room.cells()) EXPECT_FALSE(room.is_pinned(cell));
  EXPECT_EQ(room.at(kOnWall).material, kWood);
  const auto a = room.cells(), b = never_pinned.cells();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].word, b[i].word) << "observations went on below";
}

TEST(PinSurface, WhereNothingIsItIsRefused) {
  Corner room;
  const Map::Hash before = room.map.hash_content();
  EXPECT_EQ(room.pin({{0.5F, 0.5F, 0.5F}, kGlass}), rt::Status::lost) << "in the air";
  EXPECT_EQ(room.pin({kOnWall, kUnknownMaterial}), rt::Status::lost) << "nothing is pinned there";
  EXPECT_EQ(room.sut.counters().refused, 2U);
  EXPECT_FALSE(room.sut.is_busy());
  EXPECT_EQ(room.map.hash_content().labels, before.labels);
}

TEST(PinSurface, ResultDoesNotDependOnHowItIsCutIntoSteps) {
  Corner whole, cut;
  ASSERT_EQ(whole.pin({kOnWall, kGlass}, 1'000'000), rt::Status::ok);
  ASSERT_EQ(cut.pin({kOnWall, kGlass}, 1), rt::Status::ok);
  EXPECT_EQ(whole.map.hash_content().labels, cut.map.hash_content().labels);
}

TEST(PinSurface, NothingIsVisibleBeforeTheWholePieceIsKnown) {
  Corner room;
  ASSERT_EQ(room.sut.begin({kOnWall, kGlass}), rt::Status::ok);
  ASSERT_EQ(room.sut.step(500), rt::Status::ok);
  EXPECT_TRUE(room.sut.is_busy());
  EXPECT_FALSE(room.at(kOnWall).is_pinned);
}

TEST(PinSurface, BlocksEvictedOnTheWayAreLeftOut) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 10; ++round) {
    Corner room;
    ASSERT_EQ(room.sut.begin({kOnWall, kGlass}), rt::Status::ok);
    while (room.sut.step(100) == rt::Status::ok) {
      const auto block = static_cast<BlockIndex>(random() % room.map.config().blocks_capacity);
      const BlockKey key = room.map.key(block);
      if (key == kNoKey) continue;
      room.map.evict(block);
      if (random() % 2 == 0) (void)room.map.find_or_allocate(key ^ 1U);  // another takes its place
    }
    for (std::uint32_t b = 0; b < room.map.config().blocks_capacity; ++b) {
      const auto block = static_cast<BlockIndex>(b);
      if (room.map.key(block) == kNoKey) continue;
      const std::uint64_t surface = cells_with_surface(room.map.tsdf(block), room.map.config());
      for (int cell = 0; cell < kBlockCells; ++cell)
        if (label::is_pinned(room.map.refined_concurrent(block, cell))) {
          EXPECT_TRUE((surface >> cell & 1U) != 0) << "a pin in a block that came later";
        }
    }
  }
}

}  // namespace
}  // namespace tactus::map
