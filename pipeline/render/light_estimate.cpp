#include "pipeline/render/light_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/assert.hpp"

namespace tactus::render {
namespace {

constexpr int kSampleStep = 8, kNormalReach = 4, kRounds = 4;
constexpr int kBrightMax = 250, kBrightMin = 8;
constexpr std::size_t kTerms = 5;  // A, H, b
// Shares of the samples' weight with which A and H are held to the default light's part of the mean
// brightness: floor and two walls alone leave one of the five open.
constexpr double kHold = 0.01;

using Terms = std::array<double, kTerms>;

bool is_depth(float z_m) { return std::isfinite(z_m) && z_m > 0; }

/// Unit, towards the camera, optical frame; zero where the four points around are no one surface (the same
/// gap as in normals_of_depth).
Vec3f normal_at(const LightView& view, int u, int v) {
  const hal::Intrinsics& camera = view.camera;
  const auto depth = [&](int x, int y) {
    return view.depth_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                        static_cast<std::size_t>(x)];
  };
  const float z = depth(u, v);
  const auto belongs = [z](float other_m) {
    return is_depth(other_m) && std::fabs(other_m - z) <= 0.05F + 0.02F * z;
  };
  const float left = depth(u - kNormalReach, v), right = depth(u + kNormalReach, v),
              above = depth(u, v - kNormalReach), below = depth(u, v + kNormalReach);
  if (!is_depth(z) || !belongs(left) || !belongs(right) || !belongs(above) || !belongs(below)) return {};
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const float x = (static_cast<float>(u) - static_cast<float>(camera.cx)) / fx;
  const float y = (static_cast<float>(v) - static_cast<float>(camera.cy)) / fy;
  const float dx = kNormalReach / fx, dy = kNormalReach / fy;
  const Vec3f along_u = Vec3f{x + dx, y, 1} * right - Vec3f{x - dx, y, 1} * left;
  const Vec3f along_v = Vec3f{x, y + dy, 1} * below - Vec3f{x, y - dy, 1} * above;
  return along_v.cross(along_u).normalized();
}

std::size_t take_samples(const LightView& view, std::span<LightSample> samples) {
  std::size_t count = 0;
  for (int v = kNormalReach; v + kNormalReach < view.camera.height; v += kSampleStep)
    for (int u = kNormalReach; u + kNormalReach < view.camera.width; u += kSampleStep) {
      const std::uint8_t* rgb = view.video_rgb.data() + 3 * (static_cast<std::size_t>(v) *
                                                                 static_cast<std::size_t>(view.camera.width) +
                                                             static_cast<std::size_t>(u));
      const int brightest = std::max({rgb[0], rgb[1], rgb[2]});
      if (brightest > kBrightMax || brightest < kBrightMin) continue;
      const Vec3f normal = normal_at(view, u, v);
      if (normal == Vec3f{}) continue;
      const auto linear = [rgb](int channel) {
        const float part = static_cast<float>(rgb[channel]) / 255;
        return part * part;
      };
      samples[count++] = {(view.T_world_depth.rotation * normal.cast<double>()).cast<float>(),
                          {linear(0), linear(1), linear(2)}};
    }
  return count;
}

/// The harmonic mean of the eigenvalues of sum n n^T / count over 3: between a third of the smallest and the
/// smallest.
double spread_of(std::span<const LightSample> samples) {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  for (const LightSample& sample : samples) {
    const Vec3d n = sample.normal_world.cast<double>();
    xx += n.x * n.x;
    yy += n.y * n.y;
    zz += n.z * n.z;
    xy += n.x * n.y;
    xz += n.x * n.z;
    yz += n.y * n.z;
  }
  const double minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
  const double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  return minors > 0 ? determinant / minors / static_cast<double>(samples.size()) : 0;
}

Terms terms_of(const Vec3d& normal, const Vec3d& toward, bool has_side) {
  const double m = !has_side || normal.dot(toward) > 0 ? 1 : 0;
  return {1, normal.y, m * normal.x, m * normal.y, m * normal.z};
}

struct Solution {
  std::array<Terms, 3> channels{};  // r, g, b

