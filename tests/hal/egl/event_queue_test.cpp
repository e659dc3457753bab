#include "hal/egl/event_queue.hpp"

#include <gtest/gtest.h>

namespace tactus::hal::egl {
namespace {

using Kind = InputEvent::Kind;

InputEvent event(Kind kind, float x_px = 0) {
  InputEvent made;
  made.kind = kind;
  made.x_px = x_px;
  return made;
}

TEST(EventQueue, EventsComeInTheirOrder) {
  EventQueue sut;
  InputEvent taken;
  EXPECT_FALSE(sut.pop(taken));
  for (int round = 0; round < 100; ++round) {
    sut.push(event(Kind::key_down, 1));
    sut.push(event(Kind::key_up, 2));
    sut.push(event(Kind::button_down, 3));
    for (const float x_px : {1.0F, 2.0F, 3.0F}) {
      ASSERT_TRUE(sut.pop(taken));
      EXPECT_EQ(taken.x_px, x_px);
    }
  }
  EXPECT_FALSE(sut.pop(taken));
}

TEST(EventQueue, MovesInARowBecomeTheLastOfThemAndOthersStandBetween) {
  EventQueue sut;
  for (const float x_px : {1.0F, 2.0F, 3.0F}) sut.push(event(Kind::pointer_move, x_px));
  sut.push(event(Kind::button_down, 4));
  sut.push(event(Kind::pointer_move, 5));
  InputEvent taken;
  for (const float x_px : {3.0F, 4.0F, 5.0F}) {
    ASSERT_TRUE(sut.pop(taken));
    EXPECT_EQ(taken.x_px, x_px);
  }
  EXPECT_FALSE(sut.pop(taken));
}

TEST(EventQueue, FullItKeepsTheOldestAndCloseComesThroughAtTheEnd) {
  EventQueue sut;
  for (int i = 0; i < 100; ++i) sut.push(event(Kind::key_down, static_cast<float>(i)));
  sut.push(event(Kind::close));
  InputEvent taken;
  for (std::size_t i = 0; i < EventQueue::kCapacity; ++i) {
    ASSERT_TRUE(sut.pop(taken));
    EXPECT_EQ(taken.x_px, static_cast<float>(i));
  }
  ASSERT_TRUE(sut.pop(taken));
  EXPECT_EQ(taken.kind, Kind::close);
  EXPECT_FALSE(sut.pop(taken));
}

}  // namespace
}  // namespace tactus::hal::egl
