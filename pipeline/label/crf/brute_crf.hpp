// The field solved with nothing approximated: float64, every pair of points. The oracle of the other solvers,
// and the energy of eq. (2).
#pragma once

#include <cstddef>
#include <span>

#include "pipeline/label/crf/crf.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::label {

inline constexpr std::size_t kBrutePointsMax = 500;

/// O(N^2) in time and memory (2 MB at 500 points). Not thread-safe.
class BruteCrf {
 public:
  static constexpr std::size_t bytes_needed(std::size_t points_max) {
    return rt::bytes_of<double>(points_max * points_max) +
           3 * rt::bytes_of<double>(points_max * kMaterialCount) + rt::bytes_of<double>(points_max);
  }
  /// points_max <= kBrutePointsMax. Phase: boot.
  void bind(rt::Slice& memory, std::size_t points_max);

  /// Fills the N x N matrix of sum_m w_m k'_m. corrupt: invalid points or parameters; full: more points than
  /// bound. Nothing else may be called unless this said ok. Phase: any.
  rt::Status prepare(const CrfPoints& points, const CrfParameters& parameters) noexcept;

  /// sum_m w_m k'_m(f_i, f_j).
  [[nodiscard]] double kernel(std::size_t i, std::size_t j) const noexcept { return kernel_[i * count_ + j]; }

  /// Mean field from softmax(-unary). marginals: [point][23]. Phase: any.
  CrfReport solve(std::span<double> marginals) noexcept;

  /// E(x) of eq. (2), nats. Where k' is not symmetric (per_point), a pair counts with the mean of its two.
  /// Phase: any.
  [[nodiscard]] double energy(std::span<const MaterialId> labels) const noexcept;

  /// What mean field descends: sum_i Q_i (unary_i + ln Q_i) + 1/2 sum_ij k'_ij Q_i' mu Q_j, nats; j = i
  /// included. Phase: any.
  [[nodiscard]] double free_energy(std::span<const double> marginals) const noexcept;

 private:
  std::span<double> kernel_, unary_, message_, previous_, degree_;
  std::size_t points_max_ = 0, count_ = 0;
  CrfParameters parameters_{};
};

/// The kernels' values before normalisation, float64. Phase: any. Pure.
[[nodiscard]] double smoothness_kernel(const CrfPoints& points, const CrfParameters& parameters,
                                       std::size_t i, std::size_t j) noexcept;
[[nodiscard]] double appearance_kernel(const CrfPoints& points, const CrfParameters& parameters,
                                       std::size_t i, std::size_t j) noexcept;
[[nodiscard]] double surface_kernel(const CrfPoints& points, const CrfParameters& parameters, std::size_t i,
                                    std::size_t j) noexcept;

/// The two sums of eq. (2), nats.
struct CrfEnergy {
  double unary_nat = 0, pairwise_nat = 0;
  [[nodiscard]] double total_nat() const { return unary_nat + pairwise_nat; }
};

/// d_i of the three kernels, [3][point], of any number of points: all pairs, O(N^2) time (60,000 points:
/// about a minute). Kernels below exp(-20) count as 0: 2e-9 a pair at most. Phase: any; not for steps.
void degrees_of(const CrfPoints& points, const CrfParameters& parameters, std::span<double> degree) noexcept;

/// E(x) of any number of points from their degrees_of(). Time and what counts as 0 as there. Phase: any; not
/// for steps.
[[nodiscard]] CrfEnergy energy_of(const CrfPoints& points, const CrfParameters& parameters,
                                  std::span<const MaterialId> labels,
                                  std::span<const double> degree) noexcept;

}  // namespace tactus::label
