#include "rt/heap_guard.hpp"

#include <execinfo.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace tactus::rt {
namespace {

// Initial-exec: reaching them never calls the allocator, as the general model may in a shared object.
struct ThreadState {
  std::uint64_t calls;
  int scopes_count;
  int guests_count;
  bool is_probing;
  bool was_probed;
};
thread_local constinit ThreadState state __attribute__((tls_model("initial-exec"))) = {};

// All relaxed: switches and a count that order nothing; boot's hand-over to the threads orders the switches.
constinit std::atomic<bool> is_sealed{false};
constinit std::atomic<bool> is_fatal_mode{false};
constinit std::atomic<std::uint64_t> total_calls{0};
constinit std::atomic<std::uint64_t> guest_calls{0};
constinit std::atomic<std::uint64_t> other_calls{0};

[[noreturn]] void die(const char* function, std::size_t bytes) {
  state.scopes_count = 0;  // what follows may itself allocate
  char text[160];
  const int length = std::snprintf(
      text, sizeof text, "heap call on a real-time thread after seal: %s of %zu bytes\n", function, bytes);
  if (length > 0) static_cast<void>(!write(STDERR_FILENO, text, static_cast<std::size_t>(length)));
  void* frames[48];
  backtrace_symbols_fd(frames, backtrace(frames, 48), STDERR_FILENO);
  std::abort();
}

}  // namespace

RtScope::RtScope() noexcept { ++state.scopes_count; }
RtScope::~RtScope() { --state.scopes_count; }
GuestScope::GuestScope() noexcept { ++state.guests_count; }
GuestScope::~GuestScope() { --state.guests_count; }

namespace heap_guard {

bool is_active() {
  state.is_probing = true;
  state.was_probed = false;
  // Through volatile pointers, or the compiler may drop a malloc whose memory is not used.
  void* (*volatile allocate)(std::size_t) = &std::malloc;
  void (*volatile release)(void*) = &std::free;
  release(allocate(1));
  state.is_probing = false;
  return state.was_probed;
}

void seal() noexcept { is_sealed.store(true, std::memory_order_relaxed); }
void unseal() noexcept { is_sealed.store(false, std::memory_order_relaxed); }
std::uint64_t was_total_calls() noexcept { return total_calls.load(std::memory_order_relaxed); }
std::uint64_t was_guest_calls() noexcept { return guest_calls.load(std::memory_order_relaxed); }
std::uint64_t was_other_calls() noexcept { return other_calls.load(std::memory_order_relaxed); }
std::uint64_t thread_calls() noexcept { return state.calls; }

void set_fatal(bool is_fatal) {
  // The first backtrace loads the unwinder, which allocates: now, not inside malloc.
  void* frame = nullptr;
  static_cast<void>(backtrace(&frame, 1));
  is_fatal_mode.store(is_fatal, std::memory_order_relaxed);
}

void note_heap_call(const char* function, std::size_t bytes) noexcept {
  if (state.is_probing) {
    state.was_probed = true;
    return;
  }
  if (!is_sealed.load(std::memory_order_relaxed)) return;
  if (state.scopes_count == 0) {
    other_calls.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  if (state.guests_count > 0) {
    guest_calls.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  ++state.calls;
  total_calls.fetch_add(1, std::memory_order_relaxed);
  if (is_fatal_mode.load(std::memory_order_relaxed)) die(function, bytes);
}

}  // namespace heap_guard
}  // namespace tactus::rt
