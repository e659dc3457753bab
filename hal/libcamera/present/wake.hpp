// How libcamera's thread wakes the thread that reads: an eventfd, so that waiting has an end and takes no lock.
#pragma once

#include "rt/time.hpp"

namespace tactus::hal::libcamera {

class Wake {
 public:
  Wake();
  ~Wake();
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;

  /// Any thread, wait-free. Calls before a wait are remembered as one.
  void notify() noexcept;
  /// Until notify() or `deadline` on the monotonic clock; false: the deadline. May return true for nothing. One thread.
  bool wait_until(rt::HostTime deadline) noexcept;

 private:
  int fd_;
};

}  // namespace tactus::hal::libcamera
