#include "pipeline/label/crf/lattice.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

// Coordinates of a key, all d + 1.
std::vector<long> coordinates(const LatticeKey& key, int dimensions) {
  std::vector<long> c;
  const long k = static_cast<long>(key.high >> 32);
  long sum = 0;
  for (int i = 0; i < dimensions; ++i) {
    const auto field = static_cast<long>(((i < 4 ? key.low : key.high) >> (i % 4 * 16)) & 0xFFFF);
    c.push_back((dimensions + 1) * (field - kLatticeCoordinateBias) + k);
    sum += c.back();
  }
  c.push_back(-sum);
  return c;
}

// The plane's coordinates of a point, in float64 and straight from the basis in the paper.
std::vector<double> elevate(const std::vector<double>& f) {
  const int d = static_cast<int>(f.size());
  std::vector<double> e(f.size() + 1, 0.0);
  const double unit = (d + 1) * std::sqrt(2.0 / 3.0);
  for (int i = 0; i < d; ++i) {
    const double length = std::sqrt((i + 1.0) * (i + 2.0));
    for (int j = 0; j <= i; ++j)
      e[static_cast<std::size_t>(j)] += f[static_cast<std::size_t>(i)] * unit / length;
    e[static_cast<std::size_t>(i) + 1] -= f[static_cast<std::size_t>(i)] * unit * (i + 1) / length;
  }
  return e;
}

template <std::size_t kDimensions>
void expect_simplex_holds_point(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> g(0, 20);
  constexpr int kD = static_cast<int>(kDimensions);
  for (int i = 0; i < 2000; ++i) {
    std::array<float, kDimensions> f;
    for (float& v : f) v = g(random);
    LatticeSimplex<kDimensions> sut;
    ASSERT_TRUE(embed<kDimensions>(f.data(), sut));
    const std::vector<double> at = elevate(std::vector<double>(f.begin(), f.end()));
    std::vector<double> mixed(at.size(), 0.0);
    double sum = 0;
    for (std::size_t k = 0; k <= kDimensions; ++k) {
      ASSERT_GE(sut.weight[k], -2e-4F) << "seed " << seed;
      sum += static_cast<double>(sut.weight[k]);
      const auto vertex = coordinates(sut.vertex[k], kD);
      for (std::size_t j = 0; j <= kDimensions; ++j) {
        ASSERT_EQ(((vertex[j] - static_cast<long>(k)) % (kD + 1) + kD + 1) % (kD + 1), 0)
            << "coordinates of vertex " << k << " are congruent to it";
        mixed[j] += static_cast<double>(sut.weight[k]) * static_cast<double>(vertex[j]);
      }
    }
    ASSERT_NEAR(sum, 1, 1e-5);
    for (std::size_t j = 0; j <= kDimensions; ++j) ASSERT_NEAR(mixed[j], at[j], 2e-3) << "seed " << seed;
  }
}

TEST(LatticeEmbed, WeightedVerticesOfTheSimplexGiveThePointBack) {
  expect_simplex_holds_point<2>(11);
  expect_simplex_holds_point<3>(12);
  expect_simplex_holds_point<5>(13);
  expect_simplex_holds_point<6>(14);
}

TEST(LatticeEmbed, FarAndUndefinedFeaturesAreRefused) {
  LatticeSimplex<3> simplex;
  const std::array<float, 3> far{1e6F, 0, 0}, nan{0, std::numeric_limits<float>::quiet_NaN(), 0},
      near{9000.0F, -9000.0F, 9000.0F};
  EXPECT_FALSE(embed<3>(far.data(), simplex));
  EXPECT_FALSE(embed<3>(nan.data(), simplex));
  EXPECT_TRUE(embed<3>(near.data(), simplex));
}

TEST(LatticeKey, NeighbourAddsTheDirectionAndOneStepEachWayComesBack) {
  std::mt19937 random(21);
  for (const int d : {2, 3, 5, 6}) {
    for (int i = 0; i < 500; ++i) {
      std::vector<std::int32_t> m(static_cast<std::size_t>(d));
      for (auto& v : m)
        v = std::uniform_int_distribution<std::int32_t>(-kLatticeCoordinateMax,
                                                        kLatticeCoordinateMax)(random);
      const LatticeKey key = lattice_key(m, static_cast<int>(random() % static_cast<unsigned>(d + 1)));
      const auto from = coordinates(key, d);
      LatticeKey round = key;
      for (int axis = 0; axis <= d; ++axis) {
        const auto to = coordinates(lattice_neighbour(key, d, axis), d);
        for (int j = 0; j <= d; ++j)
          ASSERT_EQ(to[static_cast<std::size_t>(j)] - from[static_cast<std::size_t>(j)], j == axis ? d : -1)
              << "d " << d << " axis " << axis;
        round = lattice_neighbour(round, d, axis);
      }
      ASSERT_EQ(round, key);
    }
  }
}

