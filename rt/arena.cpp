#include "rt/arena.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace tactus::rt {
namespace {

std::size_t page_bytes() { return static_cast<std::size_t>(sysconf(_SC_PAGESIZE)); }

double mebibytes(std::size_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

std::string describe_lock_refusal(std::size_t bytes, int error) {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  char text[320];
  std::snprintf(
      text, sizeof text,
      "locking %.1f MiB of planned memory was refused (%s; RLIMIT_MEMLOCK is %.1f MiB): pages may be swapped "
      "out and steps may stall on them; raise the limit (ulimit -l) or grant CAP_IPC_LOCK",
      mebibytes(bytes), std::strerror(error), mebibytes(static_cast<std::size_t>(limit.rlim_cur)));
  return text;
}

}  // namespace

Result<Arena> Arena::reserve(std::size_t bytes) {
  const std::size_t bytes_mapped = round_up(bytes, page_bytes());
  if (bytes_mapped == 0 || bytes_mapped < bytes) {
    return Error{ExitCode::bad_usage, "the memory plan asks for " + std::to_string(bytes) +
                                          " bytes, which cannot be reserved; check the profile's sizes"};
  }
  void* const memory =
      mmap(nullptr, bytes_mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "cannot reserve %.1f MiB for the memory plan (%s); use a smaller profile or free memory",
                  mebibytes(bytes_mapped), std::strerror(errno));
    return Error{ExitCode::failed, text};
  }
  // Fewer TLB misses on the map's random reads; a kernel without huge pages says no, which is fine.
  madvise(memory, bytes_mapped, MADV_HUGEPAGE);
  auto* const first = static_cast<volatile std::byte*>(memory);
  for (std::size_t offset = 0; offset < bytes_mapped; offset += page_bytes()) first[offset] = std::byte{0};

  Arena arena({static_cast<std::byte*>(memory), bytes_mapped});
  if (mlock(memory, bytes_mapped) != 0) arena.lock_refusal_ = describe_lock_refusal(bytes_mapped, errno);
  return Result<Arena>(std::move(arena));
}

Arena::Arena(Arena&& other) noexcept
    : memory_(std::exchange(other.memory_, {})),
      bytes_used_(other.bytes_used_),
      is_sealed_(other.is_sealed_),
      lock_refusal_(std::move(other.lock_refusal_)) {}

Arena& Arena::operator=(Arena&& other) noexcept {
  if (this == &other) return *this;
  release();
  memory_ = std::exchange(other.memory_, {});
  bytes_used_ = other.bytes_used_;
  is_sealed_ = other.is_sealed_;
  lock_refusal_ = std::move(other.lock_refusal_);
  return *this;
}

Arena::~Arena() { release(); }

void Arena::release() noexcept {
  if (!memory_.empty()) munmap(memory_.data(), memory_.size());
  memory_ = {};
}

Slice Arena::carve(std::size_t bytes, std::size_t alignment) {
  TACTUS_ASSERT(!is_sealed_);
  TACTUS_ASSERT(std::has_single_bit(alignment) && alignment <= page_bytes());
  const std::size_t first = round_up(bytes_used_, alignment < kCacheLineBytes ? kCacheLineBytes : alignment);
  TACTUS_ASSERT(first <= memory_.size() && bytes <= memory_.size() - first);
  bytes_used_ = first + bytes;
  return Slice(memory_.subspan(first, bytes));
}

}  // namespace tactus::rt
