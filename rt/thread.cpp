#include "rt/thread.hpp"

#include <limits.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "rt/assert.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kStackFactor = 4;  // instrumented frames are about three times as large
#else
constexpr std::size_t kStackFactor = 1;
#endif
// The C library takes its thread descriptor and all thread_locals out of the stack that it is given.
constexpr std::size_t kThreadLocalBytes = 16_KiB;
// What an untouched byte of stack holds; a run of them at the low end was never used.
constexpr std::byte kUntouched{0xA5};

std::size_t page_bytes() { return static_cast<std::size_t>(sysconf(_SC_PAGESIZE)); }

struct Start {
  RtThread::Function function;
  void* context;
  const char* name;
};

void* thread_main(void* argument) {
  const std::unique_ptr<Start> owner(static_cast<Start*>(argument));
  const Start start = *owner;
  pthread_setname_np(pthread_self(), start.name);
  start.function(start.context);
  return nullptr;
}

// The cores of the mask that this process may use; empty when there is none.
cpu_set_t usable_cores(std::uint64_t core_mask) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  cpu_set_t cores;
  CPU_ZERO(&cores);
  for (std::size_t core = 0; core < 64; ++core) {
    if ((core_mask >> core & 1) != 0 && CPU_ISSET(core, &allowed)) CPU_SET(core, &cores);
  }
  return cores;
}

void say_once(const std::string& sentence) {
  static std::atomic<bool> was_said{false};
  // Relaxed: decides who speaks, publishes nothing.
  if (!was_said.exchange(true, std::memory_order_relaxed)) std::fprintf(stderr, "%s\n", sentence.c_str());
}

}  // namespace

Result<RtThread> RtThread::start(const ThreadSpec& spec, Function function, void* context) {
  TACTUS_ASSERT(std::strlen(spec.name) <= 15);
  const std::size_t page = page_bytes();
  const std::size_t stack_bytes =
      round_up(std::max(spec.stack_bytes, static_cast<std::size_t>(PTHREAD_STACK_MIN)) * kStackFactor +
                   kThreadLocalBytes,
               page);
  void* const mapping = mmap(nullptr, page + stack_bytes, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
  if (mapping == MAP_FAILED) {
    return Error{ExitCode::failed, "cannot map a stack of " + std::to_string(stack_bytes) +
                                       " bytes for thread " + spec.name + " (" + std::strerror(errno) +
                                       "); use a smaller stack_bytes"};
  }
  RtThread thread;
  thread.mapping_ = {static_cast<std::byte*>(mapping), page + stack_bytes};
  std::byte* const stack = thread.mapping_.data() + page;
  std::memset(stack, static_cast<int>(kUntouched), stack_bytes);
  mlock(stack, stack_bytes);  // Arena has said it already when locking is refused
  mprotect(mapping, page, PROT_NONE);

  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  TACTUS_ASSERT(pthread_attr_setstack(&attributes, stack, stack_bytes) == 0);
  if (spec.core_mask != 0) {
    const cpu_set_t cores = usable_cores(spec.core_mask);
    if (CPU_COUNT(&cores) > 0) {
      pthread_attr_setaffinity_np(&attributes, sizeof cores, &cores);
    } else {
      char text[160];
      std::snprintf(text, sizeof text,
                    "thread %s: none of the cores in mask 0x%llx may be used here; it runs on any", spec.name,
                    static_cast<unsigned long long>(spec.core_mask));
      thread.refusal_ = text;
    }
  }
  if (spec.policy == SchedulingPolicy::fifo) {
    const sched_param parameters{.sched_priority = spec.priority};
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    TACTUS_ASSERT(pthread_attr_setschedparam(&attributes, &parameters) == 0);
  }

  auto start = std::make_unique<Start>(Start{function, context, spec.name});
  int error = pthread_create(&thread.thread_, &attributes, thread_main, start.get());
  if (error == EPERM && spec.policy == SchedulingPolicy::fifo) {
    thread.refusal_ =
        std::string("thread ") + spec.name + ": real-time priority " + std::to_string(spec.priority) +
        " was refused (" + std::strerror(error) +
        "), it and others like it run at normal priority; grant CAP_SYS_NICE or raise ulimit -r";
    pthread_attr_setinheritsched(&attributes, PTHREAD_INHERIT_SCHED);
    error = pthread_create(&thread.thread_, &attributes, thread_main, start.get());
  }
  pthread_attr_destroy(&attributes);
  if (error != 0) {
    return Error{ExitCode::failed, std::string("cannot start thread ") + spec.name + " (" +
                                       std::strerror(error) +
                                       "); the system may be out of threads or memory"};
  }
  static_cast<void>(start.release());  // the thread's now
  thread.is_joinable_ = true;
  if (!thread.refusal_.empty()) say_once(thread.refusal_);
  return Result<RtThread>(std::move(thread));
}

RtThread::RtThread(RtThread&& other) noexcept
    : thread_(other.thread_),
      is_joinable_(std::exchange(other.is_joinable_, false)),
      mapping_(std::exchange(other.mapping_, {})),
      refusal_(std::move(other.refusal_)) {}

RtThread& RtThread::operator=(RtThread&& other) noexcept {
  if (this == &other) return *this;
  release();
  thread_ = other.thread_;
  is_joinable_ = std::exchange(other.is_joinable_, false);
  mapping_ = std::exchange(other.mapping_, {});
  refusal_ = std::move(other.refusal_);
  return *this;
}

void RtThread::join() noexcept {
  if (is_joinable_) {
    TACTUS_ASSERT(pthread_join(thread_, nullptr) == 0);
    is_joinable_ = false;
  }
}

void RtThread::release() noexcept {
  join();
  if (!mapping_.empty()) munmap(mapping_.data(), mapping_.size());
  mapping_ = {};
}

std::size_t RtThread::was_stack_bytes_high_water() const {
  if (mapping_.empty()) return 0;
  const std::span<const std::byte> stack = mapping_.subspan(page_bytes());
  std::size_t untouched = 0;
  while (untouched < stack.size() && stack[untouched] == kUntouched) ++untouched;
  return stack.size() - untouched;
}

}  // namespace tactus::rt
