#include "pipeline/map/refine_labels.hpp"

#include <algorithm>
#include <bit>

#include "pipeline/label/crf/morton.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "rt/assert.hpp"

namespace tactus::map {
namespace {

// Prices, ns on one 3.4 GHz core.
constexpr std::uint64_t kLookBlockNs = 2;      // whether it waits
constexpr std::uint64_t kSelectBlockNs = 100;  // to choose among
constexpr std::uint64_t kGatherBlockNs = 1500;
constexpr std::uint64_t kFeaturePointNs = 10;
constexpr std::uint64_t kUnaryPointNs = 150;
constexpr std::uint64_t kLookPointNs = 30, kMovedPointNs = 300;
constexpr std::uint64_t kCheckBlockNs = 5;
constexpr std::uint64_t kPublishBlockNs = 2000;

constexpr std::size_t kGatherBlocks = 512;  // a unit
constexpr std::uint16_t kNoPlace = 0xFFFF;
constexpr std::size_t kCellsPerBlock = 16;     // of a block that holds a surface; measured: 14
constexpr std::uint32_t kPreparedFrames = 90;  // then the surface has moved from what was gathered
constexpr int kRestartsMax = 3;                // by labels that come in between, before a round is ended

std::size_t blocks_max_of(const RefineConfig& config) { return config.crf.points_max / kCellsPerBlock; }

std::uint32_t curve_place(const BlockCoord& c) {
  const auto part = [](std::int32_t v) { return static_cast<std::uint32_t>(v + 512); };
  return label::morton_place(part(c.x), part(c.y), part(c.z));
}

// A pinned cell is certain, so that its neighbours hear of it.
LabelWord word_of(const BlockCopy& copy, int cell) {
  const label::RefinedWord refined = copy.refined[cell];
  if (!label::is_pinned(refined)) return copy.labels[cell];
  MaterialDistribution certain;
  label::refined_decode(refined, certain);
  return label::encode(certain, label::kObservationsMax);
}

}  // namespace

std::size_t LabelRefiner::bytes_needed(const RefineConfig& config, std::uint32_t blocks_capacity) {
  const std::size_t n = config.crf.points_max;
  return label::DenseCrf::bytes_needed(label::surface_engine_config(config.crf)) +
         rt::bytes_of<BlockKey>(blocks_capacity) + rt::bytes_of<std::uint32_t>(blocks_capacity) +
         rt::bytes_of<std::uint16_t>(blocks_capacity) + rt::bytes_of<std::uint64_t>(blocks_capacity) +
         rt::bytes_of<RegionBlock>(blocks_max_of(config)) + 2 * rt::bytes_of<Vec3f>(n) +
         rt::bytes_of<Rgb8>(n) + rt::bytes_of<std::uint8_t>(n) + rt::bytes_of<LabelWord>(n);
}

void LabelRefiner::bind(rt::Slice& memory, const RefineConfig& config, const Map& map) {
  TACTUS_ASSERT(label::is_valid(config.parameters) && blocks_max_of(config) > 0);
  config_ = config;
  map_ = &map;
  const std::size_t blocks = map.config().blocks_capacity, n = config.crf.points_max;
  engine_.bind(memory, label::surface_engine_config(config.crf));
  done_key_ = memory.take<BlockKey>(blocks);
  done_frame_ = memory.take<std::uint32_t>(blocks);
  place_ = memory.take<std::uint16_t>(blocks);
  order_ = memory.take<std::uint64_t>(blocks);
  region_ = memory.take<RegionBlock>(blocks_max_of(config));
  position_m_ = memory.take<Vec3f>(n);
  normal_ = memory.take<Vec3f>(n);
  color_ = memory.take<Rgb8>(n);
  cell_ = memory.take<std::uint8_t>(n);
  word_ = memory.take<LabelWord>(n);
  std::fill(done_key_.begin(), done_key_.end(), kNoKey);
  std::fill(place_.begin(), place_.end(), kNoPlace);
  blocks_target_ = blocks_max_of(config);
}

rt::Status LabelRefiner::step(std::uint32_t frames) noexcept {
  const auto share = static_cast<std::int64_t>(config_.work_ns_per_frame);
  credit_ns_ = std::min(credit_ns_ + share * frames, share);
  bool has_worked = false;
  while (credit_ns_ > 0 && !has_result_) {
    const std::uint64_t price = run_unit();
    credit_ns_ -= static_cast<std::int64_t>(price);
    counters_.work_ns += price;
    if (phase_ == Phase::select && !has_waiting_) break;
    if (phase_ == Phase::publish) return rt::Status::ok;  // whoever takes the results goes on
    has_worked = true;
  }
  return has_worked ? rt::Status::ok : rt::Status::skipped;
}

std::uint64_t LabelRefiner::run_unit() noexcept {
  switch (phase_) {
    case Phase::select:
      return select();
    case Phase::gather:
      return gather();
    case Phase::begin_kernel:
      return begin_kernel();
    case Phase::add_kernel:
      return add_kernel();
    case Phase::unary:
      return load_unary();
    case Phase::iterate:
      return iterate();
    case Phase::publish:
      return 1;  // front() does it
  }
  return 1;
}

bool LabelRefiner::waits(std::uint32_t block, BlockKey key, std::uint32_t label_frame) const noexcept {
  return done_key_[block] != key || done_frame_[block] != label_frame;
}

std::uint64_t LabelRefiner::select() noexcept {
  const std::uint32_t blocks = map_->config().blocks_capacity;
  // Who has waited longest, and whether all that wait lie in the region that is prepared.
  std::size_t labelled = 0;
  BlockKey centre = kNoKey;
  std::uint32_t oldest = 0xFFFFFFFFU;
  bool is_all_inside = is_prepared_ && map_->frame_concurrent() - prepared_frame_ < kPreparedFrames;
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const auto block = static_cast<BlockIndex>(b);
    const BlockKey key = map_->key_concurrent(block);
    const std::uint32_t frame = map_->label_frame_concurrent(block);
    if (key == kNoKey || frame == 0) continue;
    order_[labelled++] = b;
    if (!waits(b, key, frame)) continue;
    const std::uint32_t since = done_key_[b] == key ? done_frame_[b] : 0;
    if (centre == kNoKey || since < oldest) {
      oldest = since;
      centre = key;
    }
    const std::uint16_t place = place_[b];
    is_all_inside =
        is_all_inside && place != kNoPlace && region_[place].is_inner && region_[place].key == key;
  }
  has_waiting_ = centre != kNoKey;
  if (!has_waiting_) return kLookBlockNs * blocks;
  if (is_all_inside) {
    phase_ = Phase::iterate;
    iteration_ = restarts_ = 0;
    return kLookBlockNs * blocks;
  }
  for (std::size_t i = 0; i < region_count_; ++i) place_[region_[i].block] = kNoPlace;
  region_count_ = points_count_ = gathered_ = 0;
  is_prepared_ = is_overfull_ = false;
  // The nearest blocks, then along a curve, on which neighbours share lattice vertices while these are in the
  // cache.
  const BlockCoord c = coord_of(centre);
  const auto squared = [](std::int32_t v) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(v) * v);
  };
  for (std::size_t i = 0; i < labelled; ++i) {
    const BlockCoord at = coord_of(map_->key_concurrent(static_cast<BlockIndex>(order_[i])));
    order_[i] |= (squared(at.x - c.x) + squared(at.y - c.y) + squared(at.z - c.z)) << 16;
  }
  const bool is_whole = labelled <= blocks_target_;
  region_count_ = std::min(labelled, blocks_target_);
  const auto end = order_.begin() + static_cast<std::ptrdiff_t>(region_count_);
  std::nth_element(order_.begin(), end - 1, order_.begin() + static_cast<std::ptrdiff_t>(labelled));
  const std::uint64_t reach2 = order_[region_count_ - 1] >> 16;
  for (auto it = order_.begin(); it != end; ++it) {
    const auto block = static_cast<BlockIndex>(*it & 0xFFFFU);
    // Within the radius less the halo: sqrt(d2) + halo <= sqrt(reach2), without a root. Of small regions the
    // inner half.
    const std::uint64_t d2 = *it >> 16, h2 = squared(kHaloBlocks);
    const std::uint64_t rest = reach2 >= d2 + h2 ? reach2 - d2 - h2 : 0;
    const bool is_inner = is_whole || 4 * d2 <= reach2 || (rest > 0 && rest * rest >= 4 * d2 * h2);
    *it = static_cast<std::uint64_t>(curve_place(coord_of(map_->key_concurrent(block)))) << 17 |
          static_cast<std::uint64_t>(is_inner) << 16 | block;
  }
  std::sort(order_.begin(), end);
  for (std::size_t i = 0; i < region_count_; ++i)
    region_[i] = {static_cast<BlockIndex>(order_[i] & 0xFFFFU), (order_[i] >> 16 & 1U) != 0, kNoKey, 0, 0, 0};
  phase_ = Phase::gather;
  return kLookBlockNs * blocks + kSelectBlockNs * labelled;
}

