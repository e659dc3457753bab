// `tactus study stats`, from its CSV to what it prints.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>

#include "firmware_host/ratings_file.hpp"
#include "tests/firmware_host/study_commands.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

const std::string kHeader =
    "participant,confirmed,rating_none,viewed_none_s,rating_semantic,viewed_semantic_s,background_fps,feedback\n";

test::Outcome stats(const std::filesystem::path& file, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {"stats", file.string()};
  words.insert(words.end(), more.begin(), more.end());
  return test::call_study(words);
}

std::filesystem::path write(const test::TemporaryFolder& folder, const std::string& text) {
  const auto path = folder.path() / "ratings.csv";
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

TEST(RatingsFile, QuotesLineEndsAndTheByteOrderMarkAreRead) {
  const auto sut = parse_ratings("\xEF\xBB\xBF" + kHeader.substr(0, kHeader.size() - 1) +
                                     "\r\n\"Ann, the first\",yes,3,12,8.5,20,yes,\"said \"\"good\"\"\nand left\"\r\n"
                                     "\r\nBob,1, 4 ,10,7,10,no,\r\n",
                                 "f.csv");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->conditions, (std::vector<std::string>{"none", "semantic"}));
  EXPECT_EQ(sut->factors, std::vector<std::string>{"fps"});
  ASSERT_EQ(sut->answers.size(), 2u);
  EXPECT_EQ(sut->answers[0].participant, "Ann, the first");
  EXPECT_EQ(sut->answers[0].ratings, (std::vector<double>{3, 8.5}));
  EXPECT_EQ(sut->answers[1].backgrounds, std::vector<std::string>{"no"});
  EXPECT_EQ(sut->answers[1].left_out, LeftOut::no) << "ten seconds are enough";
}

TEST(RatingsFile, WhoIsLeftOutAndWhy) {
  const auto sut = parse_ratings(kHeader + "a,no,3,12,8,20,yes,\nb,yes,3,9.9,8,20,yes,\nc,yes,,12,8,20,no,\n"
                                           "d,yes,3,,8,20,no,\ne,yes,3,30,8,30,no,\n",
                                 "f.csv");
  ASSERT_TRUE(sut) << sut.error().message;
  ASSERT_EQ(sut->answers.size(), 5u);
  EXPECT_EQ(sut->answers[0].left_out, LeftOut::not_confirmed);
  EXPECT_EQ(sut->answers[1].left_out, LeftOut::viewed_too_briefly);
  EXPECT_EQ(sut->answers[2].left_out, LeftOut::unanswered);
  EXPECT_EQ(sut->answers[3].left_out, LeftOut::viewed_too_briefly) << "no time is no viewing";
  EXPECT_EQ(sut->answers[4].left_out, LeftOut::no);
}

TEST(RatingsFile, WhatIsWrongIsNamedWithItsLine) {
  const struct {
    std::string text, message;
  } cases[] = {
      {"", "f.csv:1: the file is empty"},
      {"participant,rating_a,viewed_a_s\n", "f.csv:1: the header has no column confirmed"},
      {"participant,confirmed,rating_a\n", "f.csv:1: there is rating_a but no viewed_a_s"},
      {"participant,confirmed,rating_a,viewed_a_s\n", "f.csv:1: the header needs a column rating_CONDITION for two"},
      {"participant,confirmed,participant\n", "f.csv:1: the column participant is there twice"},
      {kHeader + "a,yes,3,12\n", "f.csv:2: there are 4 fields where the header has 8"},
      {kHeader + "a,perhaps,3,12,8,20,yes,\n", "f.csv:2: confirmed is 'perhaps', expected yes or no"},
      {kHeader + "a,yes,3,12,8,20,yes,\n\nb,yes,3,12,11,20,no,\n", "f.csv:4: rating_semantic is '11', expected a rating"},
      {kHeader + "a,yes,nan,12,8,20,yes,\n", "f.csv:2: rating_none is 'nan'"},
      {kHeader + "a,yes,3,-1,8,20,yes,\n", "f.csv:2: viewed_none_s is '-1'"},
      {kHeader + "a,yes,3,inf,8,20,yes,\n", "f.csv:2: viewed_none_s is 'inf'"},
      {kHeader + "a,yes,3,12,8,20,yes,\na,yes,3,12,8,20,yes,\n", "f.csv:3: participant is 'a'"},
      {kHeader + "a,yes,3,12,8,20,yes,\"open\n", "f.csv:2: a quote is opened"},
  };
  for (const auto& [text, message] : cases) {
    const auto sut = parse_ratings(text, "f.csv");
    ASSERT_FALSE(sut) << text;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
    EXPECT_EQ(sut.error().message.substr(0, message.size()), message);
  }
}

TEST(RatingsFile, AnyBytesAreReadOrRefused) {
  const std::string bytes = "a,yes\"\n\r1.\x00\xFF\t_";
  for (unsigned seed = 0; seed < 2000; ++seed) {
    std::mt19937 random(seed);
    std::string text = random() % 2 != 0 ? kHeader : "";
    for (std::size_t i = random() % 200; i > 0; --i) text += bytes[random() % bytes.size()];
    const auto sut = parse_ratings(text, "f.csv");
    if (!sut) { ASSERT_EQ(sut.error().message.substr(0, 6), "f.csv:") << "seed " << seed; }
  }
}

