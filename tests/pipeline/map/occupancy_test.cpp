#include "pipeline/map/occupancy.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <tuple>

namespace tactus::map {
namespace {

class OwnedOccupancy {
 public:
  explicit OwnedOccupancy(std::size_t blocks_capacity) {
    const std::size_t bytes = rt::round_up(Occupancy::bytes_needed(blocks_capacity), 64);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes)));
    rt::Slice slice({memory_.get(), bytes});
    sut.bind(slice, blocks_capacity);
  }
  Occupancy sut;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

TEST(Occupancy, LiveBlocksAreNeverDeniedAndEmptinessIsMostlyKnown) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  constexpr std::size_t kCapacity = 2000;
  OwnedOccupancy owned(kCapacity);
  Occupancy& sut = owned.sut;
  std::mt19937_64 random(kSeed);
  std::map<std::tuple<int, int, int>, bool> live;
  const auto any = [&] { return static_cast<int>(random() % 40) - 20; };
  for (int step = 0; step < 40000; ++step) {
    const BlockCoord at{any(), any(), any()};
    auto& is_live = live[{at.x, at.y, at.z}];
    if (is_live) {
      sut.remove(at);
      is_live = false;
    } else if (random() % 30 == 0) {  // some 2000 of 64000 live in the end
      sut.add(at);
      is_live = true;
    }
    if (step % 100 != 0) continue;
    for (const auto& [where, alive] : live) {
      const auto [x, y, z] = where;
      if (!alive) continue;
      EXPECT_TRUE(sut.may_hold(key_of({x, y, z})));
      EXPECT_TRUE(sut.may_hold_cube({x ^ 3, y ^ 1, z ^ 2})) << "another block of its cube";
    }
  }
  std::size_t empty = 0, denied = 0;
  for (const auto& [where, alive] : live) {
    const auto [x, y, z] = where;
    if (alive) {
      sut.remove({x, y, z});
      continue;
    }
    ++empty;
    denied += !sut.may_hold(key_of({x, y, z}));
  }
  EXPECT_GT(denied, empty * 6 / 10);
  for (const auto& [where, alive] : live) {
    const auto [x, y, z] = where;
    EXPECT_FALSE(sut.may_hold(key_of({x, y, z}))) << "everything was removed";
    EXPECT_FALSE(sut.may_hold_cube({x, y, z}));
  }
}

TEST(Occupancy, CountThatIsFullStaysSetRatherThanDenyingALiveBlock) {
  OwnedOccupancy owned(64);
  Occupancy& sut = owned.sut;
  for (int i = 0; i < 300; ++i) sut.add({1, 2, 3});  // as 300 blocks of one bit would
  for (int i = 0; i < 299; ++i) sut.remove({1, 2, 3});
  EXPECT_TRUE(sut.may_hold(key_of({1, 2, 3})));
}

}  // namespace
}  // namespace tactus::map
