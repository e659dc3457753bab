#include "rt/arena.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "rt/time.hpp"

namespace tactus::rt {
namespace {

TEST(Arena, CarvesInOrderZeroedAndAligned) {
  auto arena = Arena::reserve(64_KiB);
  ASSERT_TRUE(arena);
  Slice first = arena->carve(100);
  Slice second = arena->carve(4096, 4096);
  const std::span<std::uint8_t> a = first.take<std::uint8_t>(60);
  const std::span<std::uint8_t> b = second.take<std::uint8_t>(4096);
  EXPECT_LT(a.data(), b.data());
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a.data()) % kCacheLineBytes, 0U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(b.data()) % 4096, 0U);
  EXPECT_TRUE(std::all_of(b.begin(), b.end(), [](std::uint8_t byte) { return byte == 0; }));
  EXPECT_EQ(arena->bytes_high_water(), 8192U);
}

TEST(Arena, EveryPageIsResidentAfterReserve) {
  auto arena = Arena::reserve(4_MiB);
  ASSERT_TRUE(arena);
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::span<std::byte> memory = arena->carve(4_MiB).take<std::byte>(1);
  std::vector<unsigned char> residency(4_MiB / page);
  ASSERT_EQ(mincore(memory.data(), 4_MiB, residency.data()), 0);
  EXPECT_TRUE(std::all_of(residency.begin(), residency.end(), [](unsigned char r) { return (r & 1) != 0; }));
}

// In a child process, because it gives up root's right to lock without limit.
[[noreturn]] void reserve_without_the_right_to_lock() {
  const rlimit none{0, 0};
  if (setrlimit(RLIMIT_MEMLOCK, &none) != 0) std::exit(2);
  if (geteuid() == 0 && seteuid(65534) != 0) std::exit(3);
  const auto arena = Arena::reserve(64_KiB);
  const bool is_right = arena && !arena->is_locked() &&
                        arena->lock_refusal().find("RLIMIT_MEMLOCK is 0.0 MiB") != std::string::npos;
  std::exit(is_right ? 0 : 1);
}

TEST(ArenaDeathTest, RefusedLockIsOneSentenceAndNoFailure) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers turn mlock into a no-op that succeeds";
#endif
  EXPECT_EXIT(reserve_without_the_right_to_lock(), testing::ExitedWithCode(0), "");
}

TEST(Arena, ReserveMoreThanThereIsSaysSo) {
  const auto arena = Arena::reserve(std::size_t{1} << 62);
  ASSERT_FALSE(arena);
  EXPECT_NE(arena.error().message.find("cannot reserve"), std::string::npos);
  EXPECT_FALSE(Arena::reserve(0));
}

TEST(Arena, MoveKeepsTheMemory) {
  auto first = Arena::reserve(4_KiB);
  ASSERT_TRUE(first);
  const std::span<int> values = first->carve(64).take<int>(1);
  values[0] = 7;
  Arena sut = std::move(*first);
  EXPECT_EQ(values[0], 7);
  EXPECT_EQ(sut.bytes_high_water(), 64U);
}

TEST(ArenaDeathTest, CarveAfterSealIsABug) {
  auto sut = Arena::reserve(4_KiB);
  ASSERT_TRUE(sut);
  sut->seal();
  EXPECT_DEATH(sut->carve(1), "is_sealed");
}

TEST(ArenaDeathTest, CarveMoreThanReservedIsABug) {
  auto sut = Arena::reserve(4_KiB);
  ASSERT_TRUE(sut);
  EXPECT_DEATH(sut->carve(64_KiB), "assertion failed");
}

}  // namespace
}  // namespace tactus::rt
