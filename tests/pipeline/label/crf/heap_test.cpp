// Solving must not touch the heap.
#include <gtest/gtest.h>

#include <cstdlib>

#include "pipeline/label/crf/batch_crf.hpp"
#include "pipeline/label/crf/brute_crf.hpp"
#include "rt/heap_guard.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

TEST(CrfHeap, SolversMakeNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  const Cloud large = corner_cloud(1, 25, 0.02, 0.3), small = corner_cloud(2, 10, 0.05, 0.3);
  const auto config = BatchCrfConfig::for_any_points(large.size());
  const Memory memory(BatchCrf::bytes_needed(config) + BruteCrf::bytes_needed(small.size()));
  rt::Slice slice = memory.slice();
  BatchCrf batch;
  batch.bind(slice, config);
  BruteCrf brute;
  brute.bind(slice, small.size());
  std::vector<float> marginals(large.size() * kMaterialCount);
  std::vector<double> oracle(small.size() * kMaterialCount);
  const CrfParameters parameters = three_kernels();

  rt::heap_guard::seal();
  const std::uint64_t before = rt::heap_guard::was_total_calls();
  rt::Status batch_status, brute_status;
  {
    const rt::RtScope scope;
    batch_status = batch.prepare(large.points(), parameters);
    static_cast<void>(batch.solve(marginals));
    brute_status = brute.prepare(small.points(), parameters);
    static_cast<void>(brute.solve(oracle));
  }
  const std::uint64_t after = rt::heap_guard::was_total_calls();
  {
    const rt::RtScope scope;
    void* volatile block = std::malloc(8);  // proves that the guard counts
    std::free(block);
  }
  EXPECT_EQ(rt::heap_guard::was_total_calls(), after + 1);
  rt::heap_guard::unseal();
  EXPECT_EQ(batch_status, rt::Status::ok);
  EXPECT_EQ(brute_status, rt::Status::ok);
  EXPECT_EQ(after - before, 0U);
}

}  // namespace
}  // namespace tactus::label::test
