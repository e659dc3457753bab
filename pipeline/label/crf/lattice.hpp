// The permutohedral lattice (Adams, Baek & Davis 2010): Gaussian filtering of points in 2 to 6 dimensions in
// time proportional to their number. Written from the paper, in four free pieces that can be used alone:
//
//   embed     a point -> its simplex: d+1 lattice vertices and their barycentric weights
//   key       a vertex <-> 128 bits; the neighbour along each of the d+1 lattice directions
//   hash      key -> dense vertex index, fixed capacity
//   chains    the vertices in rows along each direction, so that blurring runs in place
//
// A vertex has d+1 integer coordinates that sum to 0 and are all congruent to one remainder k modulo d+1:
// coordinate i = (d+1) m_i + k. Its neighbour along direction j is v + (d+1) e_j - (1,...,1), which takes one
// from the remainder and adds one to m_j; the key makes that two additions.
//
// splat  value[vertex] += weight * value of the point         slice  the transpose
// blur   along each direction in turn: v + (the two neighbours) / 2; a neighbour that holds no point counts 0
//
// With features divided by the bandwidth theta, splat, blur and slice come near to exp(-|f_i-f_j|^2 / 2)
// times a constant that the normalisation by degree cancels. tests/pipeline/label/crf measures how near.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/assert.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::label {

inline constexpr int kLatticeDimensionsMax = 6;

/// A lattice vertex: m_0 .. m_{d-1} in 16 bits each, biased (0-3 in `low`, 4 and 5 in `high`), and the
/// remainder in bits 32-39 of `high`. m_d follows from the sum and is not kept.
struct LatticeKey {
  std::uint64_t low = 0, high = 0;
  friend constexpr bool operator==(const LatticeKey&, const LatticeKey&) = default;
};
inline constexpr int kLatticeCoordinateBias = 32768;
/// Largest |m| that embed() gives; neighbours of neighbours stay inside 16 bits.
inline constexpr int kLatticeCoordinateMax = 32000;

constexpr LatticeKey lattice_key(std::span<const std::int32_t> m, int remainder) noexcept {
  LatticeKey key{0, static_cast<std::uint64_t>(remainder) << 32};
  for (std::size_t i = 0; i < m.size(); ++i)
    (i < 4 ? key.low : key.high) |= static_cast<std::uint64_t>(m[i] + kLatticeCoordinateBias) << (i % 4 * 16);
  return key;
}

/// The vertex one step along direction `axis` (0 to d) of the lattice of d dimensions. d + 1 steps, one along
/// each direction, come back. Phase: any. Pure.
constexpr LatticeKey lattice_neighbour(LatticeKey v, int dimensions, int axis) noexcept {
  constexpr std::uint64_t kOnes = 0x0001000100010001ULL;
  const std::uint64_t remainder_one = 1ULL << 32;
  LatticeKey n = v;
  if (axis < dimensions) (axis < 4 ? n.low : n.high) += 1ULL << (axis % 4 * 16);
  if ((v.high >> 32) != 0) return {n.low, n.high - remainder_one};
  const int low_fields = dimensions < 4 ? dimensions : 4, high_fields = dimensions - low_fields;
  n.low -= low_fields == 4 ? kOnes : kOnes & ((1ULL << (low_fields * 16)) - 1);
  n.high -= kOnes & ((1ULL << (high_fields * 16)) - 1);
  return {n.low, n.high + static_cast<std::uint64_t>(dimensions) * remainder_one};
}

/// Where a point lies in the lattice: the vertices of its simplex by remainder 0 to d, and their weights,
/// which are >= 0 (to rounding) and sum to 1.
template <std::size_t kDimensions>
struct LatticeSimplex {
  std::array<LatticeKey, kDimensions + 1> vertex;
  std::array<float, kDimensions + 1> weight;
};

/// feature: kDimensions numbers, each divided by its bandwidth. False when it is not finite or so far from 0
/// (some 10,000 bandwidths) that a coordinate leaves 16 bits. The same bits on every machine. Phase: any.
/// Pure.
template <std::size_t kDimensions>
[[nodiscard]] bool embed(const float* feature, LatticeSimplex<kDimensions>& simplex) noexcept;

