// Mean field by lattice filtering, whatever the points' features are: the engine under the batch solver over
// surface points and the one over images (batch_crf.hpp, image_crf.hpp).
//
// Columns. Materials whose unary costs are equal at every point have equal marginals for ever under Potts, by
// symmetry, so one column stands for all of them; that is exact, and a label cell (4 materials kept, the rest
// at their mean) makes it common: the authors' cloud needs 11 columns of 23. Columns are padded to 8, 16
// or 24.
//
// Fixed point. What a vertex holds is divided by its mass (the sum of what the points put there, the same in
// every iteration because marginals sum to 1): a distribution over the columns in 1/32768. Splatting,
// blurring and slicing are then convex combinations in 16-bit fixed point, half the memory of floats, which
// is what limits the speed. The softmax is float32. Against float32 lattices the marginals of the authors'
// cloud move by 0.003 at most, 0.00002 in the mean.
//
// Change propagation. Most points settle within a few iterations, so only what changes is computed. Every
// stage of the filter keeps its values in slots:
//
//   splat slots   one a vertex                 sum of share * marginal over its points; a point that moved
//   adds the
//                                              difference, which is exact in integers
//   blur slots    one a vertex and axis along  share-weighted mean of the vertex and its neighbours in the
//   stage before;
//                 which it has a neighbour     computed again when one of the three moved
//   points        one softmax each             computed again when a slot that it slices moved
//
// A value moves when it differs by more than `settled_change` from what it was when its readers last saw it.
// With 0 the result is that of computing everything every time, bit for bit; else each stage lags by at most
// settled_change, so a message of kernel m by at most w_m (d_m + 3) settled_change. When nothing moved, mean
// field has ended.
//
// Order of sums: integers on the lattices; the softmax sums columns in a fixed tree. No libm. Hence the same
// bits on every machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/label/crf/crf.hpp"
#include "pipeline/label/crf/lattice.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::label {

inline constexpr std::size_t kCrfKernelsMax = 3;
inline constexpr std::size_t kCrfColumnsMax = 24;

/// A vertex of a point's simplex: where the point slices from, and its shares of the vertex's mass and of the
/// point's message in 1/32768. The shares of a vertex's points sum to 1 at most, and so do those of a point's
/// vertices.
struct CrfSimplexVertex {
  std::uint32_t slice_slot = 0;
  std::int16_t splat_share = 0, slice_share = 0;
};

/// A blur slot: where its vertex was before this axis, and the shares of the neighbours (the entries before
/// and after it in the list) in 1/32768; 0 at the ends of a row.
struct CrfBlurSlot {
  std::uint32_t from_slot = 0;
  std::int16_t before_share = 0, after_share = 0;
};

/// Who reads a slot: the blur slot (an index into the list) that continues its vertex, which the neighbours
/// named read, too; or, at the end, the points of a vertex.
struct CrfReader {
  static constexpr std::uint32_t kPoints = 1U << 31, kBefore = 1U << 30, kAfter = 1U << 29,
                                 kIndex = kAfter - 1;
  std::uint32_t bits = 0;
};

struct CrfField;  // what the vectorised loops work on

struct DenseCrfConfig {
  struct Kernel {
    int dimensions = 0;  ///< 2, 3, 5 or 6; 0: no such kernel
    std::size_t vertices_max = 0;
    /// Splat and blur slots, dimensions + 2 a vertex when every vertex has a neighbour along every axis. Each
    /// takes 48 bytes.
    std::size_t slots_max = 0;
  };
  std::size_t points_max = 0;
  std::array<Kernel, kCrfKernelsMax> kernel{};
};

/// What DenseCrf::continue_kernel() did.
struct CrfPiece {
  rt::Status status = rt::Status::ok;
  bool is_last = false;        ///< the kernel is there, or has failed
  std::uint64_t price_ns = 0;  ///< fixed, by what was worked on: ns on one 3.4 GHz core
};

/// Mean field over one point set at a time. Steps, in order: begin, add_kernel for each, set_unary, solve.
/// Fixed memory, no heap. Not thread-safe.
class DenseCrf {
 public:
  static std::size_t bytes_needed(const DenseCrfConfig& config);
  /// Phase: boot.
  void bind(rt::Slice& memory, const DenseCrfConfig& config);

  /// Forgets the last point set. full: more points than bound. Phase: any, as are the following.
  rt::Status begin(std::size_t points_count) noexcept;

  /// Kernel m (its place in the config) with a weight and features [point][dimensions] in bandwidths. A
  /// weight of 0 leaves it out. full or corrupt as Lattice::build(); full also when the slots do not suffice.
  rt::Status add_kernel(std::size_t m, float weight, std::span<const float> features,
                        CrfNormalisation normalisation) noexcept;
  /// add_kernel() in pieces of at most a millisecond (2048 points to embed, or one axis of the lattice), for
  /// whoever must not be away for long: begin_kernel(), then continue_kernel() until the last piece. Nothing
  /// else may be called in between, and the features stay where they are. Same errors, same bits.
  void begin_kernel(std::size_t m, float weight, std::span<const float> features,
                    CrfNormalisation normalisation) noexcept;
  CrfPiece continue_kernel() noexcept;

  /// Where the caller may write the features of a kernel before add_kernel(): points_max x 6 floats.
  [[nodiscard]] std::span<float> feature_scratch() noexcept { return features_; }

