// Recordings that something happened to: cut off anywhere, bytes turned over, tails that never reached the disk, and files
// beyond 4 GiB.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <random>

#include "hal/record/chunk.hpp"
#include "hal/record/crc32c.hpp"
#include "hal/record/little_endian.hpp"
#include "hal/record/tac_file.hpp"
#include "tests/hal/record/small_recording.hpp"

namespace tactus::hal::record {
namespace {

class DamagedTac : public testing::Test {
 protected:
  void SetUp() override {
    record(path(), kContent);
    whole_ = folder_.read("a.tac");
    const auto file = TacFile::open(path());
    ASSERT_TRUE(file) << file.error().message;
    entries_ = (*file)->entries();
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "a.tac"; }
  [[nodiscard]] std::filesystem::path write(const std::string& bytes) const { return folder_.write("b.tac", bytes); }
  /// Everything behind the frames cut off: the index and the end.
  [[nodiscard]] std::string without_index() const {
    const IndexEntry& last = entries_.back();
    return whole_.substr(0, static_cast<std::size_t>(last.offset + kChunkHeaderBytes + last.header.payload_bytes));
  }
  [[nodiscard]] const IndexEntry& depth_entry(std::size_t number) const {
    for (const IndexEntry& entry : entries_)
      if (entry.header.type == ChunkType::depth && entry.header.frame.sequence == number) return entry;
    std::abort();
  }

