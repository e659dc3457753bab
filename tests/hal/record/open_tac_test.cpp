// What a recording gives to its reader: ranges, clocks, truth, labels, gravity, facts.
#include <gtest/gtest.h>

#include <cmath>

#include "hal/record/tac.hpp"
#include "tests/hal/record/small_recording.hpp"

namespace tactus::hal::record {
namespace {

std::vector<std::uint64_t> numbers_of(const std::vector<FrameHeader>& headers) {
  std::vector<std::uint64_t> out;
  for (const FrameHeader& header : headers) out.push_back(header.sequence);
  return out;
}

using Numbers = std::vector<std::uint64_t>;

class OpenTac : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "a.tac"; }
  [[nodiscard]] std::unique_ptr<TacWriter> writer(const Sensor& sensor) const {
    auto out = TacWriter::create(path(), sensor, {}, {.waits_when_full = true});
    EXPECT_TRUE(out) << out.error().message;
    return std::move(*out);
  }
  [[nodiscard]] Sensor open(const TacReadOptions& options = {}) const {
    auto out = open_tac(path(), options);
    if (!out) {
      ADD_FAILURE() << out.error().message;
      std::abort();
    }
    return std::move(*out);
  }
  test::TemporaryFolder folder_;
};

TEST_F(OpenTac, RangePlaysItsNumbersWithTheColourNearThem) {
  record(path(), {});
  Sensor sut = open({.first = 2, .last = 6});
  EXPECT_EQ(sut.frames_count, 4U);
  const Played played = play(sut);
  EXPECT_EQ(numbers_of(played.depth_headers), (Numbers{2, 3, 4, 5}));
  EXPECT_EQ(numbers_of(played.color_headers), (Numbers{2, 3, 4, 5})) << "3 ms later each; 30 ms away at both ends";
  EXPECT_TRUE(played.raw[0][0] == depth_frame(2));
}

TEST_F(OpenTac, RangeWithoutAFrameIsRefusedWithTheNumbersThereAre) {
  record(path(), {});
  const auto none = open_tac(path(), {.first = 20, .last = 30});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, rt::ExitCode::bad_usage);
  EXPECT_NE(none.error().message.find("0 to 8"), std::string::npos) << none.error().message;
}

TEST_F(OpenTac, NumbersAreTheDevicesWithItsGaps) {
  auto sut = writer(described_sensor());
  for (const std::uint64_t i : Numbers{1000, 1001, 1005, 1006}) {
    sut->take(Stream::depth, depth_frame(i).raw());
    sut->take(Stream::color, color_frame(PixelFormat::yuyv, i).raw());
  }
  ASSERT_TRUE(sut->close());
  Sensor whole = open(), part = open({.first = 1001, .last = 1006});
  EXPECT_EQ(numbers_of(play(whole).depth_headers), (Numbers{1000, 1001, 1005, 1006}));
  EXPECT_EQ(numbers_of(play(part).depth_headers), (Numbers{1001, 1005}));
  const auto facts = tac_facts(path());
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->streams[0].missing, 3U);
}

/// Colour's clock is an hour behind: only the arrivals say what belongs together.
TEST_F(OpenTac, TwoClocksAreBroughtTogetherByArrival) {
  Sensor sensor = described_sensor();
  sensor.has_two_clocks = true;
  auto sut = writer(sensor);
  for (std::uint64_t i = 0; i < 9; ++i) {
    sut->take(Stream::depth, depth_frame(i).raw());
    OwnedFrame color = color_frame(PixelFormat::rgb24, i);
    color.header.time.ns -= 3'600'000'000'000;
    sut->take(Stream::color, color.raw());
  }
  ASSERT_TRUE(sut->close());
  Sensor part = open({.first = 3, .last = 5});
  EXPECT_TRUE(part.has_two_clocks);
  const Played played = play(part);
  EXPECT_EQ(numbers_of(played.color_headers), (Numbers{3, 4}));
  EXPECT_EQ(played.color_headers[0].arrived, header_of(3, 3'000'000).arrived);
}

