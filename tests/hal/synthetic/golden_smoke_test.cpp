// The same bits on every machine: hashes of whole frames, written down once.
#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/synthetic/synthetic.hpp"

namespace tactus::hal::synthetic {
namespace {

/// FNV-1a over bytes, low byte of a word first on every machine.
template <typename T>
std::uint64_t hash_of(std::span<const T> values) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const T value : values)
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      hash ^= static_cast<std::uint64_t>(value) >> (8 * byte) & 255U;
      hash *= 0x100000001b3ULL;
    }
  return hash;
}

struct Golden {
  const char* title;
  const char* source;
  int frame;
  std::uint64_t depth, labels, color;
};

class SyntheticGolden : public testing::TestWithParam<Golden> {};

TEST_P(SyntheticGolden, FramesAreTheSameBitsOnEveryMachine) {
  const Golden& golden = GetParam();
  const auto options = parse_synthetic_name(golden.source);
  ASSERT_TRUE(options) << options.error().message;
  FrameRenderer sut(std::make_shared<const Scene>(make_scene(options->scene)), *options);
  const auto pixels = static_cast<std::size_t>(sut.calibration().depth.width) *
                      static_cast<std::size_t>(sut.calibration().depth.height);
  std::vector<std::uint16_t> depth(pixels);
  std::vector<std::uint8_t> labels(pixels), rgb(pixels * 3);
  sut.depth(golden.frame, depth);
  sut.labels(golden.frame, labels);
  sut.color(golden.frame, rgb);
  const auto text = [](std::uint64_t v) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "0x%016llx", static_cast<unsigned long long>(v));
    return std::string(buffer);
  };
  EXPECT_EQ(text(hash_of<std::uint16_t>(depth)), text(golden.depth));
  EXPECT_EQ(text(hash_of<std::uint8_t>(labels)), text(golden.labels));
  EXPECT_EQ(text(hash_of<std::uint8_t>(rgb)), text(golden.color));
}

INSTANTIATE_TEST_SUITE_P(
    Frames, SyntheticGolden,
    testing::Values(Golden{"noisy_bedroom", "synthetic:bedroom?mode=320x240", 37, 0xb0fa8aab565ba731ULL,
                           0x420fee1223255b9cULL, 0xe0556034c9d894f8ULL},
                    Golden{"unregistered_bedroom", "synthetic:bedroom?mode=320x240&noise=0&registered=0", 240,
                           0x10418d7f5749e138ULL, 0xb394d67e2935f4abULL, 0x00c9c7ffa6796de6ULL},
                    Golden{"noisy_office", "synthetic:office?mode=320x240&seed=3", 60, 0xf473851cc727795eULL,
                           0xbd59ca4aa8d8d211ULL, 0xc1657f14d4db0876ULL},
                    Golden{"wide_corner", "synthetic:corner?mode=960x540&trajectory=still", 0,
                           0xf8848911bd4da75aULL, 0xb783a4ee24a718c1ULL, 0x541dfbdf873cc32aULL}),
    [](const auto& golden) { return std::string(golden.param.title); });

}  // namespace
}  // namespace tactus::hal::synthetic
