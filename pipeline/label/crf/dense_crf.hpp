// Mean field by lattice filtering, whatever the points' features are: the engine under the batch solver over
// surface points and the one over images (batch_crf.hpp, image_crf.hpp).
//
// Columns. Materials whose unary costs are equal at every point have equal marginals for ever under Potts, by
// symmetry, so one column stands for all of them; that is exact, and a label cell (4 materials kept, the rest
// at their mean) makes it common: the authors' cloud needs 11 columns of 23. Columns are padded to 8, 16
// or 24.
//
// Order of sums: points along a space-filling curve chosen by the caller, vertices along chains, columns in
// lanes; the sum over columns is a fixed tree. No libm. Hence the same bits on every machine.
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

struct DenseCrfConfig {
  struct Kernel {
    int dimensions = 0;  ///< 2, 3, 5 or 6; 0: no such kernel
    std::size_t vertices_max = 0;
  };
  std::size_t points_max = 0;
  std::array<Kernel, kCrfKernelsMax> kernel{};
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
  /// weight of 0 leaves it out. full or corrupt as Lattice::build().
  rt::Status add_kernel(std::size_t m, float weight, std::span<const float> features,
                        CrfNormalisation normalisation) noexcept;
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

  /// Mean field from softmax(-unary).
  CrfReport solve(int iterations_max, float settled_change) noexcept;

  /// The 23 marginals of a point after solve().
  void marginals_of(std::size_t point, std::span<float, kMaterialCount> marginals) const noexcept;

  [[nodiscard]] std::size_t points_count() const noexcept { return points_count_; }
  /// Distinct columns of the unary costs (1 to 23), and to what they were padded.
  [[nodiscard]] std::size_t columns_count() const noexcept { return columns_count_; }
  [[nodiscard]] std::size_t columns_padded() const noexcept { return columns_padded_; }
  [[nodiscard]] const Lattice& lattice(std::size_t m) const noexcept { return kernel_[m].lattice; }

 private:
  struct Kernel {
    Lattice lattice;
    bool is_used = false;
    std::span<float> slice_scale;      // [point]
    std::span<float> values, scratch;  // [vertex][column], what is read and what is made
  };

  void begin_columns(const CrfCompatibility& compatibility) noexcept;
  void split_columns(const float* cost_nat) noexcept;
  void end_columns() noexcept;
  void load_unary(std::size_t point, const float* cost_nat) noexcept;

  DenseCrfConfig config_{};
  std::size_t points_count_ = 0, columns_count_ = 0, columns_padded_ = 8;
  std::array<Kernel, kCrfKernelsMax> kernel_{};
  LatticeHash hash_;
  std::span<std::uint32_t> next_;
  std::span<float> features_, unary_, marginals_;
  std::array<std::uint8_t, kMaterialCount> column_of_{};  // material -> column
  alignas(
      64) std::array<float, kCrfColumnsMax> multiplicity_{};  // column -> how many materials it stands for
  alignas(64) std::array<float, kCrfColumnsMax * kCrfColumnsMax> cost_{};  // mu, padded; unused under Potts
  bool is_potts_ = true;
};

}  // namespace tactus::label
