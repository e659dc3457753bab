// The malloc family of programs that link tactus_heap_guard: tells the guard, then calls the C library's own.
// In sanitizer builds this file is empty, because the sanitizer's malloc must stay in place.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TACTUS_HAS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define TACTUS_HAS_SANITIZER 1
#endif
#endif

#if defined(__GLIBC__) || __has_include(<features.h>)
#include <features.h>
#endif

#if !defined(TACTUS_HAS_SANITIZER) && defined(__GLIBC__)

#include <errno.h>
#include <unistd.h>

#include <cstddef>

#include "rt/heap_guard.hpp"

using tactus::rt::heap_guard::note_heap_call;

extern "C" {

// glibc's own, exported under these names for exactly this use.
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes_each);
void* __libc_realloc(void* memory, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);

void* malloc(std::size_t bytes) {
  note_heap_call("malloc", bytes);
  return __libc_malloc(bytes);
}

void* calloc(std::size_t count, std::size_t bytes_each) {
  note_heap_call("calloc", count * bytes_each);
  return __libc_calloc(count, bytes_each);
}

void* realloc(void* memory, std::size_t bytes) {
  note_heap_call("realloc", bytes);
  return __libc_realloc(memory, bytes);
}

void* reallocarray(void* memory, std::size_t count, std::size_t bytes_each) {
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, bytes_each, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  note_heap_call("reallocarray", bytes);
  return __libc_realloc(memory, bytes);
}

void* memalign(std::size_t alignment, std::size_t bytes) {
  note_heap_call("memalign", bytes);
  return __libc_memalign(alignment, bytes);
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  note_heap_call("aligned_alloc", bytes);
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  note_heap_call("posix_memalign", bytes);
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) return EINVAL;
  void* const allocated = __libc_memalign(alignment, bytes);
  if (allocated == nullptr) return ENOMEM;
  *memory = allocated;
  return 0;
}

void* valloc(std::size_t bytes) {
  note_heap_call("valloc", bytes);
  return __libc_memalign(static_cast<std::size_t>(sysconf(_SC_PAGESIZE)), bytes);
}

void* pvalloc(std::size_t bytes) {
  note_heap_call("pvalloc", bytes);
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return __libc_memalign(page, (bytes + page - 1) / page * page);
}

}  // extern "C"

#endif
