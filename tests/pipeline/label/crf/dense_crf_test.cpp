// A kernel that is added in pieces.
#include "pipeline/label/crf/dense_crf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <vector>

#include "pipeline/label/crf/batch_crf.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label {
namespace {

class OwnedEngine {
 public:
  explicit OwnedEngine(std::size_t points_count) {
    const DenseCrfConfig config = surface_engine_config(BatchCrfConfig::for_any_points(points_count));
    const std::size_t bytes = rt::round_up(DenseCrf::bytes_needed(config), 64);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes)));
    std::memset(memory_.get(), 0, bytes);  // there before anything is timed
    rt::Slice slice({memory_.get(), bytes});
    engine.bind(slice, config);
    EXPECT_EQ(engine.begin(points_count), rt::Status::ok);
  }
  DenseCrf engine;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

std::vector<float> marginals(DenseCrf& engine, const test::Cloud& cloud, const CrfParameters& parameters) {
  engine.set_unary(parameters.compatibility,
                   [&](std::size_t i) { return &cloud.unary_nat[i * kMaterialCount]; });
  (void)engine.solve(5, 0);
  std::vector<float> all(cloud.size() * kMaterialCount);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    engine.marginals_of(
        i, std::span<float, kMaterialCount>(&all[i * kMaterialCount], std::size_t{kMaterialCount}));
  return all;
}

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) / 1e6;
}

TEST(DenseCrfPieces, TwoEnginesTakingTurnsFindWhatEachFindsAlone) {
  const test::Cloud clouds[2] = {test::corner_cloud(1, 30, 0.02, 0.2), test::corner_cloud(2, 25, 0.02, 0.3)};
  const CrfParameters parameters[2] = {test::three_kernels(), paper_crf_parameters()};
  std::vector<float> alone[2];
  for (std::size_t e = 0; e < 2; ++e) {
    OwnedEngine owned(clouds[e].size());
    for (std::size_t m = 0; m < kCrfKernelsMax; ++m)
      ASSERT_EQ(add_surface_kernel(owned.engine, m, clouds[e].points(), {}, parameters[e]), rt::Status::ok);
    alone[e] = marginals(owned.engine, clouds[e], parameters[e]);
  }
  OwnedEngine sut[2] = {OwnedEngine(clouds[0].size()), OwnedEngine(clouds[1].size())};
  for (std::size_t m = 0; m < kCrfKernelsMax; ++m) {
    bool is_over[2] = {false, false};
    for (std::size_t e = 0; e < 2; ++e)
      begin_surface_kernel(sut[e].engine, m, clouds[e].points(), {}, parameters[e]);
    while (!is_over[0] || !is_over[1])
      for (std::size_t e = 0; e < 2; ++e) {
        if (is_over[e]) continue;
        const CrfPiece piece = sut[e].engine.continue_kernel();
        ASSERT_EQ(piece.status, rt::Status::ok);
        is_over[e] = piece.is_last;
      }
  }
  for (std::size_t e = 0; e < 2; ++e) EXPECT_EQ(marginals(sut[e].engine, clouds[e], parameters[e]), alone[e]);
}

// A region of the x86 profile. Prices are fixed; the times beside them are of this machine as it is.
TEST(DenseCrfPieces, NoneIsPricedAboveAMillisecond) {
  const test::Cloud cloud = test::corner_cloud(3, 86, 0.02, 0.2);
  ASSERT_GT(cloud.size(), 22000U);
  OwnedEngine sut(cloud.size());
  for (std::size_t m = 0; m < kCrfKernelsMax; ++m) {
    begin_surface_kernel(sut.engine, m, cloud.points(), {}, test::three_kernels());
    std::uint64_t most_ns = 0, sum_ns = 0;
    double most_ms = 0, sum_ms = 0;
    int pieces = 0;
    for (bool is_last = false; !is_last; ++pieces) {
      const double begun_ms = thread_ms();
      const CrfPiece piece = sut.engine.continue_kernel();
      const double ms = thread_ms() - begun_ms;
      ASSERT_EQ(piece.status, rt::Status::ok);
      EXPECT_GT(piece.price_ns, 0U);
      is_last = piece.is_last;
      most_ns = std::max(most_ns, piece.price_ns);
      most_ms = std::max(most_ms, ms);
      sum_ns += piece.price_ns;
      sum_ms += ms;
    }
    std::printf("kernel %zu: %d pieces, priced %.2f ms at most of %.2f ms, took %.2f of %.2f ms\n", m, pieces,
                static_cast<double>(most_ns) / 1e6, static_cast<double>(sum_ns) / 1e6, most_ms, sum_ms);
    EXPECT_LE(most_ns, 1'000'000U);
    EXPECT_GT(pieces, 20);
  }
}

}  // namespace
}  // namespace tactus::label
