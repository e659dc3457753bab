// What each kind of fault does to a stream of known frames, and that nothing but the plan decides it.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "hal/faults/faults.hpp"
#include "tests/hal/faults/scripted_sensor.hpp"
#include "tests/hal/replay/counted_new.hpp"

namespace tactus::hal::faults {
namespace {

Fault fault_of(FaultKind kind, std::uint64_t first, std::uint64_t count = 1, std::uint64_t every = 1) {
  Fault fault;
  fault.kind = kind;
  fault.first = first;
  fault.count = count;
  fault.every = every;
  fault.delay = {40'000'000};
  fault.jump = {-500'000'000};
  fault.away_frames = kind == FaultKind::unplug ? 8 : 0;
  return fault;
}

std::vector<std::uint64_t> numbers(std::uint64_t first, std::uint64_t end) {
  std::vector<std::uint64_t> list(end - first);
  std::iota(list.begin(), list.end(), first);
  return list;
}

/// A sensor of so many frames with one fault in it.
struct Faulty {
  explicit Faulty(const Fault& fault, Script script = {}) : Faulty(FaultPlan{1, {fault}}, std::move(script)) {}
  explicit Faulty(const FaultPlan& plan, Script script = {}) : sensor(scripted_sensor(script, script)) {
    counts = inject(plan, sensor);
  }
  Sensor sensor;
  std::shared_ptr<const FaultCounts> counts;
};

void expect_untouched(const std::vector<Answer>& depth) {
  for (const Answer& answer : depth) {
    if (answer.status != rt::Status::ok) continue;
    EXPECT_EQ(answer.pixels_hash, true_depth_hash(answer.header.sequence)) << answer.header.sequence;
    EXPECT_EQ(answer.header.time, time_of(answer.header.sequence));
  }
}

TEST(Inject, EmptyPlanChangesNothing) {
  const Script script{.corrupt = {4, 9}, .has_arrivals = true};
  Faulty sut(FaultPlan{}, script);
  Sensor plain = scripted_sensor(script, script);
  EXPECT_EQ(read_depth(sut.sensor), read_depth(plain));
  EXPECT_EQ(read_color(sut.sensor), read_color(plain));
  EXPECT_EQ(sut.sensor.depth->counters().frames_delivered, 98U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_rejected, 2U);
  EXPECT_EQ(sut.sensor.depth->counters().first_rejection, "frame 4");
}

TEST(Inject, SensorSaysSo) {
  Faulty sut(FaultPlan{1, {fault_of(FaultKind::duplicate, 3), fault_of(FaultKind::out_of_order, 5)}});
  EXPECT_EQ(sut.sensor.description, "scripted, with faults injected");
  EXPECT_EQ(sut.sensor.buffers_bytes, kPixels * (3 * 2 + 2 * 3));
}

TEST(Inject, DroppedFramesLeaveAGap) {
  Faulty sut(fault_of(FaultKind::drop, 20, 6));
  const auto depth = read_depth(sut.sensor);
  auto expected = numbers(0, 20);
  const auto rest = numbers(26, 100);
  expected.insert(expected.end(), rest.begin(), rest.end());
  EXPECT_EQ(numbers_of(depth), expected);
  EXPECT_EQ(depth.size(), expected.size());
  expect_untouched(depth);
  EXPECT_EQ(numbers_of(read_color(sut.sensor)), expected);
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::drop), 6U);
  EXPECT_EQ(sut.counts->of(Stream::color, FaultKind::drop), 6U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_delivered, 94U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_missing, 6U);
}

TEST(Inject, StreamThatIsNotNamedIsLeftAlone) {
  Fault fault = fault_of(FaultKind::drop, 0, Fault::kEndless, 2);
  fault.hits_color = false;
  Faulty sut(fault);
  EXPECT_EQ(read_depth(sut.sensor).size(), 50U);
  EXPECT_EQ(numbers_of(read_color(sut.sensor)), numbers(0, 100));
  EXPECT_EQ(sut.counts->of(Stream::color, FaultKind::drop), 0U);
}

TEST(Inject, EveryBeginsWithFirst) {
  Faulty sut(fault_of(FaultKind::drop, 7, 3, 10));
  const auto got = numbers_of(read_depth(sut.sensor));
  auto expected = numbers(0, 100);
  std::erase_if(expected, [](std::uint64_t n) { return n == 7 || n == 17 || n == 27; });
  EXPECT_EQ(got, expected);
}

