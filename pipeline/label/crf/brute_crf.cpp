#include "pipeline/label/crf/brute_crf.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/label/cost_tables.hpp"
#include "rt/assert.hpp"

namespace tactus::label {
namespace {

constexpr std::size_t kKernels = 3;

double squared(double v) { return v * v; }
double distance_squared(const Vec3f& a, const Vec3f& b) {
  const Vec3d d = a.cast<double>() - b.cast<double>();
  return d.dot(d);
}
double color_distance_squared(Rgb8 a, Rgb8 b) {
  return squared(a.r - b.r) + squared(a.g - b.g) + squared(a.b - b.b);
}
double gaussian_exponent(double distance_squared_value, float theta) {
  return distance_squared_value / (2 * squared(static_cast<double>(theta)));
}

std::array<double, kKernels> exponents(const CrfPoints& points, const CrfParameters& p, std::size_t i,
                                       std::size_t j) {
  const double position = distance_squared(points.position_m[i], points.position_m[j]);
  return {
      gaussian_exponent(position, p.smoothness.theta_position_m),
      gaussian_exponent(position, p.appearance.theta_position_m) +
          gaussian_exponent(color_distance_squared(points.color[i], points.color[j]),
                            p.appearance.theta_color),
      gaussian_exponent(position, p.surface.theta_position_m) +
          gaussian_exponent(distance_squared(points.normal[i], points.normal[j]), p.surface.theta_normal)};
}
// Beside a point's own 1 in its degree, less than this is below float64's last bit.
double gaussian(double exponent) { return exponent > 45 ? 0 : exp_of(-exponent); }

std::array<double, kKernels> weights(const CrfParameters& p) {
  return {static_cast<double>(p.smoothness.weight), static_cast<double>(p.appearance.weight),
          static_cast<double>(p.surface.weight)};
}
// Of a pair whose kernel is 1: (k'(i, j) + k'(j, i)) / 2.
double normaliser(CrfNormalisation normalisation, double degree_i, double degree_j) {
  return normalisation == CrfNormalisation::symmetric ? 1 / std::sqrt(degree_i * degree_j)
                                                      : 0.5 / degree_i + 0.5 / degree_j;
}

// Of clouds too large for a matrix: a kernel below exp(-20) counts as 0, and so do all three from this
// distance on.
constexpr double kExponentMax = 20;
float reach_squared_of(const CrfParameters& p) {
  const float theta =
      std::max({p.smoothness.theta_position_m, p.appearance.theta_position_m, p.surface.theta_position_m});
  return static_cast<float>(2 * kExponentMax * squared(static_cast<double>(theta)));
}
bool is_out_of_reach(const CrfPoints& points, std::size_t i, std::size_t j, float reach_squared) {
  const Vec3f d = points.position_m[i] - points.position_m[j];
  return d.dot(d) > reach_squared;
}

// ln p for p in 0 .. 1; p ln p is 0 at 0, so what it gives there does not matter.
double ln_of_probability(double p) {
  double shift = 0;
  while (p < 0.01 && p > 1e-300) {
    p *= 100;
    shift += 1;
  }
  return p > 1e-300 ? ln_of(p) - shift * 4.605170185988092 : 0;
}

}  // namespace

double smoothness_kernel(const CrfPoints& points, const CrfParameters& p, std::size_t i,
                         std::size_t j) noexcept {
  return exp_of(-exponents(points, p, i, j)[0]);
}
double appearance_kernel(const CrfPoints& points, const CrfParameters& p, std::size_t i,
                         std::size_t j) noexcept {
  return exp_of(-exponents(points, p, i, j)[1]);
}
double surface_kernel(const CrfPoints& points, const CrfParameters& p, std::size_t i,
                      std::size_t j) noexcept {
  return exp_of(-exponents(points, p, i, j)[2]);
}

void BruteCrf::bind(rt::Slice& memory, std::size_t points_max) {
  TACTUS_ASSERT(points_max <= kBrutePointsMax);
  points_max_ = points_max;
  kernel_ = memory.take<double>(points_max * points_max);
  unary_ = memory.take<double>(points_max * kMaterialCount);
  message_ = memory.take<double>(points_max * kMaterialCount);
  previous_ = memory.take<double>(points_max * kMaterialCount);
  degree_ = memory.take<double>(points_max);
}

rt::Status BruteCrf::prepare(const CrfPoints& points, const CrfParameters& parameters) noexcept {
  count_ = 0;
  if (!is_valid(points) || !is_valid(parameters)) return rt::Status::corrupt;
  if (points.size() > points_max_) return rt::Status::full;
  count_ = points.size();
  parameters_ = parameters;
  std::copy(points.unary_nat.begin(), points.unary_nat.end(), unary_.begin());
  std::fill_n(kernel_.begin(), count_ * count_, 0.0);
  const std::array<double, kKernels> weight = weights(parameters);
  for (std::size_t m = 0; m < kKernels; ++m) {
    if (weight[m] == 0) continue;
    for (std::size_t i = 0; i < count_; ++i) {
      degree_[i] = 0;
      for (std::size_t j = 0; j < count_; ++j) degree_[i] += gaussian(exponents(points, parameters, i, j)[m]);
    }
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t j = 0; j < count_; ++j) {
        const double k = gaussian(exponents(points, parameters, i, j)[m]);
        const double norm = parameters.normalisation == CrfNormalisation::symmetric
                                ? std::sqrt(degree_[i] * degree_[j])
                                : degree_[i];
        kernel_[i * count_ + j] += weight[m] * k / norm;
      }
  }
  return rt::Status::ok;
}

