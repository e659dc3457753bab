#include "pipeline/label/crf/lattice.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::label {
namespace {

// Coordinate i of the hyperplane basis is divided by its length sqrt((i+1)(i+2)); the common factor makes the
// filter's variance 1 in features: splatting and slicing add (d+1)^2 / 12 each and blurring (d+1)^2 / 2 to
// the variance along a direction, so one unit is sqrt(2/3) (d+1) lattice units (Adams et al. 2010, sec. 3.1).
template <std::size_t kDimensions>
constexpr std::array<float, kDimensions> elevation_scale() {
  constexpr auto root = [](double v) {  // Newton's; std::sqrt is no constant expression
    double r = v;
    for (int i = 0; i < 60; ++i) r = 0.5 * (r + v / r);
    return r;
  };
  std::array<float, kDimensions> scale{};
  for (std::size_t i = 0; i < kDimensions; ++i) {
    const auto k = static_cast<double>(i);
    scale[i] = static_cast<float>((kDimensions + 1) * root(2.0 / 3.0) / root((k + 1) * (k + 2)));
  }
  return scale;
}

}  // namespace

template <std::size_t kDimensions>
bool embed(const float* feature, LatticeSimplex<kDimensions>& simplex) noexcept {
  static_assert(kDimensions <= kLatticeDimensionsMax);
  constexpr std::size_t kVertices = kDimensions + 1;
  constexpr auto kTop = static_cast<std::int32_t>(kDimensions);
  constexpr auto kScale = elevation_scale<kDimensions>();
  constexpr float kInverse = 1.0F / static_cast<float>(kVertices);
  // Onto the hyperplane of coordinate sum 0.
  std::array<float, kVertices> elevated;
  float sum = 0;
  for (std::size_t i = kDimensions; i > 0; --i) {
    const float c = feature[i - 1] * kScale[i - 1];
    elevated[i] = sum - static_cast<float>(i) * c;
    sum += c;
  }
  elevated[0] = sum;
  // The nearest vertex of remainder 0, and how far each coordinate is from it.
  std::array<std::int32_t, kVertices> m, rank{};
  std::array<float, kVertices> rest;
  std::int32_t excess = 0;
  for (std::size_t i = 0; i < kVertices; ++i) {
    const float v = elevated[i] * kInverse;
    if (!(v > -kLatticeCoordinateMax && v < kLatticeCoordinateMax)) return false;
    m[i] = static_cast<std::int32_t>(v < 0 ? v - 0.5F : v + 0.5F);
    rest[i] = v - static_cast<float>(m[i]);
    excess += m[i];
  }
  for (std::size_t i = 0; i < kVertices; ++i)
    for (std::size_t j = i + 1; j < kVertices; ++j) {
      const bool is_less = rest[i] < rest[j];
      rank[i] += is_less ? 1 : 0;
      rank[j] += is_less ? 0 : 1;
    }
  // Rounding may have left the plane: the coordinates that were rounded most go back.
  std::array<float, kVertices + 1> weight{};
  for (std::size_t i = 0; i < kVertices; ++i) {
    rank[i] += excess;
    if (rank[i] < 0) {
      rank[i] += kTop + 1;
      m[i] += 1;
      rest[i] -= 1;
    } else if (rank[i] > kTop) {
      rank[i] -= kTop + 1;
      m[i] -= 1;
      rest[i] += 1;
    }
    const auto r = static_cast<std::size_t>(rank[i]);
    weight[kDimensions - r] += rest[i];
    weight[kDimensions + 1 - r] -= rest[i];
  }
  weight[0] += 1 + weight[kVertices];
  for (std::size_t k = 0; k < kVertices; ++k) simplex.weight[k] = std::max(weight[k], 0.0F);
  for (std::int32_t k = 0; k <= kTop; ++k) {
    std::array<std::int32_t, kDimensions> vertex;
    for (std::size_t i = 0; i < kDimensions; ++i) vertex[i] = m[i] - (rank[i] > kTop - k ? 1 : 0);
    simplex.vertex[static_cast<std::size_t>(k)] = lattice_key(vertex, k);
  }
  return true;
}

template bool embed<2>(const float*, LatticeSimplex<2>&) noexcept;
template bool embed<3>(const float*, LatticeSimplex<3>&) noexcept;
template bool embed<5>(const float*, LatticeSimplex<5>&) noexcept;
template bool embed<6>(const float*, LatticeSimplex<6>&) noexcept;