TEST(Inject, DuplicateComesTwiceWithTheSamePixels) {
  Faulty sut(fault_of(FaultKind::duplicate, 10, 2, 5));
  const auto depth = read_depth(sut.sensor);
  auto expected = numbers(0, 100);
  expected.insert(expected.begin() + 10, 10);
  expected.insert(expected.begin() + 16, 15);
  EXPECT_EQ(numbers_of(depth), expected);
  expect_untouched(depth);
  const auto color = read_color(sut.sensor);
  EXPECT_EQ(numbers_of(color), expected);
  for (const Answer& answer : color) EXPECT_EQ(answer.pixels_hash, true_color_hash(answer.header.sequence));
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::duplicate), 2U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_delivered, 102U);
}

TEST(Inject, OutOfOrderChangesPlacesWithItsSuccessor) {
  Faulty sut(fault_of(FaultKind::out_of_order, 10, 2, 5));
  const auto depth = read_depth(sut.sensor);
  auto expected = numbers(0, 100);
  std::swap(expected[10], expected[11]);
  std::swap(expected[15], expected[16]);
  EXPECT_EQ(numbers_of(depth), expected);
  EXPECT_EQ(numbers_of(read_color(sut.sensor)), expected);
  expect_untouched(depth);
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::out_of_order), 2U);
}

TEST(Inject, OutOfOrderEverywhereSwapsPairs) {
  Faulty sut(fault_of(FaultKind::out_of_order, 0, Fault::kEndless), {.frames_count = 7});
  EXPECT_EQ(numbers_of(read_depth(sut.sensor)), (std::vector<std::uint64_t>{1, 0, 3, 2, 5, 4, 6}));
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::out_of_order), 3U) << "the last frame had no successor";
}

TEST(Inject, OutOfOrderWaitsForAGoodSuccessor) {
  Faulty sut(fault_of(FaultKind::out_of_order, 3), {.frames_count = 8, .corrupt = {4}});
  const auto depth = read_depth(sut.sensor);
  EXPECT_EQ(numbers_of(depth), (std::vector<std::uint64_t>{0, 1, 2, 5, 3, 6, 7}));
  EXPECT_EQ(count_of(depth, rt::Status::corrupt), 1U);
}

TEST(Inject, LateFrameHasALaterArrivalAndNothingElse) {
  Faulty sut(fault_of(FaultKind::late, 10, 3), {.has_arrivals = true});
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < depth.size(); ++n)
    EXPECT_EQ(depth[n].header.arrived.ns, arrival_of(n).ns + (n >= 10 && n < 13 ? 40'000'000 : 0));
  expect_untouched(depth);
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::late), 3U);
}

TEST(Inject, LateFrameOfUnknownArrivalKeepsIt) {
  Faulty sut(fault_of(FaultKind::late, 10, 3));
  for (const Answer& answer : read_depth(sut.sensor)) EXPECT_EQ(answer.header.arrived.ns, 0);
}

TEST(Inject, CorruptBytesAreOfTheNamedFramesAndOk) {
  Fault fault = fault_of(FaultKind::corrupt_bytes, 10, 4, 3);
  fault.share = 0.2;
  Faulty sut(fault);
  const auto depth = read_depth(sut.sensor);
  const auto color = read_color(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < 100; ++n) {
    const bool is_hit = n == 10 || n == 13 || n == 16 || n == 19;
    EXPECT_EQ(depth[n].status, rt::Status::ok);
    EXPECT_EQ(depth[n].pixels_hash == true_depth_hash(n), !is_hit) << n;
    EXPECT_EQ(color[n].pixels_hash == true_color_hash(n), !is_hit) << n;
  }
  EXPECT_EQ(sut.sensor.depth->counters().frames_rejected, 0U);
}

TEST(Inject, CorruptBytesAreAtMostTheirShareAndNever65535) {
  Fault fault = fault_of(FaultKind::corrupt_bytes, 0, Fault::kEndless);
  fault.share = 0.25;
  Faulty sut(fault, {.frames_count = 2000});
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  std::size_t changed_count = 0;
  while (sut.sensor.depth->read(pixels, header, {}) == rt::Status::ok) {
    std::size_t changed = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      changed += pixels[i] != pixel_of<std::uint16_t>(header.sequence, i) ? 1U : 0U;
      EXPECT_NE(pixels[i], 65535);
    }
    EXPECT_LE(changed, kPixels / 2) << "16 of 64 bytes";
    changed_count += changed;
  }
  EXPECT_GT(changed_count, 2000 * kPixels / 4);
}

