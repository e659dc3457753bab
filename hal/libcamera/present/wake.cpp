#include "hal/libcamera/present/wake.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

#include "rt/assert.hpp"
#include "rt/clock.hpp"

namespace tactus::hal::libcamera {

Wake::Wake() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) { TACTUS_ASSERT(fd_ >= 0); }
Wake::~Wake() { close(fd_); }

void Wake::notify() noexcept {
  const std::uint64_t one = 1;
  (void)!write(fd_, &one, sizeof one);  // fails only when 2^64 - 2 calls wait already
}

bool Wake::wait_until(rt::HostTime deadline) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>((deadline - rt::Clock::monotonic().now()).ns, 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd event{fd_, POLLIN, 0};
  const int ready = ppoll(&event, 1, &left, nullptr);
  if (ready == 0) return false;
  std::uint64_t count = 0;
  (void)!read(fd_, &count, sizeof count);  // empty after a signal: the caller looks again
  return true;
}

}  // namespace tactus::hal::libcamera
