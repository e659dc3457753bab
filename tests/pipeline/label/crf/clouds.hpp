// Clouds of surface points with known labels, for the tests of the CRF solvers.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <random>
#include <vector>

#include "pipeline/label/crf/crf.hpp"
#include "rt/slice.hpp"

namespace tactus::label::test {

/// Cache-line aligned memory for a Slice.
class Memory {
 public:
  explicit Memory(std::size_t bytes)
      : bytes_(rt::round_up(bytes, rt::kCacheLineBytes)),
        data_(static_cast<std::byte*>(::operator new (bytes_ + 1, std::align_val_t{rt::kCacheLineBytes}))) {}
  ~Memory() { ::operator delete (data_, std::align_val_t{rt::kCacheLineBytes}); }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  [[nodiscard]] rt::Slice slice() const { return rt::Slice({data_, bytes_}); }

 private:
  std::size_t bytes_;
  std::byte* data_;
};

/// A cloud that owns its points.
struct Cloud {
  std::vector<Vec3f> position_m, normal;
  std::vector<Rgb8> color;
  std::vector<float> unary_nat;
  std::vector<MaterialId> truth;

  [[nodiscard]] std::size_t size() const { return position_m.size(); }
  [[nodiscard]] CrfPoints points() const { return {position_m, color, normal, unary_nat}; }

  void add(Vec3f at, Rgb8 rgb, Vec3f n, MaterialId label) {
    position_m.push_back(at);
    color.push_back(rgb);
    normal.push_back(n);
    truth.push_back(label);
  }
};

/// -ln of: `share` on `said`, the rest equally on the others.
inline void say(Cloud& cloud, MaterialId said, double share) {
  for (int l = 0; l < kMaterialCount; ++l)
    cloud.unary_nat.push_back(
        static_cast<float>(-std::log(l == said ? share : (1 - share) / (kMaterialCount - 1))));
}

inline std::uint8_t to_byte(double v) {
  return static_cast<std::uint8_t>(std::lround(std::fmin(255, std::fmax(0, v))));
}

/// All three kernels of eq. (3), none narrower than the clouds are dense.
constexpr CrfParameters three_kernels() {
  CrfParameters p = default_crf_parameters();
  p.smoothness = {1.0F, 0.08F};
  p.appearance = {2.0F, 0.2F, 20.0F};
  p.surface = {2.0F, 0.2F, 0.6F};
  return p;
}

/// Anything anywhere: positions in a box, any colour, any normal, any distribution.
inline Cloud random_cloud(std::uint32_t seed, std::size_t count, double side_m) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> g;
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f at{static_cast<float>(side_m * u(random)), static_cast<float>(side_m * u(random)),
                   static_cast<float>(side_m * u(random))};
    const Vec3f n =
        Vec3f{static_cast<float>(g(random)), static_cast<float>(g(random)), static_cast<float>(g(random))}
            .normalized();
    cloud.add(at, {to_byte(255 * u(random)), to_byte(255 * u(random)), to_byte(255 * u(random))}, n,
              static_cast<MaterialId>(random() % kMaterialCount));
    for (int l = 0; l < kMaterialCount; ++l) cloud.unary_nat.push_back(static_cast<float>(3 * u(random)));
  }
  return cloud;
}

/// A corner of a room on a grid of `step_m`: floor, two walls, and a patch on one wall; each surface with its
/// material, colour and normal, with noise, and labels that are wrong at `wrong_share` of the points.
inline Cloud corner_cloud(std::uint32_t seed, int steps, double step_m, double wrong_share,
                          double said_share = 0.6, double normal_noise = 0.05) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> g;
  constexpr std::array<MaterialId, 4> kLabel{22, 12, 12, 6};
  constexpr std::array<Rgb8, 4> kColor{Rgb8{150, 100, 60}, Rgb8{200, 200, 190}, Rgb8{205, 195, 190},
                                       Rgb8{60, 120, 90}};
  Cloud cloud;
  const auto noisy = [&](Vec3f n) {
    const Vec3f e{static_cast<float>(normal_noise * g(random)), static_cast<float>(normal_noise * g(random)),
                  static_cast<float>(normal_noise * g(random))};
    return (n + e).normalized();
  };
  for (int plane = 0; plane < 3; ++plane)
    for (int a = 0; a < steps; ++a)
      for (int b = 0; b < steps; ++b) {
        const auto s = static_cast<float>(a * step_m), t = static_cast<float>(b * step_m);
        const Vec3f at = plane == 0 ? Vec3f{s, 0, t} : plane == 1 ? Vec3f{s, t, 0} : Vec3f{0, s, t};
        const Vec3f n = plane == 0 ? Vec3f{0, 1, 0} : plane == 1 ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0};
        const bool in_patch =
            plane == 1 && 3 * a >= steps && 3 * a < 2 * steps && 3 * b >= steps && 3 * b < 2 * steps;
        const auto k = static_cast<std::size_t>(in_patch ? 3 : plane);
        const Rgb8 c = kColor[k];
        cloud.add(at,
                  {to_byte(c.r + 6 * g(random)), to_byte(c.g + 6 * g(random)), to_byte(c.b + 6 * g(random))},
                  noisy(n), kLabel[k]);
        const MaterialId said =
            u(random) < wrong_share ? static_cast<MaterialId>(random() % kMaterialCount) : kLabel[k];
        say(cloud, said, said_share);
      }
  return cloud;
}

/// How far two sets of marginals are apart.
struct Difference {
  double mean = 0, largest = 0, same_winner_share = 0;
};
template <typename A, typename B>
Difference compare(const A& a, const B& b) {
  Difference d;
  const std::size_t count = a.size() / kMaterialCount;
  std::size_t same = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t best_a = 0, best_b = 0;
    for (std::size_t l = 0; l < kMaterialCount; ++l) {
      const std::size_t k = i * kMaterialCount + l;
      const double e = std::fabs(static_cast<double>(a[k]) - static_cast<double>(b[k]));
      d.mean += e / static_cast<double>(count) / 2;  // total variation distance
      d.largest = std::fmax(d.largest, e);
      if (a[k] > a[i * kMaterialCount + best_a]) best_a = l;
      if (b[k] > b[i * kMaterialCount + best_b]) best_b = l;
    }
    same += best_a == best_b;
  }
  d.same_winner_share = count == 0 ? 1 : static_cast<double>(same) / static_cast<double>(count);
  return d;
}

}  // namespace tactus::label::test
