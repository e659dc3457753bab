#include "tests/conformance/camera_suite.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <set>
#include <vector>

namespace tactus::hal::conformance {

Sensor CameraConformance::open() {
  auto sensor = GetParam().open();
  if (!sensor) {
    ADD_FAILURE() << sensor.error().message;
    std::abort();
  }
  return std::move(*sensor);
}

namespace {

constexpr rt::Duration kPatience{10'000'000'000};

/// A stream read to its end, pixels as hashes.
struct Session {
  std::vector<FrameHeader> headers;
  std::vector<std::uint64_t> hashes;
  std::uint64_t corrupt_count = 0;
  std::uint64_t values_forbidden = 0;  // 65535: backends map it to 0
  double value_largest = 0;
  CameraCounters counters;

  friend bool operator==(const Session& a, const Session& b) {
    if (a.headers.size() != b.headers.size()) return false;
    for (std::size_t i = 0; i < a.headers.size(); ++i)
      if (a.headers[i].time != b.headers[i].time || a.headers[i].sequence != b.headers[i].sequence)
        return false;
    return a.hashes == b.hashes && a.corrupt_count == b.corrupt_count &&
           a.counters.frames_delivered == b.counters.frames_delivered &&
           a.counters.frames_rejected == b.counters.frames_rejected &&
           a.counters.timestamps_rejected == b.counters.timestamps_rejected &&
           a.counters.first_rejection == b.counters.first_rejection;
  }
};

std::size_t values_count(const DepthCamera&, const Sensor& sensor) {
  const Intrinsics& k = sensor.calibration.depth;
  return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
}
std::size_t values_count(const ColorCamera&, const Sensor& sensor) {
  const Intrinsics& k = sensor.calibration.color;
  return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height) * 3;
}

template <typename Value>
std::uint64_t hash_of(const std::vector<Value>& values) {
  std::uint64_t hash = 14695981039346656037U;
  for (const Value value : values) hash = (hash ^ value) * 1099511628211U;
  return hash;
}

/// One stream, one read at a time; `fill` is what the memory holds before each read.
template <typename Camera, typename Value>
class Player {
 public:
  Player(Camera& camera, const Sensor& sensor, Value fill)
      : camera_(camera), fill_(fill), values_(values_count(camera, sensor)) {}

  /// False at the end.
  bool step(rt::Duration timeout) {
    values_.assign(values_.size(), fill_);
    FrameHeader header;
    switch (camera_.read(values_, header, timeout)) {
      case rt::Status::ok:
        break;
      case rt::Status::corrupt:
        ++session.corrupt_count;
        return true;
      case rt::Status::timeout:
        return true;
      case rt::Status::end_of_stream:
        session.counters = camera_.counters();
        return false;
      default:
        ADD_FAILURE() << "a status that read() does not promise";
        return false;
    }
    session.headers.push_back(header);
    session.hashes.push_back(hash_of(values_));
    if constexpr (sizeof(Value) == 2)
      for (const Value value : values_) {
        session.values_forbidden += value == 65535 ? 1 : 0;
        session.value_largest = std::max(session.value_largest, static_cast<double>(value));
      }
    return true;
  }
  void expect_end_stays() {
    for (int i = 0; i < 3; ++i) {
      FrameHeader header{{77}, 77, {}};
      EXPECT_EQ(camera_.read(values_, header, kPatience), rt::Status::end_of_stream);
      EXPECT_EQ(header.sequence, 77U) << "the end brings no header";
    }
    EXPECT_EQ(camera_.counters().frames_delivered, session.counters.frames_delivered);
  }

  Session session;

