#include "rt/worker_pool.hpp"

#include <cstdio>

#include "rt/heap_guard.hpp"

namespace tactus::rt {
namespace {

// A pause is 40 to 140 cycles on x86 since 2016, so this is some 20 us; a sleep and a wake-up cost 5 to 50
// us.
constexpr int kSpinsMax = 500;

void relax_core() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("isb");  // waits some 10 ns; yield is a no-op on most cores
#endif
}

}  // namespace

Result<void> WorkerPool::start(int threads_count, const ThreadSpec& spec) {
  TACTUS_ASSERT(threads_count >= 1 && threads_count <= kThreadsMax && workers_count_ == 0);
  is_stopping_.store(false, std::memory_order_relaxed);  // published by the creation of the threads
  for (int i = 0; i < threads_count - 1; ++i) {
    Worker& worker = workers_[static_cast<std::size_t>(i)];
    worker.pool = this;
    worker.lane_index = static_cast<std::uint32_t>(i) + 1;
    std::snprintf(worker.name, sizeof worker.name, "%.13s%c", spec.name, static_cast<char>('1' + i));
    ThreadSpec spec_of_lane = spec;
    spec_of_lane.name = worker.name;
    auto thread = RtThread::start(spec_of_lane, &WorkerPool::worker_main, &worker);
    if (!thread) {
      stop();
      return thread.error();
    }
    worker.thread = std::move(*thread);
    ++workers_count_;
  }
  return {};
}

void WorkerPool::stop() noexcept {
  is_stopping_.store(true, std::memory_order_relaxed);
  // Release pairs with the acquire of started_count_ in work(): a worker that wakes by it sees the flag.
  started_count_.fetch_add(1, std::memory_order_release);
  started_count_.notify_all();
  for (Worker& worker : workers_) worker.thread.join();
  workers_count_ = 0;
}

void WorkerPool::worker_main(void* context) {
  const Worker& worker = *static_cast<const Worker*>(context);
  const RtScope scope;
  worker.pool->work(worker.lane_index);
}

void WorkerPool::work(std::uint32_t lane_index) noexcept {
  for (;;) {
    // Before looking for work: a job published after our look changes the count, and wait() returns at once.
    // Acquire pairs with the release in stop() and run().
    const std::uint32_t started_count = started_count_.load(std::memory_order_acquire);
    if (is_stopping_.load(std::memory_order_relaxed)) return;
    bool did_work = false;
    for (int spins = 0; spins < kSpinsMax && !did_work; ++spins) {
      did_work = work_until_empty(lane_index);
      if (!did_work) relax_core();
    }
    // Acquire as above.
    if (!did_work) started_count_.wait(started_count, std::memory_order_acquire);
  }
}

bool WorkerPool::work_until_empty(std::uint32_t lane_index) noexcept {
  bool did_work = false;
  while (const auto claim = dispenser_.try_claim()) {
    did_work = true;
    function_(context_, claim->chunk_index, lane_index);
    if (dispenser_.finish(*claim)) {
      // Release pairs with the acquire in run(): finish() gave us everybody's results, we hand them to the
      // caller.
      ended_count_.fetch_add(1, std::memory_order_release);
      ended_count_.notify_one();
    }
  }
  return did_work;
}

void WorkerPool::run(std::uint32_t chunks_count, ChunkFunction function, void* context) noexcept {
  // Relaxed: only catches misuse, publishes nothing.
  TACTUS_ASSERT(!is_running_.exchange(true, std::memory_order_relaxed));
  if (workers_count_ == 0 || chunks_count <= 1) {
    for (std::uint32_t chunk = 0; chunk < chunks_count; ++chunk) function(context, chunk, 0);
  } else {
    // Relaxed: no job is running, so nobody writes it.
    const std::uint32_t ended_count = ended_count_.load(std::memory_order_relaxed);
    function_ = function;
    context_ = context;
    dispenser_.publish(chunks_count);
    // Release pairs with the acquire in work(): a worker that wakes by it finds the job.
    started_count_.fetch_add(1, std::memory_order_release);
    started_count_.notify_all();  // a system call only if somebody sleeps
    work_until_empty(0);
    // Acquire pairs with the release in work_until_empty(): every lane's results.
    for (int spins = 0; spins < kSpinsMax && ended_count_.load(std::memory_order_acquire) == ended_count;
         ++spins) {
      relax_core();
    }
    ended_count_.wait(ended_count, std::memory_order_acquire);
  }
  is_running_.store(false, std::memory_order_relaxed);
}

}  // namespace tactus::rt
