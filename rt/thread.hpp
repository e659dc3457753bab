// Threads as the wiring table describes them: name, scheduling, cores, stack.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::rt {

enum class SchedulingPolicy : std::uint8_t {
  normal,  ///< the system's time sharing
  fifo     ///< SCHED_FIFO: runs until it waits or a higher priority wants the core
};

struct ThreadSpec {
  const char* name = "";  ///< at most 15 characters, as the kernel keeps them
  SchedulingPolicy policy = SchedulingPolicy::normal;
  int priority = 0;             ///< 1 (low) .. 99 for fifo
  std::uint64_t core_mask = 0;  ///< bit n = core n; 0 = any
  std::size_t stack_bytes = 256_KiB;
};

/// A running thread; joins when destroyed. Its stack is mapped, touched and guarded at start, so that no step
/// faults a page in and an overflow stops the program instead of corrupting it. Boot; one owner.
class RtThread {
 public:
  using Function = void (*)(void* context);

  /// When the system refuses the priority or the cores the thread runs without; refusal() says so in one
  /// sentence and the first refusal of the process is also printed to stderr, once.
  static Result<RtThread> start(const ThreadSpec& spec, Function function, void* context);

  RtThread() = default;
  RtThread(RtThread&& other) noexcept;
  RtThread& operator=(RtThread&& other) noexcept;
  ~RtThread() { release(); }

  /// Waits for the function to return; telling it to is its owner's business. Does nothing when not running.
  void join() noexcept;

  [[nodiscard]] bool is_joinable() const { return is_joinable_; }
  /// Empty when everything in the spec was granted.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  /// Most bytes of stack ever used, the thread's own bookkeeping included. Exact after join(), before a lower
  /// bound.
  [[nodiscard]] std::size_t was_stack_bytes_high_water() const;

 private:
  void release() noexcept;

  pthread_t thread_{};
  bool is_joinable_ = false;
  std::span<std::byte> mapping_;  // guard page, then the stack
  std::string refusal_;
};

}  // namespace tactus::rt
