#include "hal/input.hpp"

#include <gtest/gtest.h>

namespace tactus::hal {
namespace {

TEST(KeyOf, CharactersStandForThemselvesAndSmallLettersForCapitals) {
  for (const char character : {'L', 'H', 'P', 'M', '0', '9', '+', '~'})
    EXPECT_EQ(static_cast<char>(key_of(character)), character);
  EXPECT_EQ(key_of('l'), key_of('L'));
  EXPECT_EQ(key_of(' '), Key::space);
}

TEST(KeyOf, WhatIsNotPrintableIsNoKey) {
  for (const char character : {'\0', '\n', '\x1b', '\x7f', '\xe4'}) EXPECT_EQ(key_of(character), Key::none);
}

}  // namespace
}  // namespace tactus::hal