  [[nodiscard]] double grey(const Terms& terms) const {
    double sum = 0;
    for (const Terms& channel : channels)
      for (std::size_t i = 0; i < kTerms; ++i) sum += channel[i] * terms[i];
    return sum / 3;
  }
  [[nodiscard]] Vec3d lamp(std::size_t channel) const {
    return {channels[channel][2], channels[channel][3], channels[channel][4]};
  }
  [[nodiscard]] Vec3d grey_lamp() const { return (lamp(0) + lamp(1) + lamp(2)) * (1.0 / 3); }
};

double square(double x) { return x * x; }

double grey_of(const Vec3f& color) { return static_cast<double>(color.x + color.y + color.z) / 3; }

/// Cholesky of the normal equations; false when they do not determine the terms.
bool solve(std::array<Terms, kTerms> matrix, const std::array<Terms, 3>& right, Solution& solution) {
  for (std::size_t i = 0; i < kTerms; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= matrix[i][k] * matrix[j][k];
      if (i == j && !(sum > 1e-9)) return false;
      matrix[i][j] = i == j ? std::sqrt(sum) : sum / matrix[j][j];
    }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    Terms x = right[channel];
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t k = 0; k < i; ++k) x[i] -= matrix[i][k] * x[k];
      x[i] /= matrix[i][i];
    }
    for (std::size_t i = kTerms; i-- > 0;) {
      for (std::size_t k = i + 1; k < kTerms; ++k) x[i] -= matrix[k][i] * x[k];
      x[i] /= matrix[i][i];
    }
    solution.channels[channel] = x;
  }
  return true;
}

/// One weighted least-squares fit. `scale`: relative residuals of this size weigh half; 0: all weigh alike.
bool fit_round(std::span<const LightSample> samples, const Vec3d& toward, bool has_side, double scale,
               const Vec3d& mean_color, Solution& solution) {
  std::array<Terms, kTerms> matrix{};
  std::array<Terms, 3> right{};
  double weights = 0;
  const double mean_grey = (mean_color.x + mean_color.y + mean_color.z) / 3;
  for (const LightSample& sample : samples) {
    const Terms terms = terms_of(sample.normal_world.cast<double>(), toward, has_side);
    double weight = 1;
    if (scale > 0) {
      const double expected = std::max(solution.grey(terms), 0.1 * mean_grey);
      const double off = (grey_of(sample.color) - expected) / (scale * expected);
      // What albedo does to a pixel grows with its light.
      weight = square(mean_grey / expected) / (1 + off * off);
    }
    weights += weight;
    const double color[3] = {static_cast<double>(sample.color.x), static_cast<double>(sample.color.y),
                             static_cast<double>(sample.color.z)};
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix[i][j] += weight * terms[i] * terms[j];
      for (std::size_t channel = 0; channel < 3; ++channel)
        right[channel][i] += weight * terms[i] * color[channel];
    }
  }
  constexpr Light kDefault;
  constexpr double kAmbient = static_cast<double>(kDefault.ambient_up.x + kDefault.ambient_down.x) / 2;
  constexpr double kTilt = static_cast<double>(kDefault.ambient_up.x - kDefault.ambient_down.x) / 2;
  // Half of a lamp's light, on average over surfaces that face anywhere in its half.
  constexpr double kWhole = kAmbient + static_cast<double>(kDefault.color.x) / 2;
  const double held = kHold * weights;
  const double mean[3] = {mean_color.x, mean_color.y, mean_color.z};
  matrix[0][0] += held;
  matrix[1][1] += held;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    right[channel][0] += held * mean[channel] * kAmbient / kWhole;
    right[channel][1] += held * mean[channel] * kTilt / kWhole;
  }
  return solve(matrix, right, solution);
}

double mean_relative_residual(std::span<const LightSample> samples, const Vec3d& toward, bool has_side,
                              const Solution& solution) {
  double sum = 0;
  for (const LightSample& sample : samples) {
    const double expected =
        std::max(solution.grey(terms_of(sample.normal_world.cast<double>(), toward, has_side)), 0.01);
    sum += std::fabs(grey_of(sample.color) - expected) / expected;
  }
  return sum / static_cast<double>(samples.size());
}

Light light_of(const Solution& solution, const Vec3d& toward) {
  const auto part = [](double value) {
    return static_cast<float>(std::clamp(value / static_cast<double>(kMeanAlbedo), 0.0, 4.0));
  };
  const auto of_channels = [&](auto&& value) {
    return Vec3f{part(value(0)), part(value(1)), part(value(2))};
  };
  const auto& channels = solution.channels;
  return {toward.cast<float>(), of_channels([&](std::size_t c) { return solution.lamp(c).dot(toward); }),
          of_channels([&](std::size_t c) { return std::max(channels[c][0] + channels[c][1], 0.02); }),
          of_channels([&](std::size_t c) { return std::max(channels[c][0] - channels[c][1], 0.02); })};
}

