#include <cmath>

#include "pipeline/track/icp.hpp"

namespace tactus::track {
namespace {

using Matrix6 = std::array<std::array<double, 6>, 6>;

// Cyclic Jacobi (Golub & Van Loan 8.5): eigenvalues on the diagonal of `a`, eigenvectors in the columns of
// `v`. A fixed number of sweeps: six times six converges quadratically, and the operations are the same on
// every machine.
void diagonalize(Matrix6& a, Matrix6& v) {
  constexpr int kSweeps = 10;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) v[i][j] = i == j ? 1.0 : 0.0;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t p = 0; p < 5; ++p)
      for (std::size_t q = p + 1; q < 6; ++q) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta >= 0 ? 1.0 : -1.0) / (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
        for (std::size_t k = 0; k < 6; ++k) {
          const double akp = a[k][p], akq = a[k][q];
          a[k][p] = c * akp - s * akq;
          a[k][q] = s * akp + c * akq;
        }
        for (std::size_t k = 0; k < 6; ++k) {
          const double apk = a[p][k], aqk = a[q][k];
          a[p][k] = c * apk - s * aqk;
          a[q][k] = s * apk + c * aqk;
        }
        for (std::size_t k = 0; k < 6; ++k) {
          const double vkp = v[k][p], vkq = v[k][q];
          v[k][p] = c * vkp - s * vkq;
          v[k][q] = s * vkp + c * vkq;
        }
      }
}

}  // namespace

void icp_add(IcpSums& sum, const IcpSums& part) noexcept {
  for (std::size_t i = 0; i < sum.h.size(); ++i) sum.h[i] += part.h[i];
  for (std::size_t i = 0; i < sum.b.size(); ++i) sum.b[i] += part.b[i];
  sum.weighted_residual2 += part.weighted_residual2;
  sum.weight += part.weight;
  sum.inliers_count += part.inliers_count;
  sum.candidates_count += part.candidates_count;
  sum.model_count += part.model_count;
}

IcpStep icp_solve(const IcpSums& sums, double lever_m, double information_min) noexcept {
  IcpStep step;
  if (!(sums.weight > 0)) {
    step.held_count = 6;
    return step;
  }
  // In units where a unit of turning moves a point at the lever by a metre: all six are then comparable.
  const double scale[6] = {1 / lever_m, 1 / lever_m, 1 / lever_m, 1, 1, 1};
  Matrix6 a, v;
  std::size_t k = 0;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i; j < 6; ++j) a[i][j] = a[j][i] = sums.h[k++] * scale[i] * scale[j] / sums.weight;
  diagonalize(a, v);
  for (std::size_t e = 0; e < 6; ++e) {
    step.information[e] = a[e][e];
    if (!(a[e][e] >= information_min)) {
      ++step.held_count;
      continue;
    }
    double projection = 0;
    for (std::size_t i = 0; i < 6; ++i) projection += v[i][e] * (sums.b[i] * scale[i] / sums.weight);
    for (std::size_t i = 0; i < 6; ++i) step.increment[i] -= v[i][e] * projection / a[e][e] * scale[i];
  }
  for (std::size_t i = 0; i < 6; ++i)  // falling order: six values
    for (std::size_t j = i + 1; j < 6; ++j)
      if (step.information[j] > step.information[i]) std::swap(step.information[i], step.information[j]);
  return step;
}

T_ViewLive icp_apply(const T_ViewLive& T_view_live, const std::array<double, 6>& increment,
                     double pivot_z_m) noexcept {
  const Quaternion turn = Quaternion{1.0, increment[0] / 2, increment[1] / 2, increment[2] / 2}.normalized();
  const Rotation r = Rotation::from(turn);
  const Vec3d pivot{0, 0, pivot_z_m};
  const Vec3d shift{increment[3], increment[4], increment[5]};
  const T_ViewLive moved{r * T_view_live.rotation, r * (T_view_live.translation - pivot) + pivot + shift};
  return moved.orthonormalized();
}

}  // namespace tactus::track
