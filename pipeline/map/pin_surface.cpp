#include "pipeline/map/pin_surface.hpp"

#include <algorithm>
#include <bit>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/map/reader.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "rt/assert.hpp"

namespace tactus::map {
namespace {

// A flood over a plane waits at its rim: 4 x side x 2 layers of cells, so 20 m of side.
constexpr std::size_t kEdgeCells = 8192;
// Neighbouring pieces of one surface: normals within 26 degrees. Noise turns them by up to 15, an edge by 90.
constexpr float kCosineMin = 0.9f;

Vec3f centre_of(BlockKey key, int cell, float voxel_size_m) {
  const BlockCoord c = coord_of(key);
  const auto middle = [&](std::int32_t block, int in_cells) {
    return (static_cast<float>(block * kBlockSide + in_cells * kCellSide) + 0.5f) * voxel_size_m;
  };
  return {middle(c.x, cell & 3), middle(c.y, cell >> 2 & 3), middle(c.z, cell >> 4)};
}

}  // namespace

std::size_t SurfacePinner::bytes_needed(const MapConfig& config) {
  const std::size_t n = config.blocks_capacity;
  return rt::bytes_of<BlockKey>(n) + 2 * rt::bytes_of<std::uint64_t>(n) + rt::bytes_of<Cell>(kEdgeCells);
}

void SurfacePinner::bind(rt::Slice& memory, Map& map) {
  map_ = &map;
  const std::size_t n = map.config().blocks_capacity;
  key_ = memory.take<BlockKey>(n);
  surface_ = memory.take<std::uint64_t>(n);
  taken_ = memory.take<std::uint64_t>(n);
  edge_ = memory.take<Cell>(kEdgeCells);
}

rt::Status SurfacePinner::begin(const SurfacePin& pin) noexcept {
  TACTUS_ASSERT(!is_busy() && (pin.material < kMaterialCount || pin.material == kUnknownMaterial));
  std::fill(key_.begin(), key_.end(), kNoKey);
  pin_ = pin;
  first_ = waiting_ = published_ = 0;
  is_cut_short_ = false;
  SurfacePoint point;
  if (!Reader(*map_).nearest_surface(pin.position_world_m, point)) {
    ++counters_.refused;
    return rt::Status::lost;
  }
  pin_.position_world_m = point.position_world_m;
  before_ = point.material;
  const CellAddress address = cell_at(point.position_world_m, map_->config().voxel_size_m);
  const Cell seed{map_->find(address.key), static_cast<std::uint16_t>(address.cell)};
  if (seed.block == kNoBlock || !is_surface(seed) || (pin.material == kUnknownMaterial && !point.is_pinned)) {
    ++counters_.refused;
    return rt::Status::lost;
  }
  push(seed);
  phase_ = Phase::flood;
  return rt::Status::ok;
}

// Looks a block up when the flood first comes to it.
bool SurfacePinner::is_surface(Cell at) noexcept {
  const BlockKey key = map_->key(at.block);
  if (key == kNoKey) return false;
  if (key_[at.block] != key) {
    key_[at.block] = key;
    taken_[at.block] = 0;
    surface_[at.block] = cells_with_surface(map_->tsdf(at.block), map_->config());
  }
  return (surface_[at.block] >> at.cell & 1U) != 0;
}

void SurfacePinner::push(Cell at) noexcept {
  if (waiting_ == edge_.size()) {
    is_cut_short_ = true;
    return;
  }
  taken_[at.block] |= 1ULL << at.cell;
  edge_[(first_ + waiting_++) % edge_.size()] = at;
}

bool SurfacePinner::continues(Cell from, Cell to) noexcept {
  if (to.block == kNoBlock || !is_surface(to) || (taken_[to.block] >> to.cell & 1U) != 0) return false;
  const label::RefinedWord refined = map_->refined_concurrent(to.block, to.cell);
  if (pin_.material == kUnknownMaterial)
    return label::is_pinned(refined) && label::refined_best(refined) == before_;
  const MapConfig& config = map_->config();
  if (pin_.within_m > 0) {
    const Vec3f away = centre_of(key_[to.block], to.cell, config.voxel_size_m) - pin_.position_world_m;
    if (away.dot(away) > pin_.within_m * pin_.within_m) return false;
  } else {
    const MaterialId seen = label::seen_material(map_->labels(to.block)[to.cell], refined);
    if (seen != before_) return false;
  }
  CellSurface a, b;
  return surface_of_cell(map_->tsdf(from.block), from.cell, config, a) &&
         surface_of_cell(map_->tsdf(to.block), to.cell, config, b) &&
         a.normal_world.dot(b.normal_world) >= kCosineMin;
}

void SurfacePinner::spread(Cell from) noexcept {
  const BlockCoord c = coord_of(key_[from.block]);
  for (int step = 0; step < 27; ++step) {
    const int x = (from.cell & 3) + step % 3 - 1, y = (from.cell >> 2 & 3) + step / 3 % 3 - 1,
              z = (from.cell >> 4) + step / 9 - 1;
    const BlockCoord at{c.x + (x >> 2), c.y + (y >> 2), c.z + (z >> 2)};
    const BlockIndex block = at == c ? from.block : map_->find(key_of(at));
    const Cell to{
        block, static_cast<std::uint16_t>((x & 3) + kBlockCellSide * ((y & 3) + kBlockCellSide * (z & 3)))};
    if (continues(from, to)) push(to);
  }
}

rt::Status SurfacePinner::step(std::size_t cells_max) noexcept {
  if (phase_ == Phase::idle) return rt::Status::skipped;
  std::size_t left = cells_max;
  for (; phase_ == Phase::flood && left > 0; --left) {
    if (waiting_ == 0) {
      phase_ = Phase::publish;
      break;
    }
    const Cell from = edge_[first_];
    first_ = (first_ + 1) % edge_.size();
    --waiting_;
    if (map_->key(from.block) == key_[from.block]) spread(from);  // else evicted meanwhile
  }
  const label::RefinedWord word = pin_.material == kUnknownMaterial ? 0 : label::pinned_word(pin_.material);
  for (; phase_ == Phase::publish && left > 0; ++published_) {
    if (published_ == key_.size()) {
      phase_ = Phase::idle;
      ++(pin_.material == kUnknownMaterial ? counters_.taken_back : counters_.pinned);
      if (is_cut_short_) ++counters_.cut_short;
      break;
    }
    const auto block = static_cast<BlockIndex>(published_);
    if (key_[block] == kNoKey || key_[block] != map_->key(block) || taken_[block] == 0) continue;
    map_->publish_pins(block, taken_[block], word, map_->frame_concurrent());
    const auto cells = static_cast<std::size_t>(std::popcount(taken_[block]));
    counters_.cells += cells;
    left -= std::min(left, cells);
  }
  return rt::Status::ok;
}

}  // namespace tactus::map
