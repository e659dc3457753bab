// The stage must not touch the heap once it is bound, and XNNPACK must not touch it for its operators at all.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "pipeline/segment/segmenter.hpp"
#include "pipeline/segment/xnn_pool.hpp"
#include "rt/heap_guard.hpp"
#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

TEST(SegmentHeap, StepsMakeNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  const FileBytes bytes = miniature(3);
  const auto model = read_tflite(bytes, "net.tflite");
  ClassMap map;
  map.std = {127.5F, 127.5F, 127.5F};
  map.mean = {127, 127, 127};
  map.materials.assign(5, MaterialDistribution{1.0F});
  const SegmenterConfig config{&*model, &map, 64, 40};
  const Memory memory(Segmenter::bytes_needed(config).value());
  auto sut = Segmenter::bind(config, memory.slice());
  ASSERT_TRUE(sut);
  const Memory out_memory(MaterialScores::bytes_needed(12, 8));
  rt::Slice slice = out_memory.slice();
  MaterialScores out = MaterialScores::take(slice, 12, 8);
  ASSERT_EQ(sut->warm_up(out), rt::Status::ok);
  const std::vector<std::uint8_t> image(64 * 40 * 3, 90);
  MaterialDistribution sampled{};

  rt::heap_guard::seal();
  const std::uint64_t before = rt::heap_guard::was_total_calls();
  {
    const rt::RtScope scope;
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(sut->step(image, out), rt::Status::ok);
      out.sample(static_cast<float>(i), 3.5F, sampled);
    }
  }
  const std::uint64_t after = rt::heap_guard::was_total_calls();
  {
    const rt::RtScope scope;
    void* volatile block = std::malloc(8);  // proves that the guard counts
    std::free(block);
  }
  EXPECT_EQ(rt::heap_guard::was_total_calls(), after + 1);
  rt::heap_guard::unseal();
  EXPECT_EQ(after - before, 0U);
}

TEST(XnnPool, ServesCacheLinesReusesTheLastBlockAndRefusesWhenFull) {
  const Memory memory(1024);
  rt::Slice slice = memory.slice();
  XnnPool sut(slice.take<std::byte>(1024));
  void* a = sut.allocate(100);
  ASSERT_NE(a, nullptr);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a) % rt::kCacheLineBytes, 0U);
  EXPECT_EQ(sut.bytes_used(), 192U);
  void* b = sut.allocate(64);
  std::memset(a, 0x11, 100);
  std::memset(b, 0x22, 64);
  EXPECT_EQ(sut.reallocate(a, 120), a) << "grows within its lines";
  auto* grown = static_cast<std::uint8_t*>(sut.reallocate(a, 200));
  ASSERT_NE(grown, nullptr);
  EXPECT_EQ(grown[99], 0x11);
  const std::size_t used = sut.bytes_used();
  void* c = sut.allocate(1);
  sut.deallocate(c);
  EXPECT_EQ(sut.bytes_used(), used) << "the last block comes back";
  sut.deallocate(b);
  EXPECT_EQ(sut.bytes_used(), used) << "one in the middle does not";
  EXPECT_EQ(sut.allocate(4096), nullptr);
  EXPECT_EQ(sut.allocate(~std::size_t{0}), nullptr);
  EXPECT_EQ(sut.refusals_count(), 2U);
  EXPECT_GT(sut.bytes_high_water(), used);
}

}  // namespace
}  // namespace tactus::segment::test