TEST(LatticeHash, FindsWhatWasInsertedAndRefusesWhenFull) {
  constexpr std::size_t kMax = 1000;
  const Memory memory(LatticeHash::bytes_needed(kMax));
  rt::Slice slice = memory.slice();
  LatticeHash sut;
  sut.bind(slice, kMax);
  const auto key_of = [](int i) {
    const std::array<std::int32_t, 3> m{i % 10, i / 10 % 10, i / 100};
    return lattice_key(m, i % 4);
  };
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(sut.insert(key_of(i)), static_cast<std::uint32_t>(i));
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(sut.insert(key_of(i)), static_cast<std::uint32_t>(i)) << "old vertices need no room";
    ASSERT_EQ(sut.find(key_of(i)), static_cast<std::uint32_t>(i));
    ASSERT_EQ(sut.key(static_cast<std::uint32_t>(i)), key_of(i));
  }
  EXPECT_EQ(sut.insert(key_of(1000)), kNoVertex);
  EXPECT_EQ(sut.find(key_of(1000)), kNoVertex);
  sut.clear(10);
  EXPECT_EQ(sut.find(key_of(5)), kNoVertex);
  EXPECT_EQ(sut.capacity(), 10U);
}

struct Built {
  Built(int dimensions, std::size_t points, std::size_t vertices)
      : memory(Lattice::bytes_needed(dimensions, points, vertices) + LatticeHash::bytes_needed(vertices) +
               rt::bytes_of<std::uint32_t>(vertices)) {
    rt::Slice slice = memory.slice();
    lattice.bind(slice, dimensions, points, vertices);
    hash.bind(slice, vertices);
    next = slice.take<std::uint32_t>(vertices);
  }
  Memory memory;
  Lattice lattice;
  LatticeHash hash;
  std::span<std::uint32_t> next;
};

std::vector<float> random_features(std::uint32_t seed, std::size_t count, int dimensions, double side) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, side);
  std::vector<float> f(count * static_cast<std::size_t>(dimensions));
  for (float& v : f) v = static_cast<float>(u(random));
  return f;
}

TEST(Lattice, ChainsHoldEveryNeighbourPairOfEachAxisOnce) {
  for (const int d : {2, 3, 5, 6}) {
    const auto f = random_features(31, 300, d, 3);
    Built sut(d, 300, 300U * static_cast<unsigned>(d + 1));
    ASSERT_EQ(sut.lattice.build(d, f, sut.hash, sut.next), rt::Status::ok);
    for (int axis = 0; axis <= d; ++axis) {
      std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
      for (std::uint32_t v = 0; v < sut.hash.size(); ++v) {
        const std::uint32_t n = sut.hash.find(lattice_neighbour(sut.hash.key(v), d, axis));
        if (n != kNoVertex) expected.insert({n, v});
      }
      const auto chain = sut.lattice.chains(axis);
      for (std::size_t k = 0; k + 1 < chain.size(); ++k)
        if ((chain[k] & kChainEnd) == 0) found.insert({chain[k], chain[k + 1] & ~kChainEnd});
      EXPECT_EQ(found, expected) << "d " << d << " axis " << axis;
      EXPECT_GT(found.size(), 10U);
    }
  }
}

TEST(Lattice, TooManyPointsOrVerticesAreFullAndLeaveItEmpty) {
  const auto f = random_features(41, 100, 3, 50);
  Built few_vertices(3, 100, 20), few_points(3, 99, 400), enough(3, 100, 400);
  EXPECT_EQ(few_vertices.lattice.build(3, f, few_vertices.hash, few_vertices.next), rt::Status::full);
  EXPECT_EQ(few_vertices.lattice.points_count(), 0U);
  EXPECT_EQ(few_vertices.lattice.vertices_count(), 0U);
  EXPECT_EQ(few_points.lattice.build(3, f, few_points.hash, few_points.next), rt::Status::full);
  EXPECT_EQ(enough.lattice.build(3, f, enough.hash, enough.next), rt::Status::ok);
  EXPECT_EQ(enough.lattice.points_count(), 100U);
}

