#include "hal/record/record_ring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>
#include <thread>

namespace tactus::hal::record {
namespace {

TEST(RecordRing, RecordsOfAnySizeComeOutAsTheyWentIn) {
  constexpr unsigned kSeed = 21;
  std::mt19937 random(kSeed);
  for (const std::size_t bytes : {std::size_t{64}, std::size_t{1000}, std::size_t{4096}}) {
    RecordRing sut(bytes);
    std::deque<std::vector<std::uint8_t>> model;
    std::size_t refused_count = 0;
    for (int step = 0; step < 20000; ++step) {
      if (random() % 2 == 0) {
        std::vector<std::uint8_t> record(1 + random() % sut.record_bytes_max());
        for (auto& byte : record) byte = static_cast<std::uint8_t>(random());
        const auto room = sut.reserve(record.size());
        refused_count += room.empty() ? 1U : 0U;
        if (room.empty()) {
          ASSERT_FALSE(model.empty()) << "an empty ring takes any record; seed " << kSeed;
          continue;
        }
        ASSERT_EQ(room.size(), record.size());
        ASSERT_EQ(reinterpret_cast<std::uintptr_t>(room.data()) % 8, 0U);
        std::copy(record.begin(), record.end(), room.begin());
        if (random() % 8 == 0) continue;  // thought better of it: never handed over
        sut.commit();
        model.push_back(record);
      } else {
        const auto front = sut.front();
        ASSERT_EQ(front.empty(), model.empty()) << "seed " << kSeed;
        if (front.empty()) continue;
        ASSERT_TRUE(std::equal(front.begin(), front.end(), model.front().begin(), model.front().end()));
        sut.pop();
        model.pop_front();
      }
    }
    EXPECT_GT(refused_count, 0U);
  }
}

TEST(RecordRing, TwoThreadsLoseNothing) {
  RecordRing sut(2000);
  constexpr std::uint64_t kRecords = 50'000;
  std::thread producer([&] {
    std::mt19937 random(2);
    for (std::uint64_t i = 0; i < kRecords;) {
      const auto room = sut.reserve(8 + random() % 300);
      if (room.empty()) {
        std::this_thread::yield();
        continue;
      }
      for (std::size_t k = 0; k < room.size(); ++k) room[k] = static_cast<std::uint8_t>(i + k);
      sut.commit();
      ++i;
    }
  });
  std::uint64_t wrong_count = 0;
  for (std::uint64_t i = 0; i < kRecords;) {
    const auto front = sut.front();
    if (front.empty()) {
      std::this_thread::yield();
      continue;
    }
    for (std::size_t k = 0; k < front.size(); ++k) wrong_count += front[k] == static_cast<std::uint8_t>(i + k) ? 0U : 1U;
    sut.pop();
    ++i;
  }
  producer.join();
  EXPECT_EQ(wrong_count, 0U);
  EXPECT_TRUE(sut.front().empty());
}

}  // namespace
}  // namespace tactus::hal::record
