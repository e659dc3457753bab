#include "pipeline/contact/ode_memory.hpp"

#include <ode/ode.h>

#include <bit>
#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace tactus::contact {
namespace {

struct SizeClass {
  std::size_t index;
  std::size_t bytes;
};

SizeClass class_of(std::size_t bytes) {
  if (bytes == 0) bytes = 1;
  if (bytes <= 4096) {
    const std::size_t index = (bytes - 1) / 64;
    return {index, (index + 1) * 64};
  }
  // Eighths of an octave: floor is 4096 * 2^octave, less than an eighth of it is wasted.
  const auto octave = static_cast<std::size_t>(std::bit_width(bytes - 1)) - 13;
  const std::size_t eighth = std::size_t{512} << octave;
  const std::size_t eighths = (bytes + eighth - 1) / eighth;  // 9 ... 16
  return {64 + octave * 8 + (eighths - 9), eighths * eighth};
}

// ODE's handlers carry no context, so the pool in force is a variable of the process (see start_ode).
OdePool* pool_in_force = nullptr;

void* ode_allocate(dsizeint bytes) {
  void* block = pool_in_force->allocate(bytes);
  // ODE uses what it gets without looking. The plan covers every body, contact and work area that World
  // admits, so running out here is a bug of the plan.
  TACTUS_ASSERT(block != nullptr);
  return block;
}

void* ode_reallocate(void* block, dsizeint old_bytes, dsizeint new_bytes) {
  if (block == nullptr) return ode_allocate(new_bytes);
  if (old_bytes != 0 && class_of(old_bytes).index == class_of(new_bytes).index) return block;
  void* moved = ode_allocate(new_bytes);
  std::memcpy(moved, block, old_bytes < new_bytes ? old_bytes : new_bytes);
  pool_in_force->free(block, old_bytes);
  return moved;
}

void ode_free(void* block, dsizeint bytes) {
  if (block != nullptr) pool_in_force->free(block, bytes);
}

[[noreturn]] void ode_failed(int, const char* message, va_list arguments) {
  std::vfprintf(stderr, message, arguments);
  std::fputc('\n', stderr);
  rt::panic("ODE reported an internal error", __FILE__, __LINE__);
}

}  // namespace

OdePool::OdePool(rt::Slice slice, std::size_t bytes) {
  const auto memory = slice.take<std::byte>(bytes);
  next_ = memory.data();
  left_bytes_ = memory.size();
  use_.capacity_bytes = memory.size();
}

void* OdePool::allocate(std::size_t bytes) noexcept {
  const SizeClass size = class_of(bytes);
  ++use_.allocations;
  void* block = nullptr;
  if (size.index < free_.size() && free_[size.index] != nullptr) {
    block = free_[size.index];
    free_[size.index] = free_[size.index]->next;
  } else if (size.index < free_.size() && size.bytes <= left_bytes_) {
    block = next_;
    next_ += size.bytes;
    left_bytes_ -= size.bytes;
    use_.carved_bytes += size.bytes;
  } else {
    ++use_.refused;
    return nullptr;
  }
  use_.in_use_bytes += size.bytes;
  if (use_.in_use_bytes > use_.in_use_bytes_max) use_.in_use_bytes_max = use_.in_use_bytes;
  return block;
}

void OdePool::free(void* block, std::size_t bytes) noexcept {
  const SizeClass size = class_of(bytes);
  auto* freed = new (block) FreeBlock{free_[size.index]};
  free_[size.index] = freed;
  use_.in_use_bytes -= size.bytes;
}

void start_ode(OdePool& pool) {
  TACTUS_ASSERT(pool_in_force == nullptr);
  pool_in_force = &pool;
  dSetAllocHandler(ode_allocate);
  dSetReallocHandler(ode_reallocate);
  dSetFreeHandler(ode_free);
  dSetErrorHandler(ode_failed);
  dSetDebugHandler(ode_failed);
  dInitODE2(0);
}

void stop_ode() {
  TACTUS_ASSERT(pool_in_force != nullptr);
  dCloseODE();
  dSetAllocHandler(nullptr);
  dSetReallocHandler(nullptr);
  dSetFreeHandler(nullptr);
  pool_in_force = nullptr;
}

}  // namespace tactus::contact
