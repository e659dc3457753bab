#include "rt/thread.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>

namespace tactus::rt {
namespace {

struct Seen {
  char name[16] = {};
  int policy = -1;
  int priority = -1;
  cpu_set_t cores;
};

void look_around(void* context) {
  auto& seen = *static_cast<Seen*>(context);
  pthread_getname_np(pthread_self(), seen.name, sizeof seen.name);
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &seen.policy, &parameters);
  seen.priority = parameters.sched_priority;
  pthread_getaffinity_np(pthread_self(), sizeof seen.cores, &seen.cores);
}

TEST(RtThread, RunsUnderItsNameOnItsCore) {
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::size_t core = 0;
  while (!CPU_ISSET(core, &allowed)) ++core;
  Seen seen;
  auto sut = RtThread::start({.name = "look", .core_mask = std::uint64_t{1} << core}, look_around, &seen);
  ASSERT_TRUE(sut);
  sut->join();
  EXPECT_STREQ(seen.name, "look");
  EXPECT_EQ(CPU_COUNT(&seen.cores), 1);
  EXPECT_TRUE(CPU_ISSET(core, &seen.cores));
  EXPECT_EQ(seen.policy, SCHED_OTHER);
  EXPECT_EQ(sut->refusal(), "");
}

TEST(RtThread, FifoIsGrantedOrRefusedInOneSentence) {
  Seen seen;
  auto sut =
      RtThread::start({.name = "fifo", .policy = SchedulingPolicy::fifo, .priority = 7}, look_around, &seen);
  ASSERT_TRUE(sut);
  sut->join();
  if (sut->refusal().empty()) {
    EXPECT_EQ(seen.policy, SCHED_FIFO);
    EXPECT_EQ(seen.priority, 7);
  } else {
    EXPECT_EQ(seen.policy, SCHED_OTHER);
    EXPECT_NE(sut->refusal().find("thread fifo: real-time priority 7 was refused"), std::string::npos);
  }
}

// In a child process, which gives up the right to real-time priorities. Two refusals, one line. _exit: a leak
// checker cannot do its work at exit in a process that has dropped its rights.
[[noreturn]] void start_two_without_the_right() {
  const rlimit none{0, 0};
  if (setrlimit(RLIMIT_RTPRIO, &none) != 0) _exit(2);
  if (geteuid() == 0 && seteuid(65534) != 0) _exit(3);
  testing::internal::CaptureStderr();
  for (int i = 0; i < 2; ++i) {
    Seen seen;
    auto sut = RtThread::start({.name = "fifo", .policy = SchedulingPolicy::fifo, .priority = 7}, look_around,
                               &seen);
    if (!sut) _exit(4);
    sut->join();
    if (seen.policy != SCHED_OTHER || sut->refusal().empty()) _exit(5);
  }
  const std::string said = testing::internal::GetCapturedStderr();
  _exit(std::count(said.begin(), said.end(), '\n') == 1 ? 0 : 6);
}

TEST(RtThreadDeathTest, RefusedFifoRunsAtNormalPriorityAndSaysSoOnce) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(start_two_without_the_right(), testing::ExitedWithCode(0), "");
}

TEST(RtThread, MaskWithNoUsableCoreIsIgnoredWithASentence) {
  Seen seen;
  auto sut = RtThread::start({.name = "nowhere", .core_mask = std::uint64_t{1} << 63}, look_around, &seen);
  ASSERT_TRUE(sut);
  sut->join();
  if (CPU_ISSET(63, &seen.cores)) GTEST_SKIP() << "this machine has 64 cores";
  EXPECT_NE(sut->refusal().find("0x8000000000000000"), std::string::npos);
}

__attribute__((noinline)) void use_stack(void* context) {
  volatile char big[100'000];
  for (volatile char& c : big) c = 1;
  *static_cast<char*>(context) = big[5];
}

TEST(RtThread, StackHighWaterCoversWhatWasUsed) {
  char result = 0;
  auto sut = RtThread::start({.name = "deep", .stack_bytes = 256_KiB}, use_stack, &result);
  ASSERT_TRUE(sut);
  sut->join();
  EXPECT_EQ(result, 1);
  EXPECT_GE(sut->was_stack_bytes_high_water(), 100'000U);
}

[[noreturn]] void overflow_a_stack() {
  struct Deep {
    // Not a tail call: the result is used after it.
    static int down(int n) {
      volatile char frame[4096];
      frame[0] = static_cast<char>(n);
      return n == 0 ? 0 : down(n - 1) + frame[0];
    }
  };
  auto sut = RtThread::start(
      {.name = "overflow", .stack_bytes = 64_KiB},
      [](void* context) { *static_cast<int*>(context) = Deep::down(100'000); }, new int);
  sut->join();
  std::exit(0);
}

TEST(RtThreadDeathTest, OverflowMeetsTheGuardPage) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(overflow_a_stack(), "");
}

TEST(RtThread, StackThatCannotBeMappedIsASentence) {
  const auto sut =
      RtThread::start({.name = "huge", .stack_bytes = std::size_t{1} << 60}, look_around, nullptr);
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("thread huge"), std::string::npos);
}

TEST(RtThreadDeathTest, LongNameIsABug) {
  EXPECT_DEATH(static_cast<void>(RtThread::start({.name = "sixteen letters."}, look_around, nullptr)), "15");
}

}  // namespace
}  // namespace tactus::rt
