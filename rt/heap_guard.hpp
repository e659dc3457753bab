// Counts calls of the malloc family made where there must be none: on real-time threads after boot.
//
// The program links tactus_heap_guard, whose malloc, calloc, realloc, memalign, aligned_alloc,
// posix_memalign, valloc, pvalloc and reallocarray stand before the C library's (operator new goes through
// malloc; free is not counted). Each tells note_heap_call(), which counts it when the calling thread is
// inside an RtScope and the guard is sealed. Programs without it, and sanitizer builds, which bring their own
// malloc, run the same code uncounted: is_active() says false.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tactus::rt {

/// While one exists on a thread, the thread is in a step and must not touch the heap. Nests. Any thread,
/// wait-free.
class RtScope {
 public:
  RtScope() noexcept;
  ~RtScope();
  RtScope(const RtScope&) = delete;
  RtScope& operator=(const RtScope&) = delete;
};

/// While one exists, the thread is inside a guest library whose memory cannot be fenced in (OpenNI2, libjpeg): its calls
/// are counted apart and are never fatal. Nests. Any thread, wait-free.
class GuestScope {
 public:
  GuestScope() noexcept;
  ~GuestScope();
  GuestScope(const GuestScope&) = delete;
  GuestScope& operator=(const GuestScope&) = delete;
};

namespace heap_guard {

/// Whether calls are really seen. Proves itself with one allocation; boot or exit.
[[nodiscard]] bool is_active();

/// From now on calls inside an RtScope count. Boot ends here.
void seal() noexcept;
/// Boot again, or exit: nothing counts. Counts stay.
void unseal() noexcept;

/// Calls counted so far: by all threads, by this thread. Relaxed: for reports. Any thread.
[[nodiscard]] std::uint64_t was_total_calls() noexcept;
/// Calls inside a GuestScope on threads that are inside an RtScope; not in the totals.
[[nodiscard]] std::uint64_t was_guest_calls() noexcept;
[[nodiscard]] std::uint64_t thread_calls() noexcept;

/// Calls by threads that were in no step: guest libraries' own, recorder, film, and ours between steps.
[[nodiscard]] std::uint64_t was_other_calls() noexcept;

/// In tests: the first counted call prints its stack (addresses for addr2line where names are not exported)
/// and aborts.
void set_fatal(bool is_fatal);

/// Told by the interposed functions, once per call. Any thread, wait-free unless fatal.
void note_heap_call(const char* function, std::size_t bytes) noexcept;

}  // namespace heap_guard
}  // namespace tactus::rt