void LatticeHash::bind(rt::Slice& memory, std::size_t vertices_max) {
  TACTUS_ASSERT(vertices_max < kChainEnd);
  slots_ = memory.take<Slot>(slots_count_for(vertices_max));
  keys_ = memory.take<LatticeKey>(vertices_max);
  clear(vertices_max);
}

void LatticeHash::clear(std::size_t vertices_max) noexcept {
  TACTUS_ASSERT(vertices_max <= keys_.size());
  capacity_ = vertices_max;
  mask_ = slots_count_for(vertices_max) - 1;
  count_ = 0;
  std::fill_n(slots_.begin(), mask_ + 1, Slot{});
}

void Lattice::bind(rt::Slice& memory, int dimensions_max, std::size_t points_max, std::size_t vertices_max) {
  TACTUS_ASSERT(dimensions_max >= 2 && dimensions_max <= kLatticeDimensionsMax);
  dimensions_ = dimensions_max;
  vertices_max_ = vertices_max;
  simplices_ = memory.take<VertexWeight>(points_max * per_point());
  chains_ = memory.take<std::uint32_t>(vertices_max * per_point());
  points_count_ = 0;
  vertices_count_ = 0;
}

template <std::size_t kDimensions>
rt::Status Lattice::embed_some(std::span<const float> features, std::size_t first, std::size_t end,
                               LatticeHash& hash) noexcept {
  constexpr std::size_t kVertices = kDimensions + 1, kAhead = 16;
  VertexWeight* out = simplices_.data() + first * kVertices;
  std::array<LatticeSimplex<kDimensions>, kAhead> simplex;
  std::array<std::array<std::uint64_t, kVertices>, kAhead> hashes;
  for (; first < end; first += kAhead) {
    const std::size_t points = std::min(kAhead, end - first);
    for (std::size_t i = 0; i < points; ++i) {
      if (!embed<kDimensions>(&features[(first + i) * kDimensions], simplex[i])) return rt::Status::corrupt;
      for (std::size_t k = 0; k < kVertices; ++k) {
        hashes[i][k] = LatticeHash::hash_of(simplex[i].vertex[k]);
        hash.prefetch(hashes[i][k]);
      }
    }
    for (std::size_t i = 0; i < points; ++i)
      for (std::size_t k = 0; k < kVertices; ++k) {
        const std::uint32_t vertex = hash.insert(simplex[i].vertex[k], hashes[i][k]);
        if (vertex == kNoVertex) return rt::Status::full;
        *out++ = {vertex, simplex[i].weight[k]};
      }
  }
  return rt::Status::ok;
}

rt::Status Lattice::begin_build(int dimensions, std::size_t points_count, LatticeHash& hash) noexcept {
  TACTUS_ASSERT(dimensions == 2 || dimensions == 3 || dimensions == 5 || dimensions == 6);
  dimensions_ = dimensions;
  TACTUS_ASSERT(chains_.size() >= vertices_max_ * per_point());
  points_count_ = 0;
  vertices_count_ = 0;
  chain_begin_.fill(0);
  if (points_count * per_point() > simplices_.size()) return rt::Status::full;
  hash.clear(std::min(hash.capacity(), vertices_max_));
  points_count_ = points_count;
  return rt::Status::ok;
}

rt::Status Lattice::embed_points(std::span<const float> features, std::size_t first, std::size_t count,
                                 LatticeHash& hash) noexcept {
  const std::size_t end = first + count;
  TACTUS_ASSERT(end <= points_count_ &&
                features.size() == points_count_ * static_cast<std::size_t>(dimensions_));
  const rt::Status embedded = dimensions_ == 2   ? embed_some<2>(features, first, end, hash)
                              : dimensions_ == 3 ? embed_some<3>(features, first, end, hash)
                              : dimensions_ == 5 ? embed_some<5>(features, first, end, hash)
                                                 : embed_some<6>(features, first, end, hash);
  if (embedded != rt::Status::ok) points_count_ = 0;
  vertices_count_ = embedded == rt::Status::ok ? hash.size() : 0;
  return embedded;
}

