#include "rt/heap_guard.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace tactus::rt {
namespace {

// The compiler may drop an allocation that nobody looks at.
void look_at(void* memory) { asm volatile("" : : "r"(memory) : "memory"); }

class HeapGuardTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!heap_guard::is_active()) GTEST_SKIP() << "a sanitizer's malloc is in place";
    heap_guard::seal();
  }
  void TearDown() override { heap_guard::unseal(); }

  template <typename Function>
  static std::uint64_t calls_of(Function&& function) {
    const std::uint64_t before = heap_guard::thread_calls();
    {
      const RtScope scope;
      function();
    }
    return heap_guard::thread_calls() - before;
  }
};
using HeapGuardDeathTest = HeapGuardTest;

TEST_F(HeapGuardTest, CountsEveryMemberOfTheFamilyOnce) {
  void* memory = nullptr;
  EXPECT_EQ(calls_of([&] { look_at(memory = std::malloc(10)); }), 1U);
  EXPECT_EQ(calls_of([&] { look_at(memory = std::realloc(memory, 1000)); }), 1U);
  EXPECT_EQ(calls_of([&] { std::free(memory); }), 0U) << "free is not counted";
  const auto counted_once = [&](auto&& allocate) {
    void* allocated = nullptr;
    const std::uint64_t calls = calls_of([&] { look_at(allocated = allocate()); });
    EXPECT_NE(allocated, nullptr);
    std::free(allocated);
    return calls == 1;
  };
  EXPECT_TRUE(counted_once([] { return std::calloc(3, 5); }));
  EXPECT_TRUE(counted_once([] { return reallocarray(nullptr, 3, 5); }));
  EXPECT_TRUE(counted_once([] { return memalign(64, 5); }));
  EXPECT_TRUE(counted_once([] { return std::aligned_alloc(64, 64); }));
  EXPECT_TRUE(counted_once([] { return valloc(5); }));
  EXPECT_TRUE(counted_once([] { return pvalloc(5); }));
  EXPECT_TRUE(counted_once([] { return strdup("called inside the C library"); }));
  EXPECT_TRUE(counted_once([]() -> void* {
    void* allocated = nullptr;
    return posix_memalign(&allocated, 64, 5) == 0 ? allocated : nullptr;
  }));
  EXPECT_EQ(calls_of([] { look_at(std::make_unique<int>(1).get()); }), 1U)
      << "operator new goes through malloc";
  EXPECT_EQ(calls_of([] { look_at(std::string(100, 'x').data()); }), 1U);
}

TEST_F(HeapGuardTest, CountsOnlyInsideAScopeAndOnlyWhenSealed) {
  const std::uint64_t before = heap_guard::was_total_calls();
  look_at(std::make_unique<int>(1).get());
  EXPECT_EQ(heap_guard::was_total_calls(), before);
  heap_guard::unseal();
  EXPECT_EQ(calls_of([] { look_at(std::make_unique<int>(1).get()); }), 0U);
  heap_guard::seal();
  EXPECT_EQ(calls_of([] {
              { const RtScope nested; }
              look_at(std::make_unique<int>(1).get());
            }),
            1U)
      << "leaving an inner scope does not leave the outer one";
  EXPECT_EQ(heap_guard::was_total_calls(), before + 1);
}

TEST_F(HeapGuardTest, CallsOfAGuestLibraryAreCountedApart) {
  const std::uint64_t total_before = heap_guard::was_total_calls();
  const std::uint64_t guests_before = heap_guard::was_guest_calls();
  EXPECT_EQ(calls_of([] {
              {
                const GuestScope guest;
                { const GuestScope nested; }
                look_at(std::make_unique<int>(1).get());
              }
              look_at(std::make_unique<int>(2).get());
            }),
            1U)
      << "after the guest has returned, calls are ours again";
  EXPECT_EQ(heap_guard::was_total_calls(), total_before + 1);
  EXPECT_EQ(heap_guard::was_guest_calls(), guests_before + 1);
  const std::uint64_t others_before = heap_guard::was_other_calls();
  { const GuestScope outside_of_any_step; look_at(std::make_unique<int>(1).get()); }
  EXPECT_EQ(heap_guard::was_guest_calls(), guests_before + 1);
  EXPECT_EQ(heap_guard::was_other_calls(), others_before + 1) << "a thread that is in no step";
}

TEST_F(HeapGuardTest, CountsPerThreadAndInTotal) {
  const std::uint64_t total_before = heap_guard::was_total_calls();
  const std::uint64_t mine_before = heap_guard::thread_calls();
  std::uint64_t theirs = 0;
  std::thread other([&] { theirs = calls_of([] { look_at(std::make_unique<int>(1).get()); }); });
  other.join();
  EXPECT_EQ(theirs, 1U);
  EXPECT_EQ(heap_guard::thread_calls(), mine_before);
  EXPECT_EQ(heap_guard::was_total_calls(), total_before + 1);
}

TEST_F(HeapGuardTest, AllocationBehavesAsTheCLibrarys) {
  void* memory = nullptr;
  EXPECT_EQ(posix_memalign(&memory, 3, 10), EINVAL);
  EXPECT_EQ(memory, nullptr);
  EXPECT_EQ(posix_memalign(&memory, 256, 10), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 256, 0U);
  std::free(memory);
  volatile std::size_t too_many = SIZE_MAX / 2;
  errno = 0;
  EXPECT_EQ(reallocarray(nullptr, too_many, 3), nullptr);
  EXPECT_EQ(errno, ENOMEM);
  errno = 0;
  EXPECT_EQ(std::calloc(too_many, 3), nullptr);
  EXPECT_EQ(errno, ENOMEM);
  auto* const bytes = static_cast<unsigned char*>(std::calloc(100, 1));
  for (int i = 0; i < 100; ++i) ASSERT_EQ(bytes[i], 0);
  std::free(bytes);
  std::vector<int> grown;
  for (int i = 0; i < 100'000; ++i) grown.push_back(i);
  EXPECT_EQ(grown.back(), 99'999);
}

void allocate_deep_inside() {
  const RtScope scope;
  look_at(std::malloc(321));
}

TEST_F(HeapGuardDeathTest, FatalModePrintsWhatAndWhereAndAborts) {
  heap_guard::set_fatal(true);
  EXPECT_DEATH(allocate_deep_inside(),
               "heap call on a real-time thread after seal: malloc of 321 bytes\n.*rt_heap_guard");
  heap_guard::set_fatal(false);
}

}  // namespace
}  // namespace tactus::rt
