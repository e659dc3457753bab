#include "rt/static_vector.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <type_traits>
#include <vector>

namespace tactus::rt {
namespace {

static_assert(std::is_trivially_copyable_v<StaticVector<int, 4>>, "must travel through mailboxes");
static_assert([] {
  StaticVector<int, 3> v{1, 2};
  v.push_back(3);
  v.erase_unordered(0);
  return v.size() == 2 && v[0] == 3 && v[1] == 2;
}());

TEST(StaticVector, PushWhenFullIsRefusedAndChangesNothing) {
  StaticVector<int, 2> sut{1, 2};
  EXPECT_TRUE(sut.full());
  EXPECT_FALSE(sut.try_push_back(3));
  EXPECT_EQ(std::vector<int>(sut.begin(), sut.end()), (std::vector<int>{1, 2}));
}

TEST(StaticVector, RemovedElementsAreReset) {
  const auto shared = std::make_shared<int>(1);
  StaticVector<std::shared_ptr<int>, 2> sut{shared};
  sut.clear();
  EXPECT_EQ(shared.use_count(), 1);
}

TEST(StaticVectorDeathTest, OutOfBoundsIsABug) {
  StaticVector<int, 2> sut{1};
  EXPECT_DEATH(static_cast<void>(sut[1]), "assertion failed");
  sut.push_back(2);
  EXPECT_DEATH(sut.push_back(3), "assertion failed");
  EXPECT_DEATH(sut.resize(3), "assertion failed");
  sut.clear();
  EXPECT_DEATH(sut.pop_back(), "assertion failed");
}

TEST(StaticVector, BehavesAsStdVector) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  StaticVector<int, 8> sut;
  std::vector<int> model;
  for (int i = 0; i < 10'000; ++i) {
    switch (random() % 5) {
      case 0:
      case 1: {
        const bool was_pushed = sut.try_push_back(i);
        ASSERT_EQ(was_pushed, model.size() < 8);
        if (was_pushed) model.push_back(i);
        break;
      }
      case 2:
        if (!model.empty()) {
          const std::size_t index = random() % model.size();
          sut.erase_unordered(index);
          model[index] = model.back();
          model.pop_back();
        }
        break;
      case 3:
        if (!model.empty()) {
          sut.pop_back();
          model.pop_back();
        }
        break;
      default: {
        const std::size_t count = random() % 9;
        sut.resize(count);
        model.resize(count);
      }
    }
    ASSERT_EQ(std::vector<int>(sut.begin(), sut.end()), model);
  }
}

}  // namespace
}  // namespace tactus::rt