// Rows: `next` is the neighbour against the axis; kChainEnd marks vertices that follow another.
void Lattice::link_axis(int axis, const LatticeHash& hash, std::span<std::uint32_t> next) noexcept {
  TACTUS_ASSERT(axis >= 0 && axis <= dimensions_ && next.size() >= vertices_count_);
  constexpr std::uint32_t kAhead = 32;
  std::array<LatticeKey, kAhead> neighbour;
  std::array<std::uint64_t, kAhead> hashes;
  std::fill_n(next.begin(), vertices_count_, kChainEnd - 1);
  for (std::uint32_t first = 0; first < vertices_count_; first += kAhead) {
    const std::uint32_t count_here = std::min(kAhead, vertices_count_ - first);
    for (std::uint32_t i = 0; i < count_here; ++i) {
      neighbour[i] = lattice_neighbour(hash.key(first + i), dimensions_, axis);
      hashes[i] = LatticeHash::hash_of(neighbour[i]);
      hash.prefetch(hashes[i]);
    }
    for (std::uint32_t i = 0; i < count_here; ++i) {
      const std::uint32_t before = hash.find(neighbour[i], hashes[i]);
      if (before == kNoVertex) continue;
      next[before] = (next[before] & kChainEnd) | (first + i);
      next[first + i] |= kChainEnd;
    }
  }
  std::size_t length = chain_begin_[static_cast<std::size_t>(axis)];
  for (std::uint32_t head = 0; head < vertices_count_; ++head) {
    if (next[head] >= kChainEnd - 1) continue;
    std::uint32_t v = head;
    for (std::uint32_t after; (after = next[v] & ~kChainEnd) != kChainEnd - 1; v = after)
      chains_[length++] = v;
    chains_[length++] = v | kChainEnd;
  }
  chain_begin_[static_cast<std::size_t>(axis) + 1] = length;
}

rt::Status Lattice::build(int dimensions, std::span<const float> features, LatticeHash& hash,
                          std::span<std::uint32_t> next) noexcept {
  TACTUS_ASSERT(features.size() % static_cast<std::size_t>(dimensions) == 0);
  const std::size_t count = features.size() / static_cast<std::size_t>(dimensions);
  rt::Status status = begin_build(dimensions, count, hash);
  if (status == rt::Status::ok) status = embed_points(features, 0, count, hash);
  if (status != rt::Status::ok) return status;
  for (int axis = 0; axis <= dimensions_; ++axis) link_axis(axis, hash, next);
  return rt::Status::ok;
}

void lattice_splat(const Lattice& lattice, std::span<const float> value, std::size_t first, std::size_t count,
                   std::span<float> vertices) noexcept {
  const std::size_t per_point = lattice.per_point();
  const auto simplices = lattice.simplices();
  for (std::size_t i = first; i < first + count; ++i)
    for (const VertexWeight& v : simplices.subspan(i * per_point, per_point))
      vertices[v.vertex] += v.weight * value[i];
}

void lattice_blur(const Lattice& lattice, int axis, std::span<float> vertices) noexcept {
  float before = 0;
  const auto chain = lattice.chains(axis);
  for (std::size_t k = 0; k < chain.size(); ++k) {
    float& here = vertices[chain[k] & ~kChainEnd];
    const bool is_last = (chain[k] & kChainEnd) != 0;
    const float after = is_last ? 0 : vertices[chain[k + 1] & ~kChainEnd];
    const float old = here;
    here = old + 0.5F * (before + after);
    before = is_last ? 0 : old;
  }
}

void lattice_slice(const Lattice& lattice, std::span<const float> vertices, std::size_t first,
                   std::size_t count, std::span<float> out) noexcept {
  const std::size_t per_point = lattice.per_point();
  const auto simplices = lattice.simplices();
  for (std::size_t i = first; i < first + count; ++i) {
    float sum = 0;
    for (const VertexWeight& v : simplices.subspan(i * per_point, per_point))
      sum += v.weight * vertices[v.vertex];
    out[i] = sum;
  }
}

void lattice_filter(const Lattice& lattice, std::span<const float> value, std::span<float> vertices,
                    std::span<float> out) noexcept {
  TACTUS_ASSERT(value.size() == lattice.points_count() && out.size() == value.size() &&
                vertices.size() >= lattice.vertices_count());
  std::fill_n(vertices.begin(), lattice.vertices_count(), 0.0F);
  lattice_splat(lattice, value, 0, value.size(), vertices);
  for (int axis = 0; axis <= lattice.dimensions(); ++axis) lattice_blur(lattice, axis, vertices);
  lattice_slice(lattice, vertices, 0, value.size(), out);
}

}  // namespace tactus::label
