#include "hal/libcamera/present/wake.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "rt/clock.hpp"

namespace tactus::hal::libcamera {
namespace {

using rt::operator""_ms;

TEST(LibcameraWake, NotifyBeforeTheWaitIsRememberedOnce) {
  Wake sut;
  sut.notify();
  sut.notify();
  EXPECT_TRUE(sut.wait_until({})) << "the deadline has passed, but the news was there before";
  EXPECT_FALSE(sut.wait_until({}));
}

TEST(LibcameraWake, WaitEndsAtTheDeadlineOrWithTheNews) {
  Wake sut;
  const rt::HostTime start = rt::Clock::monotonic().now();
  EXPECT_FALSE(sut.wait_until(start + 5_ms));
  EXPECT_GE((rt::Clock::monotonic().now() - start).ns, (5_ms).ns);
  std::thread other([&] { sut.notify(); });
  EXPECT_TRUE(sut.wait_until(rt::Clock::monotonic().now() + 60'000_ms));
  other.join();
}

}  // namespace
}  // namespace tactus::hal::libcamera