TEST(Inject, HalfFrameIsCorruptAndCounted) {
  Faulty sut(fault_of(FaultKind::half_frame, 10, 2, 20));
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  EXPECT_EQ(depth[10].status, rt::Status::corrupt);
  EXPECT_EQ(depth[30].status, rt::Status::corrupt);
  EXPECT_EQ(numbers_of(depth).size(), 98U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_rejected, 2U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_delivered, 98U);
  EXPECT_EQ(sut.sensor.depth->counters().first_rejection, "Half of depth frame 10 was missing (--faults).");
}

TEST(Inject, HalfFramesAddToWhatTheSourceRejects) {
  Faulty sut(fault_of(FaultKind::half_frame, 10), {.corrupt = {4, 50}});
  EXPECT_EQ(count_of(read_depth(sut.sensor), rt::Status::corrupt), 3U);
  EXPECT_EQ(sut.sensor.depth->counters().frames_rejected, 3U);
  EXPECT_EQ(sut.sensor.depth->counters().first_rejection, "frame 4") << "the first of both";
}

TEST(Inject, StuckClockRepeatsTheTimeBefore) {
  Faulty sut(fault_of(FaultKind::stuck_clock, 25, 5));
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < 100; ++n) {
    EXPECT_EQ(depth[n].header.time, time_of(n >= 25 && n < 30 ? 24 : n));
    EXPECT_EQ(depth[n].header.sequence, n);
  }
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::stuck_clock), 5U);
}

TEST(Inject, ClockJumpMovesAllLaterTimes) {
  Faulty sut(fault_of(FaultKind::clock_jump, 30, 2, 20));
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < 100; ++n) {
    const std::int64_t jumps = (n >= 30 ? 1 : 0) + (n >= 50 ? 1 : 0);
    EXPECT_EQ(depth[n].header.time.ns, time_of(n).ns - jumps * 500'000'000);
  }
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::clock_jump), 2U);
}

TEST(Inject, ClockJumpsThoughItsFrameIsDropped) {
  Faulty sut(FaultPlan{1, {fault_of(FaultKind::clock_jump, 30), fault_of(FaultKind::drop, 30)}});
  EXPECT_EQ(read_depth(sut.sensor)[30].header.time.ns, time_of(31).ns - 500'000'000);
}

TEST(Inject, ColourGoesOnWithoutDepth) {
  Fault fault = fault_of(FaultKind::color_without_depth, 20, 5);
  fault.hits_color = false;
  Faulty sut(fault);
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < 100; ++n)
    EXPECT_EQ(depth[n].status, n >= 20 && n < 25 ? rt::Status::timeout : rt::Status::ok);
  EXPECT_EQ(numbers_of(read_color(sut.sensor)), numbers(0, 100));
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::color_without_depth), 5U);
}

TEST(Inject, UnpluggedDeviceIsLostOncePerFrameAndComesBack) {
  Faulty sut(fault_of(FaultKind::unplug, 28));
  const auto depth = read_depth(sut.sensor);
  ASSERT_EQ(depth.size(), 100U);
  for (std::uint64_t n = 0; n < 100; ++n)
    EXPECT_EQ(depth[n].status, n >= 28 && n < 36 ? rt::Status::device_lost : rt::Status::ok);
  EXPECT_EQ(depth[36].header.sequence, 36U);
  EXPECT_EQ(sut.sensor.depth->counters().losses, 1U);
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::unplug), 1U);
}

TEST(Inject, UnplugByTimeLastsAsLongOnTheSensorsClock) {
  Fault fault = fault_of(FaultKind::unplug, 28);
  fault.away_frames = 0;
  fault.away = {10 * kFrameNs};
  Faulty sut(fault);
  EXPECT_EQ(count_of(read_depth(sut.sensor), rt::Status::device_lost), 10U);
}

TEST(Inject, ColourUnpluggedWithDepthIsBackWithDepth) {
  Faulty sut(fault_of(FaultKind::unplug, 28));
  const auto color = read_color(sut.sensor);
  EXPECT_EQ(count_of(color, rt::Status::device_lost), 1U) << "of a recording, in one answer";
  EXPECT_EQ(color[28].status, rt::Status::device_lost);
  EXPECT_EQ(color[29].header.sequence, 36U);
  EXPECT_EQ(sut.sensor.color->counters().losses, 1U);
}

TEST(Inject, ColourUnpluggedAloneIsAwayFrameByFrame) {
  Fault fault = fault_of(FaultKind::unplug, 28);
  fault.hits_depth = false;
  Faulty sut(fault);
  EXPECT_EQ(count_of(read_color(sut.sensor), rt::Status::device_lost), 8U);
  EXPECT_EQ(numbers_of(read_depth(sut.sensor)), numbers(0, 100));
}

