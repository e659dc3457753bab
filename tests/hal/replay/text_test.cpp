#include "hal/replay/text.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace tactus::hal::replay {
namespace {

TEST(Seconds, UnixTimeKeepsEveryDigit) {
  // As a double this would be ...784000158 ns.
  EXPECT_EQ(parse_seconds_as_ns("1305031229.528784"), 1305031229528784000);
  EXPECT_EQ(parse_seconds_as_ns("1305031229.000000001"), 1305031229000000001);
  EXPECT_EQ(parse_seconds_as_ns("0.033333"), 33333000);
  EXPECT_EQ(parse_seconds_as_ns("7"), 7000000000);
  EXPECT_EQ(parse_seconds_as_ns("7."), 7000000000);
  EXPECT_EQ(parse_seconds_as_ns(".5"), 500000000);
  EXPECT_EQ(parse_seconds_as_ns("+1"), 1000000000);
}

TEST(Seconds, ExponentMovesThePoint) {
  EXPECT_EQ(parse_seconds_as_ns("1.305031229528784000e+09"), 1305031229528784000);
  EXPECT_EQ(parse_seconds_as_ns("3.3333e-2"), 33333000);
  EXPECT_EQ(parse_seconds_as_ns("1e-10"), 0);
  EXPECT_EQ(parse_seconds_as_ns("0e100"), 0);
}

TEST(Seconds, DigitsBeyondNanosecondsAreCutOff) {
  EXPECT_EQ(parse_seconds_as_ns("1.9999999999"), 1999999999);
}

TEST(Seconds, WhatIsNoTimeIsRefused) {
  for (const char* text : {"", ".", "+", "-1", "nan", "inf", "1.2.3", "1e", "1e+", "1e1.5", "0x10", "1 ",
                           "1e101", "12a", "9223372037", "1e18", "99999999999999999999"})
    EXPECT_EQ(parse_seconds_as_ns(text), std::nullopt) << text;
}

TEST(Seconds, LargestTimeFits) {
  EXPECT_EQ(parse_seconds_as_ns("9223372036.854775807"), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(parse_seconds_as_ns("9223372036.854775808"), std::nullopt);
}

TEST(Seconds, AnyNanosecondsReadBack) {
  const unsigned seed = 20240611;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 20000; ++i) {
    const auto ns = static_cast<std::int64_t>(random() >> (1 + random() % 62));
    std::string fraction = std::to_string(ns % 1'000'000'000);
    fraction.insert(0, 9 - fraction.size(), '0');
    EXPECT_EQ(parse_seconds_as_ns(std::to_string(ns / 1'000'000'000) + "." + fraction), ns);
  }
}

TEST(Number, OnlyFiniteWholeWordsCount) {
  EXPECT_EQ(parse_number("-1.5e-3"), -1.5e-3);
  EXPECT_EQ(parse_number("+2"), 2.0);
  for (const char* text : {"", "nan", "inf", "-inf", "1e999", "1,5", "1.5x", "-1.#IND", "0x1p3"})
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
}

TEST(Count, OnlyNonNegativeIntegersCount) {
  EXPECT_EQ(parse_count("640"), 640U);
  for (const char* text : {"", "-1", "+1", "6.4", "18446744073709551616", "1a"})
    EXPECT_EQ(parse_count(text), std::nullopt) << text;
}

TEST(LineReader, CountsLinesOfEveryEnding) {
  LineReader sut("one\r\n\ntwo");
  std::string_view line;
  ASSERT_TRUE(sut.next(line));
  EXPECT_EQ(line, "one");
  ASSERT_TRUE(sut.next(line));
  EXPECT_EQ(line, "");
  ASSERT_TRUE(sut.next(line));
  EXPECT_EQ(line, "two");
  EXPECT_EQ(sut.line_number(), 3);
  EXPECT_FALSE(sut.next(line));
}

TEST(Words, BlanksTabsAndCommasSeparate) {
  std::string_view rest = "  a,\tb  c ";
  EXPECT_EQ(next_word(rest), "a");
  EXPECT_EQ(next_word(rest), "b");
  EXPECT_EQ(next_word(rest), "c");
  EXPECT_EQ(next_word(rest), "");
  EXPECT_EQ(next_word(rest), "");
}

TEST(Quote, ControlCharactersAndLengthAreTamed) {
  EXPECT_EQ(quote("a\x1b[2Jb"), "\"a?[2Jb\"");
  EXPECT_EQ(quote(std::string(100, 'x')), "\"" + std::string(40, 'x') + "...\"");
}

}  // namespace
}  // namespace tactus::hal::replay