  /// Unary costs, nats; `cost(point)` gives a pointer to the 23 of a point, in the caller's own order of
  /// points.
  template <typename Cost>
  void set_unary(const CrfCompatibility& compatibility, const Cost& cost) noexcept {
    begin_columns(compatibility);
    for (std::size_t i = 0; i < points_count_ && columns_count_ < kMaterialCount; ++i) split_columns(cost(i));
    end_columns();
    for (std::size_t i = 0; i < points_count_; ++i) load_unary(i, cost(i));
  }

  /// Mean field from softmax(-unary), until nothing moved by more than settled_change or iterations_max.
  /// Below 0: everything is computed in every iteration, whatever moved; the oracle of the change
  /// propagation.
  CrfReport solve(int iterations_max, float settled_change) noexcept;

  /// The same one iteration at a time, for whoever spreads the work: start(), then iterate() until it answers
  /// 0. Between iterations single points may get new costs by change_unary(), whose effect spreads from
  /// there; false, and nothing changed, when the materials of one column would part: set_unary() and start()
  /// then. Answer: points that moved.
  std::size_t start(float settled_change) noexcept;
  std::size_t iterate() noexcept;
  [[nodiscard]] bool change_unary(std::size_t point, const float* cost_nat) noexcept;

  /// The 23 marginals of a point after solve().
  void marginals_of(std::size_t point, std::span<float, kMaterialCount> marginals) const noexcept;

  [[nodiscard]] std::size_t points_count() const noexcept { return points_count_; }
  /// Distinct columns of the unary costs (1 to 23), and to what they were padded.
  [[nodiscard]] std::size_t columns_count() const noexcept { return columns_count_; }
  [[nodiscard]] std::size_t columns_padded() const noexcept { return columns_padded_; }
  /// Lattice vertices and slots of a kernel; 0 when it is left out.
  [[nodiscard]] std::uint32_t vertices_count(std::size_t m) const noexcept {
    return kernel_[m].is_used ? kernel_[m].vertices_count : 0;
  }
  [[nodiscard]] std::size_t slots_count(std::size_t m) const noexcept {
    return kernel_[m].is_used ? kernel_[m].vertices_count + kernel_[m].axis_begin[kernel_[m].per_point()] : 0;
  }

 private:
  struct Kernel {
    int dimensions = 0;
    bool is_used = false;
    std::uint32_t vertices_count = 0;
    std::span<std::uint32_t> simplex_vertices;  // [point][dimensions + 1], which are their splat slots
    std::span<CrfSimplexVertex> simplices;      // the same
    std::span<CrfBlurSlot> blur;                // every axis after the other; slot vertices_count + k
    std::array<std::size_t, kLatticeDimensionsMax + 2> axis_begin{};
    std::span<CrfReader> readers;      // [slot]
    std::span<float> slice_scale;      // [point]
    std::span<std::int16_t> values;    // [slot][column]
    std::span<std::uint64_t> is_due;   // a bit per blur slot: something that it reads moved
    std::span<std::uint64_t> reaches;  // a bit per vertex: what its points slice moved
    [[nodiscard]] std::size_t per_point() const { return static_cast<std::size_t>(dimensions) + 1; }
  };

  /// A kernel that is being added, in the order of the work.
  enum class BuildStage : std::uint8_t {
    embed,         // points into the lattice
    link,          // its vertices into chains, axis by axis
    degree_splat,  // the degree of each point, where the normalisation asks for it
    degree_blur,
    degree_slice,
    mass,         // what the points put into each vertex
    splat_share,  // each point's part of that
    blur,         // the neighbours' shares, axis by axis
    slice_share   // each vertex's part of a point's message
  };
  struct Build {
    std::size_t kernel = 0;
    float weight = 0;
    std::span<const float> features;
    CrfNormalisation normalisation = CrfNormalisation::symmetric;
    BuildStage stage = BuildStage::embed;
    std::size_t next = 0;    // point or axis of the stage
    std::size_t length = 0;  // blur slots so far
  };

  void enter(BuildStage stage) noexcept;
  void add_splat_shares(Kernel& kernel, std::size_t first, std::size_t count) noexcept;
  void add_blur_slots(Kernel& kernel, int axis) noexcept;
  void add_slice_shares(Kernel& kernel, std::size_t first, std::size_t count) noexcept;
  void begin_columns(const CrfCompatibility& compatibility) noexcept;
  void split_columns(const float* cost_nat) noexcept;
  void end_columns() noexcept;
  void load_unary(std::size_t point, const float* cost_nat) noexcept;
  [[nodiscard]] CrfField field() noexcept;

  DenseCrfConfig config_{};
  std::size_t points_count_ = 0, columns_count_ = 0, columns_padded_ = 8;
  std::array<Kernel, kCrfKernelsMax> kernel_{};
  LatticeHash hash_;
  Lattice lattice_;  // of the kernel that is being added
  Build build_;
  std::span<std::uint32_t> scratch_;
  std::span<float> features_, unary_, marginals_, mass_, inverse_mass_, carry_;
  std::span<std::int16_t> splatted_;                              // the marginals as the lattices have them
  std::span<std::uint32_t> moved_;                                // points whose marginals are to be splatted
  std::array<std::uint8_t, kMaterialCount> column_of_{};          // material -> column
  alignas(64) std::array<float, kCrfColumnsMax> multiplicity_{};  // column -> materials it stands for
  alignas(64) std::array<float, kCrfColumnsMax * kCrfColumnsMax> cost_{};  // mu, padded; unused under Potts
  bool is_potts_ = true;
  // Of the run of mean field under way.
  std::int16_t settled_ = 0, change_max_ = 0;  // 1/32768
  bool is_first_ = true, is_unary_changed_ = false;
  std::size_t moved_count_ = 0;
};

}  // namespace tactus::label
