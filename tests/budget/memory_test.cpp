// What the program plans to use, held to its limits and to the table that was last agreed on.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "firmware_host/plan.hpp"
#include "firmware_host/plan_whole.hpp"
#include "hal/synthetic/options.hpp"
#include "pipeline/map/map.hpp"
#include "pipeline/profile.hpp"

namespace tactus {
namespace {

constexpr std::size_t kX86BytesMax = 96'000'000;  // the stricter reading of 96 MB
constexpr double kBytesPerVoxelMax = 5;

firmware::WholePlan plan_at_vga(const Profile& profile) {
  return firmware::plan_whole_program(profile, hal::synthetic::calibration_of({}));
}

TEST(MemoryBudget, X86WithoutTheNetworkPlansAtMost96Megabytes) {
  const std::size_t bytes = plan_at_vga(x86_profile()).without_network_bytes();
  std::printf("planned, x86, without the network: %.1f MB of 96, goal 64\n",
              static_cast<double>(bytes) / 1e6);
  EXPECT_LE(bytes, kX86BytesMax);
  EXPECT_LE(bytes, x86_profile().memory_bytes_max);
  EXPECT_GT(bytes, std::size_t{20'000'000}) << "the map alone is more";
}

TEST(MemoryBudget, HeadsetPlansAtMostItsOwnLimit) {
  const std::size_t bytes = plan_at_vga(headset_profile()).without_network_bytes();
  std::printf("planned, headset, without the network: %.1f MB of %.1f\n", static_cast<double>(bytes) / 1e6,
              static_cast<double>(headset_profile().memory_bytes_max) / 1e6);
  EXPECT_LE(bytes, headset_profile().memory_bytes_max);
}

TEST(MemoryBudget, AVoxelCostsAtMostFiveBytesAllIn) {
  for (const Profile& profile : {x86_profile(), headset_profile()}) {
    const double map = map::Map::bytes_per_voxel(profile.spine.map);
    const double lists =
        static_cast<double>(map::ActiveSet::bytes_needed(profile.spine.map.blocks_capacity)) /
        (static_cast<double>(profile.spine.map.blocks_capacity) * map::kBlockVoxels);
    std::printf("bytes per voxel, %s: map %.3f, lists %.3f\n", profile.name.data(), map, lists);
    EXPECT_LE(map + lists, kBytesPerVoxelMax);
    EXPECT_GE(map, 3) << "a distance and a weight alone are 3";
  }
}

TEST(MemoryBudget, TheX86TableIsTheOneThatWasAgreedOn) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "structures of libraries have other sizes on this architecture";
#else
  const char* golden_file = TACTUS_SOURCE_DIR "/tests/budget/plan_x86.txt";
  std::ifstream in(golden_file);
  ASSERT_TRUE(in) << golden_file << " is absent";
  const std::string golden(std::istreambuf_iterator<char>(in), {});
  const auto now = firmware::plan({});
  ASSERT_TRUE(now) << now.error().message;
  EXPECT_EQ(*now, golden)
      << "If the change is wanted: tactus plan > tests/budget/plan_x86.txt, and commit it.";
#endif
}

}  // namespace
}  // namespace tactus
