// The CRF that runs all the time, against the batch solver over the same cells.
#include "pipeline/map/refine_labels.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <random>
#include <thread>
#include <vector>

#include "pipeline/label/crf/batch_crf.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "rt/spsc_ring.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

using test::fill;
using test::live_blocks;
using test::OwnedMap;

class OwnedRefiner {
 public:
  OwnedRefiner(const RefineConfig& config, const Map& map)
      : bytes_(rt::round_up(LabelRefiner::bytes_needed(config, map.config().blocks_capacity), 64)) {
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)));
    rt::Slice memory({memory_.get(), bytes_});
    refiner.bind(memory, config, map);
  }
  LabelRefiner refiner;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::size_t bytes_;
  std::unique_ptr<std::byte, Free> memory_;
};

/// What the spine does with the results.
void take_results(LabelRefiner& sut, Map& map) {
  while (const RefinedBlock* result = sut.front()) {
    if (map.key(result->block) == result->key) map.publish_refined(result->block, result->refined);
    sut.pop();
  }
}

/// Steps until nothing waits; how many frames that took.
int run_to_the_end(LabelRefiner& sut, Map& map, int frames_max) {
  for (int frame = 1; frame <= frames_max; ++frame) {
    (void)sut.step(1);
    take_results(sut, map);
    if (sut.is_idle()) return frame;
  }
  return frames_max + 1;
}

// A corner of a room: floor, two walls and a box. Materials by place, observed with errors.
class Corner {
 public:
  explicit Corner(double side_m, std::uint32_t blocks_capacity = 14336)
      : owned({0.01F, 0.04F, blocks_capacity}), map(owned.map), side_m_(side_m) {
    fill(map, {-0.1, -0.1, -0.1}, {side_m, side_m, side_m}, [&](const Vec3d& p) {
      const double box = std::max({std::fabs(p.x - 0.7) - 0.3, p.y - 0.5, std::fabs(p.z - 0.7) - 0.3});
      return std::min({p.x, p.y, p.z, box});
    });
  }

  static MaterialId truth(const Vec3f& p) {
    if (p.y < 0.03F) return 22;                                           // floor: wood
    if (p.x < 0.03F) return p.z > 1.2F ? MaterialId{6} : MaterialId{12};  // wall and window
    if (p.z < 0.03F) return 20;
    return 3;
  }

  /// Another keyframe: every cell says its material, one in five says something else.
  void observe(std::uint32_t frame, std::mt19937& random) {
    std::vector<BlockIndex> blocks;
    live_blocks(map, blocks);
    for (const BlockIndex block : blocks) {
      if (cells_with_surface(map.tsdf(block), map.config()) == 0) continue;
      std::array<LabelWord, kBlockCells> words;
      std::copy_n(map.labels(block).begin(), kBlockCells, words.begin());
      for (std::uint64_t cells = cells_with_surface(map.tsdf(block), map.config()); cells != 0;
           cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        CellSurface surface;
        if (!surface_of_cell(map.tsdf(block), cell, map.config(), surface)) continue;
        std::array<std::uint8_t, kMaterialCount> scores;
        scores.fill(5);
        const bool is_wrong = random() % 5 == 0;
        scores[is_wrong ? random() % kMaterialCount : truth(position(block, surface))] = 120;
        auto& word = words[static_cast<std::size_t>(cell)];
        word = label::fuse(word, label::costs_of(scores));
      }
      map.publish_labels(block, words, frame);
    }
    map.set_frame(frame);
  }

