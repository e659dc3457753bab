// The same words on every processor.
#include <gtest/gtest.h>

#include <bit>

#include "pipeline/label/label_cell.hpp"

namespace tactus::label {
namespace {

TEST(LabelSmoke, WordsAreTheSameOnEveryProcessor) {
  std::uint64_t state = 1, hash = 14695981039346656037ULL;
  const auto random = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::uint32_t>(state >> 33);
  };
  const auto mix = [&hash](std::uint64_t value) { hash = (hash ^ value) * 1099511628211ULL; };
  for (int sequence = 0; sequence < 200; ++sequence) {
    LabelWord sut = 0;
    for (int k = 0; k < 20; ++k) {
      std::array<std::uint8_t, kMaterialCount> bytes;
      for (auto& b : bytes) b = static_cast<std::uint8_t>(random() % 256 >> random() % 8);
      sut = fuse(sut, costs_of(bytes));
      mix(sut);
    }
    MaterialDistribution p;
    decode(sut, p);
    for (const float v : p) mix(std::bit_cast<std::uint32_t>(v));
    mix(encode(p, 3));
  }
  EXPECT_EQ(hash, 10567599147199356992ULL);
}

}  // namespace
}  // namespace tactus::label