extern template bool embed<2>(const float*, LatticeSimplex<2>&) noexcept;
extern template bool embed<3>(const float*, LatticeSimplex<3>&) noexcept;
extern template bool embed<5>(const float*, LatticeSimplex<5>&) noexcept;
extern template bool embed<6>(const float*, LatticeSimplex<6>&) noexcept;

inline constexpr std::uint32_t kNoVertex = 0xFFFFFFFFU;

/// Vertex keys to dense indices in order of insertion: open addressing, linear probing, at least two slots a
/// vertex; no removal. Not thread-safe.
class LatticeHash {
 public:
  static constexpr std::size_t slots_count_for(std::size_t vertices_max) {
    std::size_t slots = 16;
    while (slots < 2 * vertices_max) slots *= 2;
    return slots;
  }
  static constexpr std::size_t bytes_needed(std::size_t vertices_max) {
    return rt::bytes_of<Slot>(slots_count_for(vertices_max)) + rt::bytes_of<LatticeKey>(vertices_max);
  }
  /// Phase: boot.
  void bind(rt::Slice& memory, std::size_t vertices_max);

  /// Forgets everything and takes vertices_max (at most what was bound) as capacity. Phase: any.
  void clear(std::size_t vertices_max) noexcept;

  /// What insert() and find() look a key up by. A key's slot is rarely in cache: whoever has many keys
  /// computes their hashes some keys ahead and prefetches. Phase: any.
  static constexpr std::uint64_t hash_of(const LatticeKey& key) noexcept {
    std::uint64_t h = key.low * 0x9E3779B97F4A7C15ULL;
    h = (h ^ (h >> 32)) + key.high;
    h *= 0xBF58476D1CE4E5B9ULL;
    h = (h ^ (h >> 29)) * 0x94D049BB133111EBULL;
    return h ^ (h >> 32);
  }
  void prefetch(std::uint64_t hash) const noexcept {
    __builtin_prefetch(&slots_[static_cast<std::size_t>(hash) & mask_]);
  }

  /// The vertex's index, new or old; kNoVertex when it is new and there is no room. Phase: any.
  std::uint32_t insert(const LatticeKey& key, std::uint64_t hash) noexcept {
    const std::size_t slot = slot_of(key, hash);
    if (slots_[slot].vertex != kNoVertex) return slots_[slot].vertex;
    if (count_ == capacity_) return kNoVertex;
    keys_[count_] = key;
    slots_[slot] = {static_cast<std::uint32_t>(hash >> 32), count_};
    return count_++;
  }
  std::uint32_t insert(const LatticeKey& key) noexcept { return insert(key, hash_of(key)); }
  /// kNoVertex when it is not there. Phase: any.
  [[nodiscard]] std::uint32_t find(const LatticeKey& key, std::uint64_t hash) const noexcept {
    return slots_[slot_of(key, hash)].vertex;
  }
  [[nodiscard]] std::uint32_t find(const LatticeKey& key) const noexcept { return find(key, hash_of(key)); }
  [[nodiscard]] std::uint32_t size() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] const LatticeKey& key(std::uint32_t vertex) const noexcept { return keys_[vertex]; }

 private:
  struct Slot {
    std::uint32_t tag = 0, vertex = kNoVertex;
  };
  // Where the key is, or the free slot where it would go.
  [[nodiscard]] std::size_t slot_of(const LatticeKey& key, std::uint64_t hash) const noexcept {
    const auto tag = static_cast<std::uint32_t>(hash >> 32);
    std::size_t slot = static_cast<std::size_t>(hash) & mask_;
    while (slots_[slot].vertex != kNoVertex &&
           !(slots_[slot].tag == tag && keys_[slots_[slot].vertex] == key))
      slot = (slot + 1) & mask_;
    return slot;
  }
  std::span<Slot> slots_;
  std::span<LatticeKey> keys_;
  std::size_t mask_ = 0, capacity_ = 0;
  std::uint32_t count_ = 0;
};

/// A vertex of a point's simplex.
struct VertexWeight {
  std::uint32_t vertex = 0;
  float weight = 0;
};

/// In a chain list: the vertex is the last of its row.
inline constexpr std::uint32_t kChainEnd = 0x80000000U;