  [[nodiscard]] Vec3f position(BlockIndex block, const CellSurface& surface) const {
    const BlockCoord c = coord_of(map.key(block));
    return Vec3f{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)} * 0.08F +
           surface.foot_m;
  }

  /// Share of cells whose refined material is the batch solver's; and how many cells there are.
  double agreement_with_batch(const label::CrfParameters& parameters, std::size_t& cells_count) {
    std::vector<Vec3f> positions, normals;
    std::vector<Rgb8> colors;
    std::vector<float> unary;
    std::vector<label::RefinedWord> refined;
    std::vector<BlockIndex> blocks;
    live_blocks(map, blocks);
    for (const BlockIndex block : blocks)
      for (std::uint64_t cells = cells_with_surface(map.tsdf(block), map.config()); cells != 0;
           cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        CellSurface surface;
        if (!surface_of_cell(map.tsdf(block), cell, map.config(), surface)) continue;
        positions.push_back(position(block, surface));
        normals.push_back(surface.normal_world);
        const ColorCell color = map.color(block)[cell];
        colors.push_back({color.r, color.g, color.b});
        unary.resize(unary.size() + kMaterialCount);
        label::unary_costs_of(
            map.labels(block)[static_cast<std::size_t>(cell)],
            std::span<float, kMaterialCount>(&unary[unary.size() - kMaterialCount], kMaterialCount));
        refined.push_back(map.refined_concurrent(block, cell));
      }
    cells_count = positions.size();
    const auto config = label::BatchCrfConfig::for_any_points(cells_count);
    const std::size_t bytes = rt::round_up(label::BatchCrf::bytes_needed(config), 64);
    auto* memory = static_cast<std::byte*>(std::aligned_alloc(64, bytes));
    rt::Slice slice({memory, bytes});
    label::BatchCrf batch;
    batch.bind(slice, config);
    std::vector<float> marginals(unary.size());
    std::vector<MaterialId> labels(cells_count);
    EXPECT_EQ(batch.prepare({positions, colors, normals, unary}, parameters), rt::Status::ok);
    (void)batch.solve(marginals);
    std::free(memory);
    label::most_probable(marginals, labels);
    std::size_t equal = 0;
    for (std::size_t i = 0; i < cells_count; ++i) equal += label::refined_best(refined[i]) == labels[i];
    return static_cast<double>(equal) / static_cast<double>(cells_count);
  }

  OwnedMap owned;
  Map& map;

 private:
  double side_m_;
};

TEST(RefineLabels, WholeRoomInOneRegionAgreesWithBatchInThirtyFramesAfterTheLastChange) {
  Corner room(2.0);
  std::mt19937 random(1);
  room.observe(1, random);
  const RefineConfig config = RefineConfig::for_cells(40000);
  OwnedRefiner owned(config, room.map);
  LabelRefiner& sut = owned.refiner;
  ASSERT_LE(run_to_the_end(sut, room.map, 1000), 1000);
  // Another keyframe, while the region is prepared.
  room.observe(13, random);
  const std::uint64_t work_before_ns = sut.counters().work_ns;
  const int frames = run_to_the_end(sut, room.map, 1000);
  std::size_t cells = 0;
  const double agreement = room.agreement_with_batch(config.parameters, cells);
  std::printf("%zu cells, %d frames, %.2f ms charged a frame, %.2f %% agree with batch\n", cells, frames,
              static_cast<double>(sut.counters().work_ns - work_before_ns) / 1e6 / frames, 100 * agreement);
  EXPECT_GT(cells, 15000U);
  EXPECT_LE(frames, 30);
  EXPECT_GE(agreement, 0.99);
  EXPECT_EQ(sut.counters().regions, 1U) << "prepared once";
}

TEST(RefineLabels, SmallRegionsWithHalosCoverTheRoomAndAgreeWithBatch) {
  Corner room(2.0);
  std::mt19937 random(2);
  room.observe(1, random);
  const RefineConfig config = RefineConfig::for_cells(8000);
  OwnedRefiner owned(config, room.map);
  LabelRefiner& sut = owned.refiner;
  ASSERT_LE(run_to_the_end(sut, room.map, 3000), 3000);
  std::size_t cells = 0;
  const double agreement = room.agreement_with_batch(config.parameters, cells);
  std::printf("%llu regions, %.2f %% agree with batch\n",
              static_cast<unsigned long long>(sut.counters().regions), 100 * agreement);
  EXPECT_GT(sut.counters().regions, 1U);
  EXPECT_GE(agreement, 0.98);
}