TEST_F(OpenTac, FramesThatAreNotLaterArePassedOverAndCounted) {
  auto sut = writer(described_sensor(false));
  for (const std::uint64_t i : Numbers{0, 1, 1, 0, 2}) sut->take(Stream::depth, depth_frame(i).raw());
  ASSERT_TRUE(sut->close());
  for (const std::size_t prefetch : {std::size_t{0}, std::size_t{2}}) {
    Sensor sensor = open({.prefetch = prefetch});
    const Played played = play(sensor);
    EXPECT_EQ(numbers_of(played.depth_headers), (Numbers{0, 1, 2}));
    EXPECT_EQ(played.counters[0].timestamps_rejected, 2U);
    EXPECT_NE(played.counters[0].first_rejection.find("depth frame 1"), std::string::npos)
        << played.counters[0].first_rejection;
  }
}

TEST_F(OpenTac, LabelsComeByNumber) {
  record(path(), {});
  Sensor sut = open({.first = 1});
  ASSERT_NE(sut.labels, nullptr);
  Bytes ids(kPixels);
  for (const std::uint64_t i : Numbers{8, 1, 4}) {
    ASSERT_EQ(sut.labels->read(i, ids), rt::Status::ok);
    EXPECT_EQ(ids, labels_of(i));
  }
  EXPECT_EQ(sut.labels->read(0, ids), rt::Status::skipped) << "not in the range";
  EXPECT_EQ(sut.labels->read(9, ids), rt::Status::skipped);
}

TEST_F(OpenTac, LabelsThatAreNoMaterialAreCorrupt) {
  auto sut = writer(described_sensor(false));
  sut->take(Stream::depth, depth_frame(0).raw());
  Bytes ids = labels_of(0);
  ids[7] = 23;
  ASSERT_TRUE(sut->add_labels(0, ids));
  ASSERT_TRUE(sut->close());
  Sensor sensor = open();
  EXPECT_EQ(sensor.labels->read(0, ids), rt::Status::corrupt);
}

TEST_F(OpenTac, GravityFollowsTheTruePosesToTheFirstFramePlayed) {
  record(path(), {});
  Sensor source = described_sensor();
  add_truth(source, 9);
  const Sensor whole = open(), part = open({.first = 5});
  EXPECT_EQ(*whole.gravity_depth, *source.gravity_depth);
  ASSERT_TRUE(part.gravity_depth);
  const Vec3d in_world = source.truth[0].T_world_depth.rotation * *source.gravity_depth;
  const Vec3d back = source.truth[5].T_world_depth.rotation * *part.gravity_depth;
  EXPECT_NEAR((back - in_world).norm(), 0, 1e-12);
  EXPECT_TRUE(part.notes.empty());
}

TEST_F(OpenTac, GravityIsUnknownWhereNoPoseLeads) {
  record(path(), {.has_truth = false});
  const Sensor part = open({.first = 5});
  EXPECT_FALSE(part.gravity_depth);
  ASSERT_EQ(part.notes.size(), 1U);
  EXPECT_NE(part.notes[0].find("gravity is unknown"), std::string::npos);
}

TEST_F(OpenTac, FactsCountEveryByte) {
  record(path(), {.frames_count = 20, .color = PixelFormat::nv12});
  const auto facts = tac_facts(path());
  ASSERT_TRUE(facts) << facts.error().message;
  EXPECT_EQ(facts->file_bytes, std::filesystem::file_size(path()));
  EXPECT_FALSE(facts->is_cut_off);
  EXPECT_EQ(facts->damaged_bytes, 0U);
  EXPECT_EQ(facts->labels_count, 20U);
  EXPECT_EQ(facts->poses_count, 20U);
  EXPECT_EQ(facts->chunks_count, 1 + 1 + 60 + 1 + 1U) << "header, truth, frames and labels, index, end";
  const TacFacts::OfStream &depth = facts->streams[0], &color = facts->streams[1];
  EXPECT_EQ(depth.frames, 20U);
  EXPECT_EQ(depth.raw_bytes, 20 * 2 * kPixels);
  EXPECT_EQ(color.raw_bytes, 20 * 3 * kPixels / 2);
  EXPECT_EQ(color.format, PixelFormat::nv12);
  EXPECT_GT(depth.ratio(), 1.2);
  EXPECT_EQ(depth.first_time, header_of(0).time);
  EXPECT_EQ(color.last_time, header_of(19, 3'000'000).time);
  EXPECT_LT(depth.stored_bytes + color.stored_bytes, facts->file_bytes);
  EXPECT_TRUE(facts->notes.empty());
}

