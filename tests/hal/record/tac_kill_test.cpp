// A recorder that is killed, two hundred times, wherever it happens to be.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <new>
#include <random>

#include "hal/frames/convert.hpp"
#include "hal/record/tac.hpp"
#include "hal/record/tac_writer.hpp"
#include "tests/hal/record/depth_pictures.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::record {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr std::uint64_t kPictures = 6;
using Depth = std::vector<std::uint16_t>;

/// Frame i is picture i modulo kPictures: noise, which makes the longest writes, and walls, which make short ones.
Depth picture(std::uint64_t i) {
  const DepthKind kind = i % 2 == 0 ? DepthKind::noise : DepthKind::disparity;
  return depth_picture(kind, kWidth, kHeight, static_cast<unsigned>(i % kPictures) + 1);
}

FrameHeader header_of(std::uint64_t i) {
  return {{static_cast<std::int64_t>(i) * 1'000'000 + 1}, i, {static_cast<std::int64_t>(i) + 7}};
}

/// What the child has seen written, in memory that outlives it.
struct Witness {
  std::atomic<bool> has_begun{false};
  std::atomic<std::uint64_t> written{0};
};

/// Records as fast as it can until it is killed.
[[noreturn]] void record_until_killed(const std::filesystem::path& path, const std::vector<Depth>& pictures,
                                      Witness& witness) {
  Sensor sensor;
  sensor.description = "a camera";
  sensor.calibration.depth = {kWidth, kHeight, 600, 600, 320, 240, 0, 0, 0, 0, 0};
  auto writer = TacWriter::create(path, sensor, {}, {.frames_waiting = 3, .waits_when_full = true});
  if (!writer) _exit(1);
  witness.has_begun.store(true);
  for (std::uint64_t i = 0;; ++i) {
    (*writer)->take(Stream::depth, frames::raw_frame(pictures[i % kPictures], header_of(i), kWidth, kHeight));
    witness.written.store((*writer)->was().streams[0].written, std::memory_order_relaxed);
  }
}

TEST(TacKill, KilledTwoHundredTimesNothingBeforeTheLastChunkIsLost) {
  const unsigned seed = std::random_device{}();
  std::mt19937 random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  std::vector<Depth> pictures;
  for (std::uint64_t i = 0; i < kPictures; ++i) pictures.push_back(picture(i));
  // 65535 is no measurement, and read() says so; the noise holds some.
  std::vector<Depth> expected = pictures;
  for (Depth& depth : expected) std::replace(depth.begin(), depth.end(), std::uint16_t{65535}, std::uint16_t{0});
  void* shared = mmap(nullptr, sizeof(Witness), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto& witness = *new (shared) Witness;

  constexpr int kRounds = 200, kEarlyRounds = 20;  // the early ones are killed while the file is made
  std::uint64_t frames_count = 0, torn_count = 0, played_count = 0;
  for (int round = 0; round < kRounds + kEarlyRounds; ++round) {
    std::filesystem::remove(path);
    witness.written.store(0);
    witness.has_begun.store(false);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) record_until_killed(path, pictures, witness);
    const bool is_early = round >= kRounds;
    constexpr timespec kMoment{0, 100'000};
    for (int i = 0; !is_early && !witness.has_begun.load() && i < 100'000; ++i) nanosleep(&kMoment, nullptr);
    const timespec wait{0, static_cast<long>(random() % (is_early ? 20'000'000 : 60'000'000))};
    nanosleep(&wait, nullptr);
    ASSERT_EQ(kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it went by itself";

    const std::uint64_t written = witness.written.load();
    auto sensor = open_tac(path, {});
    if (!sensor) {
      ASSERT_EQ(written, 0U) << sensor.error().message;
      ASSERT_EQ(sensor.error().code, rt::ExitCode::bad_input);
      continue;
    }
    ++played_count;
    const auto facts = tac_facts(path);
    ASSERT_TRUE(facts);
    EXPECT_TRUE(facts->is_cut_off);
    torn_count += facts->damaged_bytes > 0 ? 1U : 0U;
    Depth depth(static_cast<std::size_t>(kWidth) * kHeight);
    FrameHeader header;
    std::uint64_t i = 0;
    for (; sensor->depth->read(depth, header, {}) == rt::Status::ok; ++i) {
      ASSERT_EQ(header.sequence, i) << "round " << round;
      ASSERT_EQ(header.time, header_of(i).time);
      ASSERT_EQ(header.arrived, header_of(i).arrived);
      ASSERT_EQ(depth, expected[i % kPictures]) << "round " << round << " frame " << i;
    }
    ASSERT_GE(i, written) << "round " << round << ": a frame was written and is lost";
    ASSERT_EQ(sensor->depth->counters().frames_rejected, 0U);
    frames_count += i;
  }
  munmap(shared, sizeof(Witness));
  std::printf("seed %u: %llu of %d recordings hold frames, %llu frames, %llu torn chunks\n", seed,
              static_cast<unsigned long long>(played_count), kRounds + kEarlyRounds, static_cast<unsigned long long>(frames_count),
              static_cast<unsigned long long>(torn_count));
  EXPECT_GT(played_count, 100U) << "killed too early to mean anything";
}

}  // namespace
}  // namespace tactus::hal::record