std::uint64_t LabelRefiner::gather() noexcept {
  const MapConfig& config = map_->config();
  BlockCopy copy;
  const std::size_t end = std::min(gathered_ + kGatherBlocks, region_count_);
  const std::uint64_t price = kGatherBlockNs * (end - gathered_);
  for (; gathered_ < end; ++gathered_) {
    RegionBlock& at = region_[gathered_];
    at.points_begin = at.points_end = static_cast<std::uint32_t>(points_count_);
    if (!map_->copy_concurrent(at.block, copy)) continue;
    std::uint64_t cells = cells_with_surface(copy.tsdf, config);
    if (points_count_ + static_cast<std::size_t>(std::popcount(cells)) > config_.crf.points_max) {
      is_overfull_ = true;  // it waits on
      continue;
    }
    at.key = copy.key;
    at.label_frame = copy.label_frame;
    const BlockCoord c = coord_of(copy.key);
    const float side_m = kBlockSide * config.voxel_size_m;
    const Vec3f origin{static_cast<float>(c.x) * side_m, static_cast<float>(c.y) * side_m,
                       static_cast<float>(c.z) * side_m};
    for (; cells != 0; cells &= cells - 1) {
      const int cell = std::countr_zero(cells);
      CellSurface surface;
      if (!surface_of_cell(copy.tsdf, cell, config, surface)) continue;
      const ColorCell color = copy.color[cell];
      position_m_[points_count_] = origin + surface.foot_m;
      normal_[points_count_] = surface.normal_world;
      color_[points_count_] = {color.r, color.g, color.b};
      cell_[points_count_] = static_cast<std::uint8_t>(cell);
      word_[points_count_] = word_of(copy, cell);
      ++points_count_;
    }
    at.points_end = static_cast<std::uint32_t>(points_count_);
    place_[at.block] = static_cast<std::uint16_t>(gathered_);
  }
  if (gathered_ < region_count_) return price;
  // A smaller region next time, so that no block is left out for ever; or a larger one where cells are few.
  if (is_overfull_) {
    blocks_target_ = std::max<std::size_t>(region_count_ * 7 / 8, 1);
  } else if (10 * points_count_ < 8 * config_.crf.points_max) {
    blocks_target_ = std::min(blocks_target_ * 9 / 8 + 1, region_.size());
  }
  phase_ = Phase::begin_kernel;
  kernel_ = 0;
  const rt::Status begun = engine_.begin(points_count_);
  TACTUS_ASSERT(begun == rt::Status::ok);
  return price;
}