TEST_F(OpenTac, OnlyRecordingsLookLikeOne) {
  record(path(), {.frames_count = 1});
  EXPECT_TRUE(is_tac(path()));
  EXPECT_FALSE(is_tac(folder_.path()));
  EXPECT_FALSE(is_tac(folder_.path() / "missing.tac"));
  EXPECT_FALSE(is_tac(folder_.write("b.tac", "\x89tactus")));
  EXPECT_FALSE(is_tac(folder_.write("c.tac", "# timestamp path\n")));
}

TEST_F(OpenTac, OtherFilesAreRefusedInOneSentenceThatNamesThem) {
  record(path(), {.frames_count = 1});
  std::string later = folder_.read("a.tac");
  later[kVersionAt] = 2;
  struct Case {
    std::filesystem::path path;
    const char* says;
  };
  for (const Case& c : {Case{folder_.path() / "missing.tac", "No such file"}, Case{folder_.path(), "not a regular file"},
                        Case{folder_.write("empty.tac", ""), "does not begin as one"},
                        Case{folder_.write("text.tac", std::string(500, 'x')), "does not begin as one"},
                        Case{folder_.write("later.tac", later), "version 2"},
                        Case{folder_.write("short.tac", folder_.read("a.tac").substr(0, 40)), "ends before"}}) {
    const auto sut = open_tac(c.path, {});
    ASSERT_FALSE(sut) << c.path;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
    EXPECT_EQ(sut.error().message.rfind(c.path.string(), 0), 0U) << sut.error().message;
    EXPECT_NE(sut.error().message.find(c.says), std::string::npos) << sut.error().message;
    EXPECT_FALSE(tac_facts(c.path));
  }
}

TEST_F(OpenTac, RecordingWithoutADepthFrameIsRefused) {
  auto sut = writer(described_sensor());
  sut->take(Stream::color, color_frame(PixelFormat::rgb24, 0).raw());
  ASSERT_TRUE(sut->close());
  const auto opened = open_tac(path(), {});
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, rt::ExitCode::bad_input);
  EXPECT_TRUE(tac_facts(path())) << "yet it can be looked at";
}

/// More than one index, and a copy of a copy is the same recording.
TEST_F(OpenTac, LongRecordingsHaveManyIndicesAndCopiesAreEqual) {
  constexpr std::uint64_t kFrames = kIndexEntries + 100;
  auto sut = writer(described_sensor(false));
  const OwnedFrame frame = depth_frame(0);
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    OwnedFrame numbered = frame;
    numbered.header = header_of(i);
    sut->take(Stream::depth, numbered.raw());
  }
  ASSERT_TRUE(sut->close());
  Sensor first = open({.prefetch = 2});
  EXPECT_EQ(first.frames_count, kFrames);
  EXPECT_TRUE(first.notes.empty());
  Sensor source = described_sensor(false);
  auto copier = TacWriter::create(folder_.path() / "b.tac", source, {}, {.waits_when_full = true});
  ASSERT_TRUE(copier);
  first.depth->set_tap(copier->get());
  std::vector<std::uint16_t> depth(kPixels);
  FrameHeader header;
  std::uint64_t count = 0;
  while (first.depth->read(depth, header, kLong) == rt::Status::ok) {
    ASSERT_EQ(header.sequence, count++);
  }
  EXPECT_EQ(count, kFrames);
  ASSERT_TRUE((*copier)->close());
  EXPECT_TRUE(folder_.read("a.tac") == folder_.read("b.tac"));
}

}  // namespace
}  // namespace tactus::hal::record
