// A person's correction: a connected piece of surface is given a material, for good, or given back.
//
// A pin lives in the map's cells (label/refined_word.hpp) beside what keyframes said, which goes on being
// fused below it: readers see the pinned material whatever is observed, the 3D CRF takes pinned cells as
// certain and carries them to their neighbours, and taking a pin back shows what was observed all the while.
// Evicting a block forgets its pins with everything else.
//
// The piece is found by flooding from the cell at a point, a bounded number of cells a step, and published
// when it is known whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/map/map.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::map {

struct SurfacePin {
  Vec3f position_world_m;  // within the truncation distance of the surface that is meant
  /// kUnknownMaterial takes a pin back: of the cells connected to the position's that are pinned alike.
  MaterialId material = kUnknownMaterial;
  /// 0: the surface ends where readers see another material than at the position. Else it may be labelled
  /// anyhow and ends this far from the position. Both end at creases.
  float within_m = 0;
};

struct PinCounters {
  std::uint64_t pinned = 0, taken_back = 0;  // requests
  std::uint64_t cells = 0;                   // changed by either
  std::uint64_t refused = 0;                 // no surface, or nothing pinned, at the position
  std::uint64_t cut_short = 0;               // the flood's edge outgrew its memory
};

/// One request at a time. Thread: the map's writer. No heap after bind().
class SurfacePinner {
 public:
  static std::size_t bytes_needed(const MapConfig& config);
  /// Phase: boot. The map outlives this.
  void bind(rt::Slice& memory, Map& map);

  /// Starts a request. lost: nothing to pin, or to take back, at the position. Not while is_busy(). Phase:
  /// step.
  rt::Status begin(const SurfacePin& pin) noexcept;
  /// Works on at most so many cells, 1 to 2 us each. skipped: nothing to do. Phase: step.
  rt::Status step(std::size_t cells_max) noexcept;

  [[nodiscard]] bool is_busy() const noexcept { return phase_ != Phase::idle; }
  [[nodiscard]] const PinCounters& counters() const noexcept { return counters_; }

 private:
  enum class Phase : std::uint8_t { idle, flood, publish };
  struct Cell {
    BlockIndex block = kNoBlock;
    std::uint16_t cell = 0;
  };

  [[nodiscard]] bool is_surface(Cell at) noexcept;
  [[nodiscard]] bool continues(Cell from, Cell to) noexcept;
  void push(Cell at) noexcept;
  void spread(Cell from) noexcept;

  Map* map_ = nullptr;
  SurfacePin pin_;
  MaterialId before_ = kUnknownMaterial;  // what readers see at the position
  Phase phase_ = Phase::idle;
  bool is_cut_short_ = false;
  std::size_t first_ = 0, waiting_ = 0;  // in edge_, a ring
  std::size_t published_ = 0;
  PinCounters counters_;
  // Per block of the pool, valid where key_ is the block's.
  std::span<BlockKey> key_;
  std::span<std::uint64_t> surface_, taken_;  // a bit per cell
  std::span<Cell> edge_;
};

}  // namespace tactus::map