label::CrfPoints LabelRefiner::points() const noexcept {
  return {position_m_.first(points_count_), color_.first(points_count_), normal_.first(points_count_), {}};
}

std::uint64_t LabelRefiner::begin_kernel() noexcept {
  label::begin_surface_kernel(engine_, kernel_, points(), {}, config_.parameters);
  phase_ = Phase::add_kernel;
  return kFeaturePointNs * points_count_ + 1;
}

std::uint64_t LabelRefiner::add_kernel() noexcept {
  const label::CrfPiece piece = engine_.continue_kernel();
  if (piece.status != rt::Status::ok) {
    ++counters_.too_fine;
    blocks_target_ = std::max<std::size_t>(blocks_target_ / 2, 1);
    phase_ = Phase::select;
  } else if (piece.is_last) {
    phase_ = ++kernel_ == label::kCrfKernelsMax ? Phase::unary : Phase::begin_kernel;
  }
  return piece.price_ns;
}

void LabelRefiner::load_costs() noexcept {
  std::array<float, kMaterialCount> cost;
  engine_.set_unary(config_.parameters.compatibility, [&](std::size_t i) {
    label::unary_costs_of(word_[i], cost);
    return cost.data();
  });
  (void)engine_.start(config_.parameters.settled_change);
}

std::uint64_t LabelRefiner::load_unary() noexcept {
  load_costs();
  ++counters_.regions;
  is_prepared_ = true;
  prepared_frame_ = map_->frame_concurrent();
  iteration_ = restarts_ = 0;
  phase_ = Phase::iterate;
  return kUnaryPointNs * points_count_;
}