// Weighted mean of the values at all points, by lattice and directly: the constant in front cancels, as in
// the CRF.
struct FilterError {
  double rms = 0, largest = 0;
};
FilterError filter_error(std::uint32_t seed, int dimensions, std::size_t count, double side) {
  const auto d = static_cast<std::size_t>(dimensions);
  const auto f = random_features(seed, count, dimensions, side);
  std::mt19937 random(seed + 1);
  std::vector<float> value(count), ones(count, 1.0F), out(count), degree(count);
  for (std::size_t i = 0; i < count; ++i)  // a step across space, and noise on it
    value[i] = (f[i * d] > static_cast<float>(side) / 2 ? 0.8F : 0.2F) +
               std::uniform_real_distribution<float>(-0.2F, 0.2F)(random);
  Built sut(dimensions, count, count * (d + 1));
  EXPECT_EQ(sut.lattice.build(dimensions, f, sut.hash, sut.next), rt::Status::ok);
  std::vector<float> scratch(sut.lattice.vertices_count());
  lattice_filter(sut.lattice, value, scratch, out);
  lattice_filter(sut.lattice, ones, scratch, degree);
  FilterError error;
  for (std::size_t i = 0; i < count; ++i) {
    double sum = 0, total = 0;
    for (std::size_t j = 0; j < count; ++j) {
      double r = 0;
      for (std::size_t k = 0; k < d; ++k) {
        const double e = static_cast<double>(f[i * d + k]) - static_cast<double>(f[j * d + k]);
        r += e * e;
      }
      const double w = std::exp(-r / 2);
      sum += w * static_cast<double>(value[j]);
      total += w;
    }
    const double e = std::fabs(static_cast<double>(out[i] / degree[i]) - sum / total);
    error.rms += e * e / static_cast<double>(count);
    error.largest = std::fmax(error.largest, e);
  }
  error.rms = std::sqrt(error.rms);
  std::printf(
      "lattice filter, d %d, %zu points in %.0f bandwidths, %u vertices, seed %u: rms %.4f, largest %.4f\n",
      dimensions, count, side, sut.lattice.vertices_count(), seed, error.rms, error.largest);
  return error;
}

TEST(LatticeFilter, WeightedMeansComeNearToTheDirectGaussian) {
  for (const std::uint32_t seed : {51U, 52U}) {
    const FilterError dense2 = filter_error(seed, 2, 2000, 12), dense3 = filter_error(seed, 3, 4000, 8),
                      dense5 = filter_error(seed, 5, 4000, 4), dense6 = filter_error(seed, 6, 4000, 3),
                      sparse6 = filter_error(seed, 6, 2000, 8);
    // Values spread over 0.8. In 6 dimensions with a point per 130 bandwidths to the 6th, most neighbours of
    // a vertex are missing and the mean is over fewer points than the Gaussian's.
    EXPECT_LT(dense2.rms, 0.005);
    EXPECT_LT(dense3.rms, 0.007);
    EXPECT_LT(dense5.rms, 0.015);
    EXPECT_LT(dense6.rms, 0.02);
    EXPECT_LT(sparse6.rms, 0.08);
    EXPECT_LT(dense3.largest, 0.05);
  }
}

TEST(LatticeFilter, ConstantStaysConstantAfterNormalising) {
  const auto f = random_features(61, 500, 6, 5);
  Built sut(6, 500, 3500);
  ASSERT_EQ(sut.lattice.build(6, f, sut.hash, sut.next), rt::Status::ok);
  std::vector<float> scratch(sut.lattice.vertices_count()), out(500), degree(500);
  lattice_filter(sut.lattice, std::vector<float>(500, 1.0F), scratch, degree);
  lattice_filter(sut.lattice, std::vector<float>(500, 3.5F), scratch, out);
  for (std::size_t i = 0; i < 500; ++i) {
    ASSERT_GT(degree[i], 0.0F);
    ASSERT_NEAR(out[i] / degree[i], 3.5F, 1e-5F);
  }
}

}  // namespace
}  // namespace tactus::label::test