  static constexpr Content kContent{.frames_count = 5, .color = PixelFormat::yuyv};
  test::TemporaryFolder folder_;
  std::string whole_;
  std::vector<IndexEntry> entries_;
};

/// Nothing before the last whole chunk is lost: every length around the chunks' headers and ends that a file can have been
/// cut to, and every 13th within their payloads.
TEST_F(DamagedTac, CutOffAnywhereItPlaysUpToTheLastWholeChunk) {
  const std::uint64_t first_frame_end =
      depth_entry(0).offset + kChunkHeaderBytes + depth_entry(0).header.payload_bytes;
  for (std::size_t bytes = whole_.size(); bytes-- > 0;) {
    const bool is_near = std::any_of(entries_.begin(), entries_.end(), [&](const IndexEntry& entry) {
      return bytes + 4 >= entry.offset && bytes <= entry.offset + kChunkHeaderBytes + 4;
    });
    if (!is_near && bytes % 13 != 0) continue;
    ASSERT_EQ(truncate(path().c_str(), static_cast<off_t>(bytes)), 0);
    auto sensor = open_tac(path(), {});
    ASSERT_EQ(sensor.has_value(), bytes >= first_frame_end) << bytes << " bytes";
    if (!sensor) {
      EXPECT_EQ(sensor.error().code, rt::ExitCode::bad_input);
      continue;
    }
    std::array<std::size_t, 2> expected{};
    for (const IndexEntry& entry : entries_) {
      const bool is_whole = entry.offset + kChunkHeaderBytes + entry.header.payload_bytes <= bytes;
      if (!is_whole) break;
      if (entry.header.type == ChunkType::depth) ++expected[0];
      if (entry.header.type == ChunkType::color) ++expected[1];
    }
    EXPECT_EQ(sensor->frames_count, expected[0]);
    ASSERT_EQ(sensor->notes.empty(), false) << "a person is told";
    EXPECT_NE(sensor->notes[0].find("cut off"), std::string::npos) << sensor->notes[0];
    if (bytes % 97 != 0) continue;  // the rest of the proof takes a minute when done for all of them
    const Played played = play(*sensor);
    ASSERT_EQ(played.raw[0].size(), expected[0]) << bytes << " bytes";
    ASSERT_EQ(played.raw[1].size(), expected[1]) << bytes << " bytes";
    for (std::size_t i = 0; i < expected[0]; ++i) ASSERT_TRUE(played.raw[0][i] == depth_frame(i));
    for (std::size_t i = 0; i < expected[1]; ++i) ASSERT_TRUE(played.raw[1][i] == color_frame(PixelFormat::yuyv, i));
    EXPECT_EQ(played.counters[0].frames_rejected + played.counters[1].frames_rejected, 0U);
  }
}

/// With and without index, every byte of one frame's chunk turned over in turn.
TEST_F(DamagedTac, ADamagedFrameIsRejectedAndTheNextOnePlays) {
  const IndexEntry& victim = depth_entry(2);
  const auto chunk_bytes = static_cast<std::size_t>(kChunkHeaderBytes + victim.header.payload_bytes);
  for (const bool has_index : {true, false})
    for (std::size_t i = 0; i < chunk_bytes; i += i < kChunkHeaderBytes ? 1 : 31) {
      std::string bytes = has_index ? whole_ : without_index();
      const auto at = static_cast<std::size_t>(victim.offset) + i;
      bytes[at] = static_cast<char>(bytes[at] ^ 0x40);
      auto sensor = open_tac(write(bytes), {});
      ASSERT_TRUE(sensor) << sensor.error().message;
      const Played played = play(*sensor);
      ASSERT_EQ(played.raw[0].size(), 4U) << "byte " << i << (has_index ? "" : " without index");
      EXPECT_TRUE(played.raw[0][1] == depth_frame(1));
      EXPECT_TRUE(played.raw[0][2] == depth_frame(3));
      EXPECT_EQ(played.raw[1].size(), 5U);
      if (has_index || i >= kChunkHeaderBytes) {
        EXPECT_EQ(played.counters[0].frames_rejected, 1U);
        EXPECT_NE(played.counters[0].first_rejection.find("depth frame 2"), std::string::npos)
            << played.counters[0].first_rejection;
      } else {
        // What the chunk was nobody can say any more; its bytes are told, and its number is missing.
        EXPECT_EQ(played.counters[0].frames_rejected, 0U);
        EXPECT_NE(sensor->notes[0].find("belong to no chunk"), std::string::npos) << sensor->notes[0];
        const auto facts = tac_facts(folder_.path() / "b.tac");
        ASSERT_TRUE(facts);
        EXPECT_EQ(facts->damaged_bytes, chunk_bytes);
        EXPECT_EQ(facts->streams[0].missing, 1U);
      }
    }
}

TEST_F(DamagedTac, ADamagedIndexOrEndIsReplacedByTheChunksThemselves) {
  const std::size_t frames_end = without_index().size();
  for (std::size_t at = frames_end; at < whole_.size(); at += 13) {
    std::string bytes = whole_;
    bytes[at] = static_cast<char>(bytes[at] ^ 1);
    auto sensor = open_tac(write(bytes), {});
    ASSERT_TRUE(sensor) << sensor.error().message;
    EXPECT_EQ(sensor->frames_count, 5U) << "byte " << at;
    ASSERT_FALSE(sensor->notes.empty());
    const Played played = play(*sensor);
    ASSERT_EQ(played.raw[0].size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) ASSERT_TRUE(played.raw[0][i] == depth_frame(i));
    ASSERT_EQ(sensor->labels == nullptr, false);
  }
}

/// As a file system leaves it that writes the length before the pixels.
TEST_F(DamagedTac, TailsThatNeverReachedTheDiskAreNoError) {
  const IndexEntry& last = depth_entry(4);
  const auto at = static_cast<std::size_t>(last.offset);
  std::string zeros = without_index().substr(0, at + kChunkHeaderBytes);
  zeros.append(static_cast<std::size_t>(last.header.payload_bytes), '\0');
  const std::string nothing = without_index().substr(0, at) + std::string(5000, '\0');
  for (const std::string& bytes : {zeros, nothing}) {
    auto sensor = open_tac(write(bytes), {});
    ASSERT_TRUE(sensor) << sensor.error().message;
    const Played played = play(*sensor);
    EXPECT_EQ(played.raw[0].size(), 4U);
    EXPECT_EQ(played.raw[1].size(), 4U);
    EXPECT_EQ(played.counters[0].frames_rejected, 0U);
    EXPECT_NE(sensor->notes[0].find("cut off"), std::string::npos);
  }
}

TEST_F(DamagedTac, AnyBytesTurnedOverGiveASentenceOrFrames) {
  constexpr unsigned kSeed = 31;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 150; ++round) {
    std::string bytes = whole_;
    for (unsigned k = 0; k < 1 + random() % 6; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    auto sensor = open_tac(write(bytes), {});
    if (!sensor) {
      EXPECT_FALSE(sensor.error().message.empty()) << "seed " << kSeed << " round " << round;
      continue;
    }
    const Played played = play(*sensor);
    for (const OwnedFrame& frame : played.raw[0])
      ASSERT_TRUE(frame == depth_frame(frame.header.sequence)) << "seed " << kSeed << " round " << round;
  }
}

void append(const std::filesystem::path& path, const void* data, std::size_t count) {
  const int descriptor = open(path.c_str(), O_WRONLY | O_APPEND);
  ASSERT_GE(descriptor, 0);
  ASSERT_EQ(::write(descriptor, data, count), static_cast<ssize_t>(count));
  close(descriptor);
}

std::string chunk_of(ChunkHeader header, std::span<const std::uint8_t> payload) {
  header.payload_bytes = header.raw_bytes = payload.size();
  header.payload_crc = crc32c(payload);
  const ChunkHeaderBytes bytes = encode(header);
  std::string out(bytes.begin(), bytes.end());
  out.append(payload.begin(), payload.end());
  return out;
}

/// A chunk of a later kind, 5 GiB of nothing on the disk, in front of the last three frames.
TEST_F(DamagedTac, FramesBeyondFourGibibytesPlayWithAndWithoutIndex) {
  const auto cut = static_cast<std::size_t>(depth_entry(2).offset);
  const auto big = write(whole_.substr(0, cut));
  constexpr std::uint64_t kHole = std::uint64_t{5} << 30;
  const auto hole = encode(ChunkHeader{.type = static_cast<ChunkType>(200), .payload_bytes = kHole});
  append(big, hole.data(), hole.size());
  if (truncate(big.c_str(), static_cast<off_t>(cut + hole.size() + kHole)) != 0)
    GTEST_SKIP() << "this file system has no files of 5 GiB";
  const std::string rest = without_index().substr(cut);
  append(big, rest.data(), rest.size());
  const auto expect_frames = [&](std::size_t notes_count) {
    auto sensor = open_tac(big, {.prefetch = 1});
    ASSERT_TRUE(sensor) << sensor.error().message;
    EXPECT_EQ(sensor->notes.size(), notes_count);
    const Played played = play(*sensor);
    ASSERT_EQ(played.raw[0].size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(played.raw[0][i] == depth_frame(i));
      ASSERT_TRUE(played.raw[1][i] == color_frame(PixelFormat::yuyv, i));
    }
  };
  expect_frames(1);

  const auto scanned = TacFile::open(big);
  ASSERT_TRUE(scanned);
  ASSERT_EQ((*scanned)->entries().size(), entries_.size());
  EXPECT_GT((*scanned)->entries().back().offset, kHole);
  Bytes index(8);
  for (const IndexEntry& entry : (*scanned)->entries()) {
    index.resize(index.size() + 8);
    put(index.data() + index.size() - 8, entry.offset);
    const auto header = encode(entry.header);
    index.insert(index.end(), header.begin(), header.end());
  }
  EndCounts counts;
  counts.last_index_offset = std::filesystem::file_size(big);
  const auto end = encode(counts);
  const std::string tail = chunk_of({.type = ChunkType::index}, index) + chunk_of({.type = ChunkType::end}, end);
  append(big, tail.data(), tail.size());
  expect_frames(0);
}

TEST_F(DamagedTac, AnIndexThatLeadsInACircleIsNotFollowed) {
  const std::string frames = without_index();
  Bytes index(8);
  put(index.data(), static_cast<std::uint64_t>(frames.size()));  // the one before is itself
  EndCounts counts;
  counts.last_index_offset = frames.size();
  const auto end = encode(counts);
  const std::string tail = chunk_of({.type = ChunkType::index}, index) + chunk_of({.type = ChunkType::end}, end);
  auto sensor = open_tac(write(frames + tail), {});
  ASSERT_TRUE(sensor) << sensor.error().message;
  EXPECT_EQ(sensor->frames_count, 5U) << "found one by one";
  EXPECT_NE(sensor->notes[0].find("index is damaged"), std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::record