TEST(RefineLabels, PinnedCellsStayAndAreCarriedToTheirNeighbours) {
  Corner room(1.0);
  std::mt19937 random(8);
  room.observe(1, random);
  OwnedRefiner owned(RefineConfig::for_cells(20000, label::test::three_kernels()), room.map);
  LabelRefiner& sut = owned.refiner;
  ASSERT_LE(run_to_the_end(sut, room.map, 1000), 1000);
  std::vector<BlockIndex> blocks;
  live_blocks(room.map, blocks);
  // Fifteen in sixteen cells of the floor are pinned to glass; the others have heard once, by 3.2 nat, that
  // they are wood. Neighbours weigh 5 nat in all.
  const auto glass_share = [&] {
    double glass = 0, others = 0;
    for (const BlockIndex block : blocks)
      for (int cell = 0; cell < kBlockCells; ++cell) {
        const label::RefinedWord word = room.map.refined_concurrent(block, cell);
        CellSurface surface;
        if (word == 0 || label::is_pinned(word) ||
            !surface_of_cell(room.map.tsdf(block), cell, room.map.config(), surface) ||
            Corner::truth(room.position(block, surface)) != 22)
          continue;
        others += 1;
        glass += label::refined_best(word) == 6;
      }
    return glass / others;
  };
  EXPECT_LT(glass_share(), 0.01);
  std::uint64_t pinned = 0;
  for (const BlockIndex block : blocks) {
    std::uint64_t cells = 0;
    for (int cell = 0; cell < kBlockCells; ++cell) {
      CellSurface surface;
      if (random() % 16 > 0 && room.map.refined_concurrent(block, cell) != 0 &&
          surface_of_cell(room.map.tsdf(block), cell, room.map.config(), surface) &&
          Corner::truth(room.position(block, surface)) == 22)
        cells |= 1ULL << cell;
    }
    if (cells != 0) room.map.publish_pins(block, cells, label::pinned_word(6), 2);
    pinned += static_cast<std::uint64_t>(std::popcount(cells));
  }
  ASSERT_GT(pinned, 500U);
  ASSERT_LE(run_to_the_end(sut, room.map, 1000), 1000);
  EXPECT_GT(glass_share(), 0.5);
  std::uint64_t still_pinned = 0;
  for (const BlockIndex block : blocks)
    for (int cell = 0; cell < kBlockCells; ++cell)
      still_pinned += label::is_pinned(room.map.refined_concurrent(block, cell));
  EXPECT_EQ(still_pinned, pinned);
}

TEST(RefineLabels, WrongIslandsGo) {
  Corner room(1.0);
  std::mt19937 random(3);
  room.observe(1, random);
  // The corner is of one colour: only their normals part its surfaces.
  OwnedRefiner owned(RefineConfig::for_cells(20000, label::test::three_kernels()), room.map);
  ASSERT_LE(run_to_the_end(owned.refiner, room.map, 1000), 1000);
  std::vector<BlockIndex> blocks;
  live_blocks(room.map, blocks);
  std::size_t count = 0, fused_right = 0, refined_right = 0;
  for (const BlockIndex block : blocks)
    for (std::uint64_t cells = cells_with_surface(room.map.tsdf(block), room.map.config()); cells != 0;
         cells &= cells - 1) {
      const int cell = std::countr_zero(cells);
      CellSurface surface;
      if (!surface_of_cell(room.map.tsdf(block), cell, room.map.config(), surface)) continue;
      const MaterialId truth = Corner::truth(room.position(block, surface));
      ++count;
      fused_right += label::best(room.map.labels(block)[static_cast<std::size_t>(cell)]) == truth;
      refined_right += label::refined_best(room.map.refined_concurrent(block, cell)) == truth;
    }
  std::printf("%zu cells, right: fused %.2f %%, refined %.2f %%\n", count,
              100.0 * static_cast<double>(fused_right) / static_cast<double>(count),
              100.0 * static_cast<double>(refined_right) / static_cast<double>(count));
  EXPECT_LT(static_cast<double>(fused_right), 0.85 * static_cast<double>(count));
  EXPECT_GT(static_cast<double>(refined_right), 0.95 * static_cast<double>(count));
}