TEST(Inject, LiveColourUnpluggedWithDepthIsAwayFrameByFrame) {
  Sensor sensor = scripted_sensor();
  sensor.is_live = true;
  const auto counts = inject({1, {fault_of(FaultKind::unplug, 28)}}, sensor);
  EXPECT_EQ(count_of(read_color(sensor), rt::Status::device_lost), 8U);
  EXPECT_EQ(counts->of(Stream::color, FaultKind::unplug), 1U);
}

TEST(Inject, SlowConsumerWithoutAClockIsOnlyCounted) {
  Faulty sut(fault_of(FaultKind::slow_consumer, 10, 4, 10));
  EXPECT_EQ(numbers_of(read_depth(sut.sensor)), numbers(0, 100));
  EXPECT_EQ(sut.counts->of(Stream::depth, FaultKind::slow_consumer), 4U);
}

TEST(Inject, ProbabilityHitsItsShareOfFramesAndDependsOnTheSeed) {
  Fault fault = fault_of(FaultKind::drop, 0, Fault::kEndless);
  fault.probability = 0.25;
  Faulty one(FaultPlan{1, {fault}}, {.frames_count = 4000});
  Faulty again(FaultPlan{1, {fault}}, {.frames_count = 4000});
  Faulty other(FaultPlan{2, {fault}}, {.frames_count = 4000});
  const auto depth = numbers_of(read_depth(one.sensor));
  EXPECT_EQ(depth, numbers_of(read_depth(again.sensor)));
  EXPECT_NE(depth, numbers_of(read_depth(other.sensor)));
  EXPECT_NE(depth, numbers_of(read_color(one.sensor))) << "streams are drawn apart";
  EXPECT_NEAR(static_cast<double>(one.counts->of(Stream::depth, FaultKind::drop)), 1000, 110) << "four sigmas";
}

TEST(Inject, HitsDependOnTheNumberNotOnHowManyCameBefore) {
  Fault fault = fault_of(FaultKind::drop, 0, Fault::kEndless);
  fault.probability = 0.3;
  Faulty whole(FaultPlan{9, {fault}});
  Script gappy;
  for (std::uint64_t n = 0; n < 60; ++n) gappy.missing.insert(n);
  Faulty part(FaultPlan{9, {fault}}, gappy);
  auto expected = numbers_of(read_depth(whole.sensor));
  std::erase_if(expected, [](std::uint64_t n) { return n < 60; });
  EXPECT_EQ(numbers_of(read_depth(part.sensor)), expected);
}

TEST(Inject, DepthAloneIsEnough) {
  Sensor sensor = scripted_sensor({}, std::nullopt);
  const auto counts = inject({1, {fault_of(FaultKind::drop, 5)}}, sensor);
  EXPECT_EQ(numbers_of(read_depth(sensor)).size(), 99U);
  EXPECT_EQ(sensor.color, nullptr);
  EXPECT_EQ(counts->of(Stream::color, FaultKind::drop), 0U);
}

/// Keeps the numbers it is shown.
class Witness final : public FrameTap {
 public:
  void take(Stream stream, const RawFrame& frame) noexcept override {
    seen[static_cast<std::size_t>(stream)].push_back(frame.header.sequence);
  }
  std::array<std::vector<std::uint64_t>, 2> seen;
};

FaultPlan everything(std::uint64_t seed) {
  FaultPlan plan;
  plan.seed = seed;
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    Fault fault = fault_of(static_cast<FaultKind>(kind), 0, Fault::kEndless);
    fault.probability = 0.08;
    fault.share = 0.1;
    fault.away_frames = fault.kind == FaultKind::unplug ? 3 : 0;
    fault.hits_color = fault.kind != FaultKind::color_without_depth;
    plan.faults.push_back(fault);
  }
  return plan;
}

TEST(Inject, TapSeesWhatTheSourceGaveOnceAndInOrder) {
  Faulty sut(everything(3));
  Witness witness;
  sut.sensor.depth->set_tap(&witness);
  sut.sensor.color->set_tap(&witness);
  EXPECT_LT(numbers_of(read_depth(sut.sensor)).size(), 100U);
  (void)read_color(sut.sensor);
  EXPECT_EQ(witness.seen[0], numbers(0, 100));
  EXPECT_EQ(witness.seen[1], numbers(0, 100));
}