CrfReport BruteCrf::solve(std::span<double> marginals) noexcept {
  TACTUS_ASSERT(marginals.size() == count_ * kMaterialCount);
  const auto softmax = [&](std::size_t i) {  // of message_ into marginals
    const double* const x = &message_[i * kMaterialCount];
    double* const q = &marginals[i * kMaterialCount];
    const double most = *std::max_element(x, x + kMaterialCount);
    double sum = 0;
    for (std::size_t l = 0; l < kMaterialCount; ++l) sum += q[l] = exp_of(std::max(x[l] - most, -700.0));
    for (std::size_t l = 0; l < kMaterialCount; ++l) q[l] /= sum;
  };
  for (std::size_t k = 0; k < count_ * kMaterialCount; ++k) message_[k] = -unary_[k];
  for (std::size_t i = 0; i < count_; ++i) softmax(i);
  CrfReport report;
  for (; report.iterations < parameters_.iterations_max; ++report.iterations) {
    std::copy(marginals.begin(), marginals.end(), previous_.begin());
    for (std::size_t i = 0; i < count_; ++i) {
      std::array<double, kMaterialCount> filtered{};
      for (std::size_t j = 0; j < count_; ++j)
        for (std::size_t l = 0; l < kMaterialCount; ++l)
          filtered[l] += kernel_[i * count_ + j] * previous_[j * kMaterialCount + l];
      for (std::size_t a = 0; a < kMaterialCount; ++a) {
        double cost = unary_[i * kMaterialCount + a];
        for (std::size_t b = 0; b < kMaterialCount; ++b)
          cost += static_cast<double>(parameters_.compatibility.of(a, b)) * filtered[b];
        message_[i * kMaterialCount + a] = -cost;
      }
      softmax(i);
    }
    double change = 0;
    for (std::size_t k = 0; k < marginals.size(); ++k)
      change = std::max(change, std::fabs(marginals[k] - previous_[k]));
    report.change_max = static_cast<float>(change);
    if (change < static_cast<double>(parameters_.settled_change)) {
      ++report.iterations;
      break;
    }
  }
  return report;
}

double BruteCrf::energy(std::span<const MaterialId> labels) const noexcept {
  TACTUS_ASSERT(labels.size() == count_);
  double sum = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    sum += unary_[i * kMaterialCount + labels[i]];
    for (std::size_t j = i + 1; j < count_; ++j)
      sum += 0.5 * (kernel_[i * count_ + j] + kernel_[j * count_ + i]) *
             static_cast<double>(parameters_.compatibility.of(labels[i], labels[j]));
  }
  return sum;
}

double BruteCrf::free_energy(std::span<const double> marginals) const noexcept {
  TACTUS_ASSERT(marginals.size() == count_ * kMaterialCount);
  double sum = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    std::array<double, kMaterialCount> filtered{};
    for (std::size_t j = 0; j < count_; ++j)
      for (std::size_t l = 0; l < kMaterialCount; ++l)
        filtered[l] += kernel_[i * count_ + j] * marginals[j * kMaterialCount + l];
    for (std::size_t a = 0; a < kMaterialCount; ++a) {
      const double q = marginals[i * kMaterialCount + a];
      double cost = 0;
      for (std::size_t b = 0; b < kMaterialCount; ++b)
        cost += static_cast<double>(parameters_.compatibility.of(a, b)) * filtered[b];
      sum += q * (unary_[i * kMaterialCount + a] + ln_of_probability(q) + 0.5 * cost);
    }
  }
  return sum;
}

void degrees_of(const CrfPoints& points, const CrfParameters& parameters, std::span<double> degree) noexcept {
  const std::size_t n = points.size();
  TACTUS_ASSERT(degree.size() == kKernels * n);
  const float reach_squared = reach_squared_of(parameters);
  std::fill(degree.begin(), degree.end(), 1.0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      if (is_out_of_reach(points, i, j, reach_squared)) continue;
      const auto exponent = exponents(points, parameters, i, j);
      for (std::size_t m = 0; m < kKernels; ++m) {
        if (exponent[m] > kExponentMax) continue;
        const double k = exp_of(-exponent[m]);
        degree[m * n + i] += k;
        degree[m * n + j] += k;
      }
    }
}

CrfEnergy energy_of(const CrfPoints& points, const CrfParameters& parameters,
                    std::span<const MaterialId> labels, std::span<const double> degree) noexcept {
  const std::size_t n = points.size();
  TACTUS_ASSERT(labels.size() == n && degree.size() == kKernels * n);
  const std::array<double, kKernels> weight = weights(parameters);
  const float reach_squared = reach_squared_of(parameters);
  CrfEnergy energy;
  for (std::size_t i = 0; i < n; ++i) {
    energy.unary_nat += static_cast<double>(points.unary_nat[i * kMaterialCount + labels[i]]);
    for (std::size_t j = i + 1; j < n; ++j) {
      const auto cost = static_cast<double>(parameters.compatibility.of(labels[i], labels[j]));
      if (cost == 0 || is_out_of_reach(points, i, j, reach_squared)) continue;
      const auto exponent = exponents(points, parameters, i, j);
      for (std::size_t m = 0; m < kKernels; ++m)
        if (exponent[m] <= kExponentMax)
          energy.pairwise_nat += cost * weight[m] * exp_of(-exponent[m]) *
                                 normaliser(parameters.normalisation, degree[m * n + i], degree[m * n + j]);
    }
  }
  return energy;
}

}  // namespace tactus::label