TEST(RefineLabels, SameMapGivesTheSameBits) {
  std::uint64_t hash[2];
  for (std::uint64_t& h : hash) {
    Corner room(0.8);
    std::mt19937 random(4);
    room.observe(1, random);
    OwnedRefiner owned(RefineConfig::for_cells(6000), room.map);
    EXPECT_LE(run_to_the_end(owned.refiner, room.map, 2000), 2000);
    h = room.map.hash_content().labels;
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(RefineLabels, NothingLabelledNothingDone) {
  Corner room(0.5);
  OwnedRefiner owned(RefineConfig::for_cells(1000), room.map);
  EXPECT_EQ(owned.refiner.step(1), rt::Status::skipped);
  EXPECT_EQ(owned.refiner.front(), nullptr);
  EXPECT_TRUE(owned.refiner.is_idle());
}

TEST(RefineLabels, LatticeTooSmallTakesSmallerRegionsAndStillEnds) {
  Corner room(0.8);
  std::mt19937 random(5);
  room.observe(1, random);
  RefineConfig config = RefineConfig::for_cells(6000);
  config.crf.appearance.vertices_max = 200;
  OwnedRefiner owned(config, room.map);
  EXPECT_LE(run_to_the_end(owned.refiner, room.map, 5000), 5000);
  EXPECT_GT(owned.refiner.counters().too_fine, 0U);
}

TEST(RefineLabels, EvictedBlockIsNotWrittenTo) {
  Corner room(0.6);
  std::mt19937 random(6);
  room.observe(1, random);
  OwnedRefiner owned(RefineConfig::for_cells(6000), room.map);
  LabelRefiner& sut = owned.refiner;
  while (sut.front() == nullptr) (void)sut.step(1);
  const RefinedBlock first = *sut.front();
  room.map.evict(first.block);
  const BlockIndex reused = room.map.find_or_allocate(key_of({60, 60, 60}));
  ASSERT_EQ(reused, first.block);
  EXPECT_NE(room.map.key(first.block), first.key) << "what the spine compares";
  take_results(sut, room.map);
  EXPECT_LE(run_to_the_end(sut, room.map, 2000), 2000);
  for (int cell = 0; cell < kBlockCells; ++cell) EXPECT_EQ(room.map.refined_concurrent(reused, cell), 0U);
}

// As in the realtime runner: the spine publishes labels and voxels and evicts while the refiner reads;
// results come back through a ring. Under ThreadSanitizer this is the test of both sides.
TEST(RefineLabels, BesideAWriterThatNeverRestsEveryResultIsWhole) {
  Corner room(0.4);
  std::mt19937 random(7);
  room.observe(1, random);
  OwnedRefiner owned(RefineConfig::for_cells(3072), room.map);
  auto ring = std::make_unique<rt::SpscRing<RefinedBlock, 512>>();
  std::atomic<bool> is_over{false};
  std::uint64_t pushed = 0;
  std::thread refiner([&, producer = ring->producer()]() mutable {
    while (!is_over.load(std::memory_order_acquire)) {
      (void)owned.refiner.step(1);
      while (const RefinedBlock* result = owned.refiner.front()) {
        if (!producer.try_push(*result)) break;
        owned.refiner.pop();
        ++pushed;
      }
    }
  });
  auto consumer = ring->consumer();
  std::vector<BlockIndex> blocks;
  std::uint64_t taken = 0, stale = 0;
  for (std::uint32_t frame = 2; frame < 40 || taken < 100; ++frame) {
    room.observe(frame, random);
    live_blocks(room.map, blocks);
    const BlockIndex victim = blocks[random() % blocks.size()];
    const BlockKey key = room.map.key(victim);
    BlockStaging staging;
    std::copy_n(room.map.tsdf(victim), kBlockVoxels, staging.tsdf);
    std::copy_n(room.map.weight(victim), kBlockVoxels, staging.weight);
    std::copy_n(room.map.color(victim), kBlockCells, staging.color);
    room.map.evict(victim);
    room.map.publish(room.map.find_or_allocate(key), staging);
    RefinedBlock refined;
    while (consumer.try_pop(refined)) {
      ++taken;
      for (const label::RefinedWord word : refined.refined)
        ASSERT_TRUE(word == 0 ||
                    (label::refined_best(word) < kMaterialCount && label::refined_confidence(word) <= 1));
      if (room.map.key(refined.block) != refined.key) {
        ++stale;
        continue;
      }
      room.map.publish_refined(refined.block, refined.refined);
    }
  }
  is_over.store(true, std::memory_order_release);
  refiner.join();
  RefinedBlock rest;
  while (consumer.try_pop(rest)) ++taken;
  EXPECT_EQ(taken, pushed) << "nothing is lost on the way";
  std::printf("%llu results, %llu of blocks gone since\n", static_cast<unsigned long long>(taken),
              static_cast<unsigned long long>(stale));
}

}  // namespace
}  // namespace tactus::map