/// A point set's place in the lattice: simplices and blur chains, in fixed memory. Not thread-safe.
class Lattice {
 public:
  static constexpr std::size_t bytes_needed(int dimensions, std::size_t points_max,
                                            std::size_t vertices_max) {
    const auto d1 = static_cast<std::size_t>(dimensions) + 1;
    return rt::bytes_of<VertexWeight>(points_max * d1) + rt::bytes_of<std::uint32_t>(vertices_max * d1);
  }
  /// Phase: boot.
  void bind(rt::Slice& memory, int dimensions_max, std::size_t points_max, std::size_t vertices_max);

  /// Embeds points (`dimensions` numbers each: 2, 3, 5 or 6, divided by their bandwidths) and makes the
  /// chains. `hash` and `next` (vertices_max entries) are scratch; the hash is cleared, keeps its capacity
  /// and then the keys until somebody clears it. full: more points or vertices than bound; corrupt: a feature
  /// that embed() refuses; the lattice is empty then. About 0.4 us a point in 6 dimensions. Phase: any.
  rt::Status build(int dimensions, std::span<const float> features, LatticeHash& hash,
                   std::span<std::uint32_t> next) noexcept;

  /// build() in pieces, for whoever must not be away for long: begin_build(), embed_points() with all points
  /// piece by piece in their order, then link_axis() for the axes from 0 to d. Same arguments, same errors,
  /// same bits. Phase: any.
  rt::Status begin_build(int dimensions, std::size_t points_count, LatticeHash& hash) noexcept;
  rt::Status embed_points(std::span<const float> features, std::size_t first, std::size_t count,
                          LatticeHash& hash) noexcept;
  void link_axis(int axis, const LatticeHash& hash, std::span<std::uint32_t> next) noexcept;

  [[nodiscard]] int dimensions() const noexcept { return dimensions_; }
  [[nodiscard]] std::size_t points_count() const noexcept { return points_count_; }
  [[nodiscard]] std::uint32_t vertices_count() const noexcept { return vertices_count_; }
  /// dimensions() + 1 of each point.
  [[nodiscard]] std::span<VertexWeight> simplices() noexcept {
    return simplices_.first(points_count_ * per_point());
  }
  [[nodiscard]] std::span<const VertexWeight> simplices() const noexcept {
    return simplices_.first(points_count_ * per_point());
  }
  /// Vertices that have a neighbour along `axis` (0 to d), row after row against the direction of the axis,
  /// the last of each row with kChainEnd set. A vertex that has none is in no chain: blurring leaves it
  /// alone.
  [[nodiscard]] std::span<const std::uint32_t> chains(int axis) const noexcept {
    return chains_.subspan(
        chain_begin_[static_cast<std::size_t>(axis)],
        chain_begin_[static_cast<std::size_t>(axis) + 1] - chain_begin_[static_cast<std::size_t>(axis)]);
  }
  [[nodiscard]] std::size_t per_point() const noexcept { return static_cast<std::size_t>(dimensions_) + 1; }

 private:
  template <std::size_t kDimensions>
  rt::Status embed_some(std::span<const float> features, std::size_t first, std::size_t end,
                        LatticeHash& hash) noexcept;

  int dimensions_ = 0;
  std::size_t points_count_ = 0, vertices_max_ = 0;
  std::uint32_t vertices_count_ = 0;
  std::span<VertexWeight> simplices_;
  std::span<std::uint32_t> chains_;
  std::array<std::size_t, kLatticeDimensionsMax + 2> chain_begin_{};
};

/// Splats one value a point, blurs, slices: out_i = sum_j K_ij value_j in the order of the points and chains.
/// vertices: scratch, vertices_count(). float32. Phase: any.
void lattice_filter(const Lattice& lattice, std::span<const float> value, std::span<float> vertices,
                    std::span<float> out) noexcept;

/// Its three parts: of the points from first to first + count, of one axis. Splatting adds. Phase: any.
void lattice_splat(const Lattice& lattice, std::span<const float> value, std::size_t first, std::size_t count,
                   std::span<float> vertices) noexcept;
void lattice_blur(const Lattice& lattice, int axis, std::span<float> vertices) noexcept;
void lattice_slice(const Lattice& lattice, std::span<const float> vertices, std::size_t first,
                   std::size_t count, std::span<float> out) noexcept;

}  // namespace tactus::label