/// Turned up to kLightElevationMin above the horizon, its heading kept.
Vec3f raised(const Vec3f& toward) {
  if (toward.y >= kLightElevationMin) return toward;
  const Vec3f level{toward.x, 0, toward.z};
  const float length = level.norm();
  if (!(length > 0.01F)) return {0, 1, 0};
  const float flat = std::sqrt(1 - kLightElevationMin * kLightElevationMin);
  return Vec3f{level.x * flat / length, kLightElevationMin, level.z * flat / length};
}

/// Channels drawn to within kLightChromaMax of their mean.
Vec3f less_colored(const Vec3f& color) {
  const float grey = (color.x + color.y + color.z) / 3;
  const auto near_grey = [grey](float channel) {
    return std::clamp(channel, (1 - kLightChromaMax) * grey, (1 + kLightChromaMax) * grey);
  };
  return {near_grey(color.x), near_grey(color.y), near_grey(color.z)};
}

}  // namespace

Light believable(const Light& seen) noexcept {
  Light light;
  light.toward_world = raised(seen.toward_world);
  light.color = less_colored(seen.color);
  const auto ambient = [&](const Vec3f& color) {
    const Vec3f tamed = less_colored(color), least = light.color * kAmbientLeast;
    return Vec3f{std::max(tamed.x, least.x), std::max(tamed.y, least.y), std::max(tamed.z, least.z)};
  };
  light.ambient_up = ambient(seen.ambient_up);
  light.ambient_down = ambient(seen.ambient_down);
  return light;
}

std::size_t light_samples_max(const hal::Intrinsics& camera) {
  return (static_cast<std::size_t>(camera.width) / kSampleStep + 1) *
         (static_cast<std::size_t>(camera.height) / kSampleStep + 1);
}

rt::Status fit_light(const LightView& view, std::span<LightSample> samples, LightFit& fit) noexcept {
  const auto pixels =
      static_cast<std::size_t>(view.camera.width) * static_cast<std::size_t>(view.camera.height);
  TACTUS_ASSERT(view.video_rgb.size() == 3 * pixels && view.depth_m.size() == pixels);
  TACTUS_ASSERT(samples.size() >= light_samples_max(view.camera));
  fit = {};
  const auto taken = samples.first(take_samples(view, samples));
  fit.samples_count = static_cast<int>(taken.size());
  if (fit.samples_count < kLightSamplesMin) return rt::Status::skipped;
  fit.spread = static_cast<float>(spread_of(taken));
  if (!(fit.spread >= kLightSpreadMin)) return rt::Status::skipped;

  Vec3d mean_color;
  for (const LightSample& sample : taken) mean_color += sample.color.cast<double>();
  mean_color = mean_color * (1.0 / static_cast<double>(taken.size()));

  Solution solution;
  Vec3d toward;
  double scale = 0;
  for (int round = 0; round < kRounds; ++round) {
    const bool has_side = round > 0;
    if (!fit_round(taken, toward, has_side, scale, mean_color, solution)) return rt::Status::skipped;
    // The residuals count before the lamp's side moves: they belong to the side that was fitted.
    if (round > 0) scale = 4 * mean_relative_residual(taken, toward, has_side, solution);
    toward = solution.grey_lamp().normalized();
    if (!(toward.norm() > 0.5)) return rt::Status::skipped;
  }
  fit.light = light_of(solution, toward);
  return rt::Status::ok;
}

std::size_t LightEstimate::bytes_needed(const hal::Intrinsics& camera) {
  return rt::bytes_of<LightSample>(light_samples_max(camera));
}

void LightEstimate::bind(const hal::Intrinsics& camera, rt::Slice slice) {
  samples_ = slice.take<LightSample>(light_samples_max(camera));
}

rt::Status LightEstimate::step(const LightView& view, float interval_s) noexcept {
  LightFit fit;
  const rt::Status status = fit_light(view, samples_, fit);
  if (status != rt::Status::ok) return status;
  const float part = has_fit_ ? std::clamp(interval_s / (kLightSettleS + interval_s), 0.0F, 1.0F) : 1.0F;
  const auto draw_in = [part](Vec3f& now, const Vec3f& seen) { now += (seen - now) * part; };
  Vec3f toward = seen_.toward_world.normalized();
  draw_in(toward, fit.light.toward_world);
  if (toward.norm() > 0.01F) seen_.toward_world = toward.normalized();
  draw_in(seen_.color, fit.light.color);
  draw_in(seen_.ambient_up, fit.light.ambient_up);
  draw_in(seen_.ambient_down, fit.light.ambient_down);
  has_fit_ = true;
  light_ = believable(seen_);
  return rt::Status::ok;
}

}  // namespace tactus::render
