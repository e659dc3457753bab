#include "pipeline/segment/xnn_pool.hpp"

#include <xnnpack.h>

#include <algorithm>
#include <cstring>

#include "rt/slice.hpp"

namespace tactus::segment {
namespace {

// Every block starts on a cache line, which is XNNPACK's largest alignment; its size stands in the line
// before.
constexpr std::size_t kHeaderBytes = rt::kCacheLineBytes;

thread_local XnnPool* active_pool = nullptr;
std::size_t calls_count = 0;  // boot only; proves that XNNPACK uses this allocator

std::size_t& size_of(void* block) {
  return *reinterpret_cast<std::size_t*>(static_cast<std::byte*>(block) - kHeaderBytes);
}

void* xnn_allocate(void*, std::size_t bytes) {
  ++calls_count;
  return active_pool == nullptr ? nullptr : active_pool->allocate(bytes);
}
void* xnn_reallocate(void*, void* block, std::size_t bytes) {
  return active_pool == nullptr ? nullptr : active_pool->reallocate(block, bytes);
}
void xnn_deallocate(void*, void* block) {
  if (active_pool != nullptr) active_pool->deallocate(block);
}
void* xnn_aligned_allocate(void* context, std::size_t alignment, std::size_t bytes) {
  return alignment > rt::kCacheLineBytes ? nullptr : xnn_allocate(context, bytes);
}

}  // namespace

void* XnnPool::allocate(std::size_t bytes) noexcept {
  if (bytes > memory_.size() ||
      kHeaderBytes + rt::round_up(bytes, rt::kCacheLineBytes) > memory_.size() - used_) {
    ++refusals_count_;
    return nullptr;
  }
  std::byte* block = memory_.data() + used_ + kHeaderBytes;
  used_ += kHeaderBytes + rt::round_up(bytes, rt::kCacheLineBytes);
  high_water_ = std::max(high_water_, used_);
  ++blocks_count_;
  size_of(block) = bytes;
  return block;
}

void* XnnPool::reallocate(void* block, std::size_t bytes) noexcept {
  if (block == nullptr) return allocate(bytes);
  const std::size_t old_bytes = size_of(block);
  if (bytes <= rt::round_up(old_bytes, rt::kCacheLineBytes)) return block;
  void* grown = allocate(bytes);
  if (grown != nullptr) std::memcpy(grown, block, old_bytes);
  return grown;
}

void XnnPool::deallocate(void* block) noexcept {
  if (block == nullptr) return;
  const std::size_t bytes = rt::round_up(size_of(block), rt::kCacheLineBytes);
  if (static_cast<std::byte*>(block) + bytes == memory_.data() + used_) used_ -= bytes + kHeaderBytes;
}

XnnPoolScope::XnnPoolScope(XnnPool& pool) noexcept : outer_(active_pool) { active_pool = &pool; }
XnnPoolScope::~XnnPoolScope() { active_pool = outer_; }

rt::Result<void> initialize_xnnpack() {
  static constexpr xnn_allocator kAllocator = {nullptr,        xnn_allocate,         xnn_reallocate,
                                               xnn_deallocate, xnn_aligned_allocate, xnn_deallocate};
  if (xnn_initialize(&kAllocator) != xnn_status_success)
    return rt::Error{
        rt::ExitCode::failed,
        "XNNPACK refuses this processor (x86-64 needs SSE2, arm64 needs NEON); run without a network"};
  // One small operator shows whose allocator is in use: only the first call in a process can set it.
  alignas(rt::kCacheLineBytes) static std::byte memory[16 * 1024];
  XnnPool pool(memory);
  const XnnPoolScope scope(pool);
  const std::size_t calls_before = calls_count;
  xnn_operator_t probe = nullptr;
  const xnn_status status = xnn_create_clamp_nc_u8(1, 1, 1, 0, 255, 0, &probe);
  if (calls_count == calls_before)
    return rt::Error{rt::ExitCode::failed,
                     "XNNPACK was started before by another library of this program, with an allocator that "
                     "is not fenced"};
  if (status != xnn_status_success)
    return rt::Error{rt::ExitCode::failed, "XNNPACK could not create an operator (status " +
                                               std::to_string(static_cast<int>(status)) + ")"};
  xnn_delete_operator(probe);
  return {};
}

}  // namespace tactus::segment
