// The 3D CRF of eqs. (2) and (3), run all the time over the part of the map whose labels changed.
//
// The batch solver (label/crf/batch_crf.hpp) over all cells of a room takes seconds. This one takes a region
// of bounded size around the block that has waited longest, prepares its lattices once, and then runs mean
// field on them an iteration at a time, with the newest costs: labels that are fused meanwhile are taken over
// between iterations, which is a warm start. A region stays prepared for as long as everything that changed
// lies inside it. At its rim, kHaloBlocks wide, cells take part whose own result is not published: they lack
// neighbours.
//
//   select ─► gather ─► three kernels ─► unary costs ─► iterate ... ─► publish ─► select
//                                           ▲                             │
//                                           └── all that changed inside ──┘
//
// Work is cut into units and charged at fixed prices (ns on one 3.4 GHz core, measured), a fixed sum a frame:
// what a step does depends on the map alone, never on a clock, so that a recording replays bit for bit. A
// unit that costs more than the frame's share is paid off in the frames after it.
//
// Thread: one (refine). It reads the live map without a lock and never writes it: results go to the map's
// writer as RefinedBlock. No heap after bind().
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/label/crf/batch_crf.hpp"
#include "pipeline/map/map.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::map {

struct RefineConfig {
  label::BatchCrfConfig crf;  // points_max: cells in a region
  label::CrfParameters parameters = label::default_crf_parameters();
  int iterations = 8;
  std::uint32_t work_ns_per_frame = 2'000'000;

  /// A region of this many cells, with lattices as these bandwidths ask for. Half the iterations do, since
  /// each round starts from where the last one ended.
  ///
  /// Measured, cells of 2 cm, bandwidths 0.08 m; 0.2 m and 20; 0.2 m and 0.6: real rooms (fr1, kitchen) and
  /// the synthetic ones need up to 0.1, 0.7 and 0.6 vertices a cell, and 0.5, 4.3 and 3.7 slots. The lattices
  /// of positions, and of normals, which bend little, have as many vertices as fit into the surface: they go
  /// with the square of the bandwidth in space. Colours scatter everywhere, so that there each bandwidth
  /// counts once.
  static constexpr RefineConfig for_cells(std::size_t count,
                                          const label::CrfParameters& p = label::default_crf_parameters()) {
    const auto lattice = [count](float weight, double vertices_per_cell, double vertices_per_cell_max,
                                 double slots_per_vertex) {
      if (weight == 0) return label::BatchCrfConfig::Lattice{1, 1};  // no such kernel
      const double vertices = static_cast<double>(count) * std::min(vertices_per_cell, vertices_per_cell_max);
      return label::BatchCrfConfig::Lattice{static_cast<std::size_t>(vertices),
                                            static_cast<std::size_t>(vertices * slots_per_vertex)};
    };
    const auto ratio = [](double measured, float bandwidth) {
      return measured / static_cast<double>(bandwidth);
    };
    const double smoothness = ratio(0.08, p.smoothness.theta_position_m),
                 appearance = ratio(0.2, p.appearance.theta_position_m),
                 surface = ratio(0.2, p.surface.theta_position_m);
    RefineConfig config;
    config.crf = {
        count, lattice(p.smoothness.weight, smoothness * smoothness / 6, 4, 4.5),
        lattice(p.appearance.weight, appearance * ratio(20, p.appearance.theta_color) * 3 / 4, 7, 6),
        lattice(p.surface.weight, surface * surface * ratio(0.6, p.surface.theta_normal) * 2 / 3, 7, 6)};
    config.parameters = p;
    config.iterations = (p.iterations_max + 1) / 2;
    return config;
  }
};

/// A block's refined cells, on their way to the map's writer; stale when the block has another key by then.
struct RefinedBlock {
  BlockIndex block = kNoBlock;
  BlockKey key = kNoKey;
  std::array<label::RefinedWord, kBlockCells> refined{};
};

struct RefineCounters {
  std::uint64_t regions = 0;     // prepared
  std::uint64_t rounds = 0;      // run to their end
  std::uint64_t iterations = 0;  // of mean field
  std::uint64_t cells = 0;       // published
  std::uint64_t too_fine = 0;    // regions given up for lack of lattice vertices, tried again smaller
  std::uint64_t work_ns = 0;     // charged
};

class LabelRefiner {
 public:
  static std::size_t bytes_needed(const RefineConfig& config, std::uint32_t blocks_capacity);
  /// Phase: boot. The map outlives this.
  void bind(rt::Slice& memory, const RefineConfig& config, const Map& map);

  /// Does `frames` frames' share of work. skipped: nothing is waiting. Phase: step, refine thread; bounded by
  /// the share and the largest unit (an iteration in which every cell moves).
  rt::Status step(std::uint32_t frames) noexcept;

  /// Next result, nullptr when there is none yet; it stays until pop(). Phase: step, refine thread.
  [[nodiscard]] const RefinedBlock* front() noexcept;
  void pop() noexcept { has_result_ = false; }

  /// Whether every label in the map is refined and handed out.
  [[nodiscard]] bool is_idle() const noexcept {
    return phase_ == Phase::select && !has_waiting_ && !has_result_;
  }
  [[nodiscard]] const RefineCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::size_t points_count() const noexcept { return points_count_; }

  static constexpr int kHaloBlocks = 4;

 private:
  enum class Phase : std::uint8_t { select, gather, begin_kernel, add_kernel, unary, iterate, publish };
  struct RegionBlock {
    BlockIndex block = kNoBlock;
    bool is_inner = true;
    BlockKey key = kNoKey;
    std::uint32_t label_frame = 0;  // of the words that are loaded
    std::uint32_t points_begin = 0, points_end = 0;
  };

  std::uint64_t run_unit() noexcept;  // answers its price
  std::uint64_t select() noexcept;
  std::uint64_t gather() noexcept;
  std::uint64_t begin_kernel() noexcept;
  std::uint64_t add_kernel() noexcept;
  std::uint64_t load_unary() noexcept;
  std::uint64_t iterate() noexcept;
  bool take_over_changes() noexcept;
  void load_costs() noexcept;
  [[nodiscard]] bool waits(std::uint32_t block, BlockKey key, std::uint32_t label_frame) const noexcept;
  [[nodiscard]] label::CrfPoints points() const noexcept;

  RefineConfig config_;
  const Map* map_ = nullptr;
  label::DenseCrf engine_;
  RefineCounters counters_;
  Phase phase_ = Phase::select;
  bool has_waiting_ = false, is_prepared_ = false, is_overfull_ = false, has_result_ = false;
  std::int64_t credit_ns_ = 0;
  std::size_t kernel_ = 0, gathered_ = 0, published_ = 0;
  int iteration_ = 0, restarts_ = 0;
  std::uint32_t prepared_frame_ = 0;
  std::size_t blocks_target_ = 0;

  // Per block of the pool: what its published result was made from.
  std::span<BlockKey> done_key_;
  std::span<std::uint32_t> done_frame_;
  std::span<std::uint16_t> place_;  // in the region, or kNoPlace
  std::span<std::uint64_t> order_;  // scratch of the selection
  // The region.
  std::span<RegionBlock> region_;
  std::size_t region_count_ = 0, points_count_ = 0;
  std::span<Vec3f> position_m_, normal_;
  std::span<Rgb8> color_;
  std::span<std::uint8_t> cell_;
  std::span<LabelWord> word_;
  RefinedBlock result_;
};

}  // namespace tactus::map