// Labels fused since: new costs for their points. False when nothing changed.
bool LabelRefiner::take_over_changes() noexcept {
  BlockCopy copy;
  std::array<float, kMaterialCount> cost;
  bool is_changed = false, must_restart = false;
  for (std::size_t i = 0; i < region_count_; ++i) {
    RegionBlock& at = region_[i];
    if (at.key == kNoKey || map_->label_frame_concurrent(at.block) == at.label_frame) continue;
    if (!map_->copy_concurrent(at.block, copy)) continue;
    if (copy.key != at.key) {  // evicted meanwhile: its points stay, nobody hears of them
      at.key = kNoKey;
      continue;
    }
    at.label_frame = copy.label_frame;
    is_changed = true;
    for (std::size_t p = at.points_begin; p < at.points_end; ++p) {
      word_[p] = word_of(copy, cell_[p]);
      if (must_restart) continue;
      label::unary_costs_of(word_[p], cost);
      must_restart = !engine_.change_unary(p, cost.data());
    }
  }
  if (must_restart) load_costs();
  return is_changed;
}

std::uint64_t LabelRefiner::iterate() noexcept {
  if (points_count_ == 0) {
    phase_ = Phase::publish;
    published_ = 0;
    return 1;
  }
  if (restarts_ < kRestartsMax && take_over_changes() && iteration_ > 0) {
    iteration_ = 0;
    ++restarts_;
  }
  const std::size_t moved = engine_.iterate();
  ++counters_.iterations;
  if (++iteration_ >= config_.iterations || moved == 0) {
    phase_ = Phase::publish;
    published_ = 0;
  }
  return kLookPointNs * points_count_ + kMovedPointNs * moved + kCheckBlockNs * region_count_;
}

const RefinedBlock* LabelRefiner::front() noexcept {
  if (has_result_) return &result_;
  if (phase_ != Phase::publish || credit_ns_ <= 0) return nullptr;
  std::array<float, kMaterialCount> marginals;
  while (published_ < region_count_) {
    const RegionBlock& at = region_[published_++];
    if (at.key == kNoKey || !at.is_inner) continue;
    done_key_[at.block] = at.key;
    done_frame_[at.block] = at.label_frame;
    result_.block = at.block;
    result_.key = at.key;
    result_.refined.fill(0);
    for (std::size_t p = at.points_begin; p < at.points_end; ++p) {
      engine_.marginals_of(p, marginals);
      result_.refined[cell_[p]] = label::refined_word(marginals);
    }
    counters_.cells += at.points_end - at.points_begin;
    credit_ns_ -= static_cast<std::int64_t>(kPublishBlockNs);
    counters_.work_ns += kPublishBlockNs;
    has_result_ = true;
    return &result_;
  }
  ++counters_.rounds;
  phase_ = Phase::select;
  has_waiting_ = true;
  return nullptr;
}

}  // namespace tactus::map
