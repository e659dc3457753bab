// Fork and join: one thread's loop over chunks, spread over up to four threads, with the same result for any
// number.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "rt/chunk_dispenser.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"
#include "rt/thread.hpp"

namespace tactus::rt {

/// run() calls a function once for each chunk, on the calling thread (lane 0) and on the pool's workers
/// (lanes 1..), and returns when all are done. Which lane gets which chunk changes from run to run; a result
/// must depend on the chunk's index alone, the lane serves only to choose scratch memory.
///
/// Step: no heap, no mutex. Waiting: when its chunks have run out the caller waits for those that are still
/// running on other lanes, first spinning about 20 us (shorter than a sleep and a wake-up), then on a futex.
/// A worker that the system has taken off its core therefore holds the caller up: give workers the caller's
/// priority. Idle workers spin as long, then sleep. With one thread run() is a plain loop and nothing waits.
/// One thread at a time may call run(); it must not be called from inside a chunk (both assert).
class WorkerPool {
 public:
  static constexpr int kThreadsMax = 4;
  using ChunkFunction = void (*)(void* context, std::uint32_t chunk_index, std::uint32_t lane_index);

  /// One thread: the caller's.
  WorkerPool() = default;
  ~WorkerPool() { stop(); }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Starts threads_count - 1 workers like `spec` (its name gets the lane's digit appended). Boot.
  Result<void> start(int threads_count, const ThreadSpec& spec);
  /// Joins the workers; run() goes on working with one thread.
  void stop() noexcept;

  void run(std::uint32_t chunks_count, ChunkFunction function, void* context) noexcept;

  /// run(n, [&](std::uint32_t chunk_index) {...}) or with (chunk_index, lane_index). The callable is used in
  /// place.
  template <typename Callable>
  void run(std::uint32_t chunks_count, Callable&& callable) noexcept {
    using Plain = std::remove_reference_t<Callable>;
    run(
        chunks_count,
        [](void* context, std::uint32_t chunk_index, std::uint32_t lane_index) {
          if constexpr (std::is_invocable_v<Plain&, std::uint32_t, std::uint32_t>) {
            (*static_cast<Plain*>(context))(chunk_index, lane_index);
          } else {
            (*static_cast<Plain*>(context))(chunk_index);
          }
        },
        const_cast<void*>(static_cast<const void*>(std::addressof(callable))));
  }

  [[nodiscard]] int threads_count() const { return workers_count_ + 1; }

 private:
  struct Worker {
    WorkerPool* pool = nullptr;
    std::uint32_t lane_index = 0;
    char name[16] = {};
    RtThread thread;
  };
  static void worker_main(void* context);
  void work(std::uint32_t lane_index) noexcept;
  bool work_until_empty(std::uint32_t lane_index) noexcept;

  ChunkDispenser<> dispenser_;
  // The job: written before publish(), read between claim and finish (chunk_dispenser.hpp says why plain
  // fields do).
  ChunkFunction function_ = nullptr;
  void* context_ = nullptr;
  // Count of jobs published; what idle workers sleep on.
  alignas(kCacheLineBytes) std::atomic<std::uint32_t> started_count_{0};
  // Count of jobs that ended; what the caller sleeps on.
  alignas(kCacheLineBytes) std::atomic<std::uint32_t> ended_count_{0};
  std::atomic<bool> is_stopping_{false};
  std::atomic<bool> is_running_{false};
  int workers_count_ = 0;
  std::array<Worker, kThreadsMax - 1> workers_;
};

}  // namespace tactus::rt