TEST(InjectProperty, SameAnswersWhoeverAsksAndHow) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Script script{.frames_count = 200, .corrupt = {20, 77}, .missing = {30, 31, 120}, .has_arrivals = true};
    Faulty first(everything(seed), script), second(everything(seed), script);
    const auto depth = read_depth(first.sensor);
    const auto color = read_color(first.sensor);

    // The second's colour goes first, is looked at any number of times and is often passed over.
    std::mt19937_64 random(seed);
    std::vector<Answer> looked;
    std::vector<std::uint8_t> pixels(kPixels * 3);
    for (;;) {
      Answer answer;
      answer.status = second.sensor.color->peek(answer.header, {});
      if (answer.status == rt::Status::end_of_stream) break;
      if (answer.status == rt::Status::ok) {
        FrameHeader again;
        while (random() % 3 == 0) {
          ASSERT_EQ(second.sensor.color->peek(again, {}), rt::Status::ok);
          ASSERT_EQ(again.sequence, answer.header.sequence);
        }
        const std::size_t index = looked.size();
        ASSERT_LT(index, color.size());
        if (random() % 2 == 0) {
          second.sensor.color->skip();
          // Which frames cannot be decoded is found out on the way.
          if (color[index].status == rt::Status::corrupt) answer = color[index];
          answer.pixels_hash = color[index].pixels_hash;
        } else {
          answer.status = second.sensor.color->read(pixels, answer.header, {});
          if (answer.status == rt::Status::ok) answer.pixels_hash = hash_of<std::uint8_t>(pixels);
          if (answer.status == rt::Status::corrupt) answer.header = color[index].header;
        }
      }
      looked.push_back(answer);
    }
    EXPECT_EQ(looked, color);
    EXPECT_EQ(read_depth(second.sensor), depth);
    EXPECT_EQ(first.counts->injected, second.counts->injected);
    for (const auto camera : {&first.sensor, &second.sensor}) {
      EXPECT_EQ(camera->color->counters().frames_delivered, count_of(color, rt::Status::ok));
      EXPECT_EQ(camera->color->counters().frames_rejected, count_of(color, rt::Status::corrupt));
    }
  }
}

TEST(InjectProperty, EveryFrameOfTheSourceIsAccountedFor) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Faulty sut(everything(seed), {.frames_count = 300});
    const auto depth = read_depth(sut.sensor);
    const auto of = [&](FaultKind kind) { return sut.counts->of(Stream::depth, kind); };
    EXPECT_EQ(depth.size() + of(FaultKind::drop), 300 + of(FaultKind::duplicate));
    EXPECT_EQ(count_of(depth, rt::Status::corrupt), of(FaultKind::half_frame));
    EXPECT_EQ(count_of(depth, rt::Status::timeout), of(FaultKind::color_without_depth));
    EXPECT_LE(count_of(depth, rt::Status::device_lost), 3 * of(FaultKind::unplug));
    EXPECT_EQ(sut.sensor.depth->counters().losses, of(FaultKind::unplug));
    EXPECT_EQ(sut.sensor.depth->counters().frames_rejected, of(FaultKind::half_frame));
    EXPECT_EQ(sut.sensor.depth->counters().frames_delivered, count_of(depth, rt::Status::ok));
    EXPECT_EQ(sut.sensor.depth->counters().frames_missing,
              of(FaultKind::drop) + of(FaultKind::color_without_depth) + count_of(depth, rt::Status::device_lost));
    auto got = numbers_of(depth);
    std::sort(got.begin(), got.end());
    const auto twice = got.end() - std::unique(got.begin(), got.end());
    EXPECT_EQ(static_cast<std::uint64_t>(twice), of(FaultKind::duplicate));
  }
}

TEST(Inject, ReadingMakesNoHeapCall) {
  Faulty sut(everything(4));
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<std::uint8_t> rgb(kPixels * 3);
  FrameHeader header;
  const std::uint64_t before = test::heap_calls_count();
  for (int i = 0; i < 300; ++i) {
    (void)sut.sensor.depth->read(depth, header, {});
    if (sut.sensor.color->peek(header, {}) == rt::Status::ok) {
      if (i % 3 == 0)
        sut.sensor.color->skip();
      else
        (void)sut.sensor.color->read(rgb, header, {});
    }
  }
  EXPECT_EQ(test::heap_calls_count(), before);
  EXPECT_GT(sut.counts->of(Stream::depth, FaultKind::half_frame), 0U);
  EXPECT_FALSE(sut.sensor.depth->counters().first_rejection.empty());
}

}  // namespace
}  // namespace tactus::hal::faults