 private:
  Camera& camera_;
  Value fill_;
  std::vector<Value> values_;
};

using DepthPlayer = Player<DepthCamera, std::uint16_t>;
using ColorPlayer = Player<ColorCamera, std::uint8_t>;

struct Sessions {
  Session depth, color;
};

/// `depth_first`: all of depth, then all of colour; otherwise in turn, as the pipeline reads.
Sessions play(Sensor& sensor, bool depth_first, rt::Duration timeout, std::uint8_t fill) {
  DepthPlayer depth(*sensor.depth, sensor, static_cast<std::uint16_t>(fill * 257));
  std::unique_ptr<ColorPlayer> color;
  if (sensor.color) color = std::make_unique<ColorPlayer>(*sensor.color, sensor, fill);
  bool depth_goes_on = true, color_goes_on = color != nullptr;
  while (depth_goes_on || color_goes_on) {
    if (depth_goes_on) depth_goes_on = depth.step(timeout);
    if (color_goes_on && !(depth_first && depth_goes_on)) color_goes_on = color->step(timeout);
  }
  depth.expect_end_stays();
  if (color) color->expect_end_stays();
  return {depth.session, color ? color->session : Session{}};
}

void expect_possible(const Intrinsics& k) {
  EXPECT_GT(k.width, 0);
  EXPECT_GT(k.height, 0);
  EXPECT_GT(k.fx, 0);
  EXPECT_GT(k.fy, 0);
  EXPECT_GT(k.cx, 0);
  EXPECT_LT(k.cx, k.width);
  EXPECT_GT(k.cy, 0);
  EXPECT_LT(k.cy, k.height);
}

void expect_rotation(const Rotation& rotation) {
  const Rotation product = rotation * rotation.transposed();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) EXPECT_NEAR(product(row, column), row == column ? 1 : 0, 1e-6);
}

TEST_P(CameraConformance, CalibrationIsWhole) {
  Sensor sut = open();
  const RigCalibration& rig = sut.calibration;
  EXPECT_FALSE(sut.description.empty());
  EXPECT_GT(sut.frame_rate_hz, 0);
  expect_possible(rig.depth);
  EXPECT_GT(rig.depth_m_per_unit, 0);
  EXPECT_LT(rig.depth_m_per_unit, 0.1);
  EXPECT_EQ(rig.has_color, sut.color != nullptr);
  EXPECT_EQ(rig.has_color, GetParam().color_frames > 0);
  if (!rig.has_color) return;
  expect_possible(rig.color);
  expect_rotation(rig.T_color_depth.rotation);
  EXPECT_LT(rig.T_color_depth.translation.norm(), 1) << "metres between two cameras of one rig";
  if (rig.registered) {
    EXPECT_EQ(rig.color, rig.depth);
    EXPECT_EQ(rig.T_color_depth.translation, Vec3d{});
    EXPECT_EQ(rig.T_color_depth.rotation.m, Rotation{}.m);
  }
}

void expect_orderly(const Session& session, std::uint64_t delivered, std::uint64_t rejected) {
  EXPECT_EQ(session.headers.size(), delivered);
  EXPECT_EQ(session.counters.frames_delivered, delivered);
  EXPECT_EQ(session.counters.frames_rejected + session.counters.timestamps_rejected, rejected);
  EXPECT_EQ(session.counters.frames_rejected, session.corrupt_count)
      << "a rejected frame is told by its read()";
  EXPECT_EQ(session.counters.first_rejection.empty(), rejected == 0);
  std::uint64_t gaps = 0;
  for (std::size_t i = 1; i < session.headers.size(); ++i) {
    EXPECT_LT(session.headers[i - 1].time, session.headers[i].time) << "frame " << i;
    ASSERT_LT(session.headers[i - 1].sequence, session.headers[i].sequence) << "frame " << i;
    gaps += session.headers[i].sequence - session.headers[i - 1].sequence - 1;
  }
  EXPECT_LE(gaps, rejected + session.counters.frames_missing) << "a gap in the sequence is a rejected or a missing frame";
}

TEST_P(CameraConformance, FramesComeInOrderAndGapsAreCounted) {
  Sensor sut = open();
  const Sessions played = play(sut, false, kPatience, 0);
  expect_orderly(played.depth, GetParam().depth_frames, GetParam().depth_rejected);
  expect_orderly(played.color, GetParam().color_frames, GetParam().color_rejected);
  if (sut.frames_count > 0) {
    EXPECT_EQ(sut.frames_count,
              GetParam().depth_frames + GetParam().depth_rejected + played.depth.counters.frames_missing);
  }
}

TEST_P(CameraConformance, ReopeningGivesTheSameBytesHoweverRead) {
  Sensor first = open();
  const Sessions reference = play(first, false, kPatience, 0);
  // Other memory contents before each read would show pixels left unwritten.
  Sensor second = open();
  const Sessions other_fill = play(second, false, kPatience, 0xA5);
  EXPECT_TRUE(other_fill.depth == reference.depth);
  EXPECT_TRUE(other_fill.color == reference.color);
  Sensor third = open();
  const Sessions one_by_one = play(third, true, kPatience, 0);
  EXPECT_TRUE(one_by_one.depth == reference.depth);
  EXPECT_TRUE(one_by_one.color == reference.color);
}

TEST_P(CameraConformance, ImpatientReaderLosesNothing) {
  Sensor first = open(), second = open();
  const Sessions reference = play(first, false, kPatience, 0);
  const Sessions impatient = play(second, false, rt::Duration{100'000}, 0);
  EXPECT_TRUE(impatient.depth == reference.depth);
  EXPECT_TRUE(impatient.color == reference.color);
}

/// The colour stream by peek() alone, every third frame passed over.
TEST_P(CameraConformance, PeekSaysWhatReadGivesAndSkipPassesOver) {
  Sensor first = open(), second = open();
  if (!first.color) GTEST_SKIP() << "this sensor has no colour camera";
  const Session reference = play(first, true, kPatience, 0).color;
  std::vector<std::uint8_t> pixels(values_count(*second.color, second));
  std::vector<FrameHeader> headers;
  std::size_t read_index = 0;
  for (int i = 0;; ++i) {
    FrameHeader announced, header;
    rt::Status status = second.color->peek(announced, kPatience);
    if (status == rt::Status::end_of_stream) break;
    if (status == rt::Status::corrupt) continue;
    ASSERT_EQ(status, rt::Status::ok);
    FrameHeader again;
    ASSERT_EQ(second.color->peek(again, kPatience), rt::Status::ok);
    EXPECT_EQ(again.sequence, announced.sequence) << "a look takes nothing";
    if (i % 3 == 2) {
      second.color->skip();
      continue;
    }
    status = second.color->read(pixels, header, kPatience);
    if (status == rt::Status::corrupt) continue;
    ASSERT_EQ(status, rt::Status::ok);
    EXPECT_EQ(header.sequence, announced.sequence);
    EXPECT_EQ(header.time, announced.time);
    while (read_index < reference.headers.size() && reference.headers[read_index].sequence != header.sequence) ++read_index;
    ASSERT_LT(read_index, reference.headers.size());
    EXPECT_EQ(hash_of(pixels), reference.hashes[read_index]) << "frame " << header.sequence;
  }
  FrameHeader header;
  EXPECT_EQ(second.color->read(pixels, header, kPatience), rt::Status::end_of_stream);
  EXPECT_EQ(second.color->counters().frames_delivered, reference.counters.frames_delivered);
  EXPECT_EQ(second.color->counters().frames_rejected, reference.counters.frames_rejected);
  EXPECT_EQ(second.color->counters().timestamps_rejected, reference.counters.timestamps_rejected);
}

/// Keeps the order and the hashes of what it is shown.
class Witness final : public FrameTap {
 public:
  void take(Stream stream, const RawFrame& frame) noexcept override {
    sequences[static_cast<std::size_t>(stream)].push_back(frame.header.sequence);
    if (frame.bytes.empty() || frame.width < 1 || frame.height < 1) ++unusable_count;
  }
  std::array<std::vector<std::uint64_t>, 2> sequences;
  int unusable_count = 0;
};

TEST_P(CameraConformance, TapSeesEveryFrameOnceReadOrSkipped) {
  Sensor first = open(), second = open();
  const Sessions reference = play(first, true, kPatience, 0);
  Witness witness;
  second.depth->set_tap(&witness);
  if (second.color) second.color->set_tap(&witness);
  std::vector<std::uint16_t> depth(values_count(*second.depth, second));
  FrameHeader header;
  rt::Status status = rt::Status::ok;
  while ((status = second.depth->read(depth, header, kPatience)) != rt::Status::end_of_stream)
    ASSERT_TRUE(status == rt::Status::ok || status == rt::Status::corrupt);
  if (second.color) {
    std::vector<std::uint8_t> rgb(values_count(*second.color, second));
    for (int i = 0;; ++i) {
      status = second.color->peek(header, kPatience);
      if (status == rt::Status::end_of_stream) break;
      if (status == rt::Status::corrupt) continue;
      if (i % 2 == 0)
        second.color->skip();
      else
        (void)second.color->read(rgb, header, kPatience);
    }
  }
  const auto sequences = [](const Session& session) {
    std::vector<std::uint64_t> out;
    for (const FrameHeader& h : session.headers) out.push_back(h.sequence);
    return out;
  };
  const std::array delivered = {sequences(reference.depth), sequences(reference.color)};
  for (std::size_t stream = 0; stream < delivered.size(); ++stream) {
    const auto& seen = witness.sequences[stream];
    if (!GetParam().loses_after_tap) {
      EXPECT_EQ(seen, delivered[stream]);
      continue;
    }
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end(), std::less_equal<>()) || seen.size() < 2) << "none twice";
    EXPECT_TRUE(std::includes(seen.begin(), seen.end(), delivered[stream].begin(), delivered[stream].end()));
  }
  EXPECT_EQ(witness.unusable_count, 0);
}

TEST_P(CameraConformance, TwoSensorsDoNotDisturbEachOther) {
  Sensor alone = open(), a = open(), b = open();
  const Sessions reference = play(alone, false, kPatience, 0);
  DepthPlayer player_a(*a.depth, a, 0), player_b(*b.depth, b, 0);
  bool a_goes_on = true, b_goes_on = true;
  for (int i = 0; a_goes_on || b_goes_on; ++i) {
    if (a_goes_on) a_goes_on = player_a.step(kPatience);
    if (b_goes_on && i % 3 != 0) b_goes_on = player_b.step(kPatience);
  }
  EXPECT_TRUE(player_a.session == reference.depth);
  EXPECT_TRUE(player_b.session == reference.depth);
}

TEST_P(CameraConformance, ClosingEarlyIsClean) {
  for (int reads = 0; reads < 3; ++reads) {
    Sensor sut = open();
    DepthPlayer player(*sut.depth, sut, 0);
    for (int i = 0; i < reads; ++i) player.step(kPatience);
    EXPECT_LE(player.session.headers.size(), static_cast<std::size_t>(reads));
  }
}

TEST_P(CameraConformance, ZeroIsTheOnlyInvalidDepth) {
  Sensor sut = open();
  const Session depth = play(sut, false, kPatience, 0).depth;
  EXPECT_EQ(depth.values_forbidden, 0U);
  EXPECT_GT(depth.value_largest, 0) << "no measurement in the whole session";
  EXPECT_LT(depth.value_largest * sut.calibration.depth_m_per_unit, 100) << "metres";
}

TEST_P(CameraConformance, ColourHasPartnersInTime) {
  Sensor sut = open();
  if (!sut.color) GTEST_SKIP() << "this sensor has no colour camera";
  const Sessions played = play(sut, false, kPatience, 0);
  std::uint64_t partners_count = 0;
  for (const FrameHeader& depth : played.depth.headers)
    for (const FrameHeader& color : played.color.headers)
      partners_count += std::abs(depth.time.ns - color.time.ns) <= 20'000'000 ? 1U : 0U;
  EXPECT_GE(2 * partners_count, played.depth.headers.size()) << "of half of the frames at least";
}

TEST_P(CameraConformance, TruthIsSound) {
  Sensor sut = open();
  for (std::size_t i = 0; i < sut.truth.size(); ++i) {
    if (i > 0) {
      EXPECT_LT(sut.truth[i - 1].time, sut.truth[i].time);
    }
    EXPECT_TRUE(sut.truth[i].T_world_depth.is_finite());
    expect_rotation(sut.truth[i].T_world_depth.rotation);
  }
  if (sut.gravity_depth) {
    EXPECT_NEAR(sut.gravity_depth->norm(), 1, 1e-9);
  }
  const Session depth = play(sut, false, kPatience, 0).depth;
  ASSERT_FALSE(depth.headers.empty());
  if (!sut.truth.empty()) {
    EXPECT_LE(sut.truth.front().time.ns, depth.headers.back().time.ns);
    EXPECT_GE(sut.truth.back().time.ns, depth.headers.front().time.ns);
  }
  if (!sut.labels) return;
  std::vector<std::uint8_t> ids(values_count(*sut.depth, sut), 200);
  for (const FrameHeader& header : depth.headers) {
    ASSERT_EQ(sut.labels->read(header.sequence, ids), rt::Status::ok) << "frame " << header.sequence;
    const std::set<std::uint8_t> found(ids.begin(), ids.end());
    for (const std::uint8_t id : found) EXPECT_TRUE(id < 23 || id == 255) << int{id};
  }
  EXPECT_NE(sut.labels->read(depth.headers.back().sequence + 1'000'000, ids), rt::Status::ok);
}

}  // namespace
}  // namespace tactus::hal::conformance