// 62 of 68 answers count, as in the paper; every number that is printed is in the JSON too.
TEST(StudyStats, SaysWhatTheAnswersSayAndWritesThePlot) {
  const test::TemporaryFolder folder;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::ostringstream csv;
  csv << "participant,confirmed,rating_none,viewed_none_s,rating_uniform,viewed_uniform_s,rating_semantic,viewed_semantic_s,"
         "background_fps\n";
  const auto rating = [&](double mean) { return std::min(10.0, std::max(1.0, std::nearbyint(mean + 1.5 * normal(random)))); };
  for (int i = 0; i < 68; ++i)
    csv << i << (i < 2 ? ",no," : ",yes,") << rating(3.7) << (i < 6 ? ",9," : ",30,") << rating(5.9) << ",30,"
        << rating(8.4) << ",30," << (i % 3 == 0 ? "no" : "yes") << "\n";
  const auto file = write(folder, csv.str());

  const test::Outcome text = stats(file, {"--out", (folder.path() / "out").string()});
  ASSERT_EQ(text.code, 0) << text.err;
  for (const char* part : {"68 answers; left out: 2 not confirmed, 4 that watched", "62 analysed", "Sphericity (Mauchly): W = ",
                           "Conditions: F(", "none - semantic: -", "t(61) = ", "Background fps (no ", "with the conditions F(",
                           "fixes W = 0.496 and epsilon = 0.665, hence F(1.330, 81.136)", "partial eta2 of 0.777",
                           "The mean of semantic, 8.427, is not one of 62 whole ratings; with half points it is.",
                           "69.57 % (had played first-person shooters) is no number of 62 people; of up to 70 it could be 23 46 69."})
    EXPECT_NE(text.out.find(part), std::string::npos) << part << "\n" << text.out;
  EXPECT_EQ(text.out.find("The mean of none"), std::string::npos);

  const auto json = nlohmann::json::parse(std::ifstream(folder.path() / "out" / "stats.json"));
  EXPECT_EQ(json["analysed"], 62);
  EXPECT_GT(json["anova"]["corrected"]["f"], 50);
  EXPECT_LT(json["anova"]["corrected"]["p"], 0.001);
  EXPECT_EQ(json["pairs"].size(), 3u);
  EXPECT_GT(json["backgrounds"][0]["between"]["p"], 0.001) << "the background was drawn by lot";
  std::ifstream svg(folder.path() / "out" / "ratings.svg");
  const std::string drawing(std::istreambuf_iterator<char>(svg), {});
  EXPECT_EQ(drawing.substr(0, 4), "<svg");
  for (const char* name : {">none<", ">uniform<", ">semantic<"}) EXPECT_NE(drawing.find(name), std::string::npos);

  const test::Outcome as_json = stats(file, {"--json"});
  EXPECT_EQ(nlohmann::json::parse(as_json.out)["anova"], json["anova"]);
}

TEST(StudyStats, TooFewAnswersAndMissingFilesAreOneSentence) {
  const test::TemporaryFolder folder;
  const test::Outcome few = stats(write(folder, kHeader + "a,yes,3,12,8,20,yes,\nb,no,3,12,8,20,yes,\n"));
  EXPECT_EQ(few.code, 3);
  EXPECT_NE(few.err.find("1 analysed; at least 2 are needed"), std::string::npos) << few.err;
  const test::Outcome missing = stats(folder.path() / "nothing.csv");
  EXPECT_EQ(missing.code, 3);
  EXPECT_NE(missing.err.find("nothing.csv"), std::string::npos);
}

TEST(StudyStats, TwoPeopleAndOneBackgroundAreNoProblem) {
  const test::TemporaryFolder folder;
  const test::Outcome sut = stats(write(folder, kHeader + "a,yes,3,12,8,20,yes,\nb,yes,4,12,8,20,yes,\n"));
  EXPECT_EQ(sut.code, 0) << sut.err;
  EXPECT_NE(sut.out.find("one group, nothing to compare"), std::string::npos);
}

// Tenths are not binary: what they leave of a difference that is the same for everybody is no error to divide by.
TEST(StudyStats, DifferencesThatAreTheSameForEverybodyHaveNoError) {
  const test::TemporaryFolder folder;
  const test::Outcome same = stats(write(folder, kHeader + "a,yes,3.1,12,5.3,20,yes,\nb,yes,4.1,12,6.3,20,no,\n"
                                                           "c,yes,3.7,12,5.9,20,yes,\nd,yes,4.7,12,6.9,20,no,\n"));
  ASSERT_EQ(same.code, 0) << same.err;
  EXPECT_NE(same.out.find("Conditions: F(1, 3) = infinity, p < .001, partial eta2 = 1.000"), std::string::npos) << same.out;
  EXPECT_NE(same.out.find("t(3) = -infinity, p < .001"), std::string::npos) << same.out;
  EXPECT_NE(same.out.find("with the conditions F(1, 2) = undefined, p = 1.000"), std::string::npos) << same.out;

  const test::Outcome none = stats(write(folder, kHeader + "a,yes,3.1,12,3.1,20,,\nb,yes,4.3,12,4.3,20,,\nc,yes,9.7,12,9.7,20,,\n"));
  ASSERT_EQ(none.code, 0) << none.err;
  EXPECT_NE(none.out.find("Conditions: F(1, 2) = undefined, p = 1.000, partial eta2 = undefined"), std::string::npos) << none.out;
  EXPECT_NE(none.out.find("none - semantic: 0.000 (0.000 to 0.000), t(2) = 0.000, p = 1.000"), std::string::npos) << none.out;
}

}  // namespace
}  // namespace tactus::firmware
