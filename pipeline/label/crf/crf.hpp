// The fully connected conditional random field over surface points, eqs. (2) and (3) of the paper: what its
// solvers have in common.
//
//   E(x) = sum_i psi_u(x_i) + sum_{i<j} mu(x_i, x_j) sum_m w_m k'_m(f_i, f_j)                            (2)
//   k_1 = exp(-|p_i-p_j|^2 / 2 theta_p^2)                                                    smoothness  (3)
//   k_2 = exp(-|p_i-p_j|^2 / 2 theta_pI^2 - |I_i-I_j|^2 / 2 theta_I^2)                       appearance
//   k_3 = exp(-|p_i-p_j|^2 / 2 theta_pn^2 - |n_i-n_j|^2 / 2 theta_n^2)                       surface
//
// k' is k normalised by the degree d_i = sum_j k(f_i, f_j), j = i included, since how many points stand for a
// square metre is no property of the room:
//
//   symmetric   k'(i, j) = k(i, j) / sqrt(d_i d_j)      Kraehenbuehl & Koltun 2013, sec. 4
//   per_point   k'(i, j) = k(i, j) / d_i                Kraehenbuehl & Koltun 2011 and PCL, in their programs
//
// Mean field (Kraehenbuehl & Koltun 2011, alg. 1), all points at once, from Q_i = softmax(-psi_u):
//
//   Q_i(l) <- softmax_l(-psi_u(l) - sum_l' mu(l, l') sum_m w_m sum_j k'_m(i, j) Q_j(l'))
//
// The sum over j includes j = i. In E(x) that term is mu(x_i, x_i) = 0, so the energy does not see it; in
// mean field it keeps the symmetric kernel matrix positive definite, for which the update at all points at
// once is proven never to raise the free energy (K & K 2013, sec. 3: it is the concave-convex procedure).
// Without it the parallel update can oscillate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/label/label_cell.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::label {

/// What the field is defined over: one entry per surface point (a label cell of the map). All spans have the
/// same number of points. Views; nobody may write while a solver runs.
struct CrfPoints {
  std::span<const Vec3f> position_m;
  std::span<const Rgb8> color;
  std::span<const Vec3f> normal;     ///< unit length; 0,0,0 where unknown
  std::span<const float> unary_nat;  ///< [point][23]: -ln P(material), up to a constant per point; finite

  [[nodiscard]] std::size_t size() const noexcept { return position_m.size(); }
};

/// -ln P of a label cell's 23 materials relative to its best, in nats; all 0 for a cell never observed.
/// Phase: any. Thread-safe.
void unary_costs_of(LabelWord word, std::span<float, kMaterialCount> unary_nat) noexcept;

/// mu of eq. (3): what it costs that two similar points carry materials a and b. Symmetric, 0 on the
/// diagonal.
struct CrfCompatibility {
  bool is_potts = true;  ///< 1 wherever a != b; `cost` is not looked at
  std::array<float, std::size_t{kMaterialCount} * kMaterialCount> cost{};  ///< [a][b]

  [[nodiscard]] constexpr float of(std::size_t a, std::size_t b) const noexcept {
    return is_potts ? (a == b ? 0.0F : 1.0F) : cost[a * kMaterialCount + b];
  }
};

enum class CrfNormalisation : std::uint8_t { symmetric, per_point };

/// w and theta of eq. (3), and how far mean field goes. A kernel of weight 0 is left out.
struct CrfParameters {
  struct Smoothness {
    float weight, theta_position_m;
  } smoothness;
  struct Appearance {
    float weight, theta_position_m, theta_color;  ///< colour in 0 to 255 per channel
  } appearance;
  struct Surface {
    float weight, theta_position_m, theta_normal;
  } surface;
  int iterations_max = 10;
  /// What moved by no more than this is not passed on to the next iteration, and mean field ends when nothing
  /// is. 0: exact. Below 0: exact, and everything is computed in every iteration.
  float settled_change = 0;
  CrfNormalisation normalisation = CrfNormalisation::symmetric;
  CrfCompatibility compatibility;
};

/// What the paper's authors ran (their program, cells of 1 cm: 3, 30 and 5 cells).
constexpr CrfParameters paper_crf_parameters() {
  return {.smoothness = {1.3F, 0.03F},
          .appearance = {4.0F, 0.3F, 20.0F},
          .surface = {1.0F, 0.05F, 0.1F},
          .iterations_max = 30,
          .settled_change = 0,
          .normalisation = CrfNormalisation::per_point,
          .compatibility = {}};
}

/// The product's own, fitted to the synthetic office as the built-in network labels it and checked on the
/// bedroom: fit.md. The fit leaves the surface kernel out, whose bandwidths are where it started from. Ended
/// when settled.
constexpr CrfParameters default_crf_parameters() {
  return {.smoothness = {1.1F, 0.056F},
          .appearance = {2.8F, 0.14F, 14.0F},
          .surface = {0.0F, 0.2F, 0.6F},
          .iterations_max = 15,
          .settled_change = 1e-3F,
          .normalisation = CrfNormalisation::symmetric,
          .compatibility = {}};
}

/// Whether every number can be computed with: weights finite and >= 0, bandwidths > 0, 0 to 1000 iterations,
/// compatibility finite, symmetric and 0 on the diagonal. Phase: any. Pure.
[[nodiscard]] bool is_valid(const CrfParameters& parameters) noexcept;

/// Whether the spans agree and every number in them is finite. Phase: any. Pure.
[[nodiscard]] bool is_valid(const CrfPoints& points) noexcept;

/// The most probable material of each point, the lower id when two are equal. marginals: [point][23]. Phase:
/// any. Thread-safe.
void most_probable(std::span<const float> marginals, std::span<MaterialId> labels) noexcept;

/// What a run of mean field did.
struct CrfReport {
  int iterations = 0;
  float change_max = 0;  ///< largest move of any marginal in the last iteration
  std::size_t points_updated =
      0;  ///< over all iterations, points whose marginals moved by more than settled_change
};

}  // namespace tactus::label
