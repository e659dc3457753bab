// A program that does not link tactus_heap_guard runs the same code, uncounted.
#include <gtest/gtest.h>

#include <memory>

#include "rt/heap_guard.hpp"

namespace tactus::rt {
namespace {

TEST(HeapGuard, SaysThatItIsInactiveWhenNotLinked) {
  EXPECT_FALSE(heap_guard::is_active());
  heap_guard::seal();
  {
    const RtScope scope;
    const auto unseen = std::make_unique<int>(1);
    EXPECT_EQ(*unseen, 1);
  }
  heap_guard::unseal();
  EXPECT_EQ(heap_guard::was_total_calls(), 0U);
}

}  // namespace
}  // namespace tactus::rt
