#include "pipeline/contact/ode_memory.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>
#include <vector>

namespace tactus::contact {
namespace {

struct Memory {
  explicit Memory(std::size_t bytes) : bytes_(bytes), data_(::operator new (bytes, std::align_val_t{64})) {}
  ~Memory() { ::operator delete (data_, std::align_val_t{64}); }
  [[nodiscard]] rt::Slice slice() const {
    return rt::Slice(std::span(static_cast<std::byte*>(data_), bytes_));
  }
  std::size_t bytes_;
  void* data_;
};

TEST(OdePool, FreedBlockOfTheSameClassComesBack) {
  Memory memory(64 * 1024);
  OdePool sut(memory.slice(), 64 * 1024);
  void* a = sut.allocate(100);
  void* b = sut.allocate(100);
  ASSERT_NE(a, b);
  sut.free(a, 100);
  EXPECT_EQ(sut.allocate(128), a) << "100 and 128 bytes share a class";
  EXPECT_EQ(sut.use().in_use_bytes, 256U);
  EXPECT_EQ(sut.use().carved_bytes, 256U);
}

TEST(OdePool, FullAnswersNullAndCounts) {
  Memory memory(64 * 1024);
  OdePool sut(memory.slice(), 64 * 1024);
  void* all = sut.allocate(64 * 1024);
  ASSERT_NE(all, nullptr);
  EXPECT_EQ(sut.allocate(1), nullptr);
  EXPECT_EQ(sut.allocate(std::size_t{1} << 40), nullptr);
  EXPECT_EQ(sut.use().refused, 2U);
  sut.free(all, 64 * 1024);
  EXPECT_EQ(sut.allocate(62'000), all);
}

TEST(OdePool, AgreesWithAShadowModelUnderRandomUse) {
  const unsigned seed = 5;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Memory memory(1024 * 1024);
  OdePool sut(memory.slice(), 1024 * 1024);
  struct Held {
    unsigned char* block;
    std::size_t bytes;
    unsigned char fill;
  };
  std::vector<Held> held;
  std::mt19937 random(seed);
  for (int i = 0; i < 20'000; ++i) {
    if (held.size() < 100 && random() % 2 == 0) {
      const std::size_t bytes = random() % 50 == 0 ? random() % 20'000 : random() % 700;
      auto* block = static_cast<unsigned char*>(sut.allocate(bytes));
      if (block == nullptr) continue;
      ASSERT_EQ(reinterpret_cast<std::uintptr_t>(block) % 64, 0U);
      const auto fill = static_cast<unsigned char>(random());
      std::memset(block, fill, bytes);
      held.push_back({block, bytes, fill});
    } else if (!held.empty()) {
      std::swap(held[random() % held.size()], held.back());
      const Held last = held.back();
      held.pop_back();
      for (std::size_t k = 0; k < last.bytes; ++k) ASSERT_EQ(last.block[k], last.fill);
      sut.free(last.block, last.bytes);
    }
  }
  EXPECT_GT(sut.use().allocations, 1000U);
  EXPECT_LE(sut.use().in_use_bytes, sut.use().in_use_bytes_max);
  EXPECT_LE(sut.use().in_use_bytes_max, sut.use().carved_bytes);
}

}  // namespace
}  // namespace tactus::contact
