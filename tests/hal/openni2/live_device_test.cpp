#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <thread>

#include "hal/openni2/openni2.hpp"
#include "hal/record/tac_writer.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"
#include "tests/conformance/live_rules.hpp"
#include "tests/hal/openni2/driver_environment.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::openni2 {
namespace {

constexpr rt::Duration kPatience{5'000'000'000}, kShort{100'000'000};

template <typename Pixel>
struct Taken {
  FrameHeader header;
  std::vector<Pixel> pixels;
};
using TakenDepth = Taken<std::uint16_t>;
using TakenColor = Taken<std::uint8_t>;

/// Both streams of an opened device, read in turn.
class Reader {
 public:
  explicit Reader(Sensor& sensor)
      : sensor_(sensor),
        raw(static_cast<std::size_t>(sensor.calibration.depth.width) *
            static_cast<std::size_t>(sensor.calibration.depth.height)),
        rgb(static_cast<std::size_t>(sensor.calibration.color.width) *
            static_cast<std::size_t>(sensor.calibration.color.height) * 3) {}
  rt::Status depth(rt::Duration timeout) { return sensor_.depth->read(raw, depth_header, timeout); }
  rt::Status color(rt::Duration timeout) { return sensor_.color->read(rgb, color_header, timeout); }

 private:
  Sensor& sensor_;

 public:
  std::vector<std::uint16_t> raw;
  std::vector<std::uint8_t> rgb;
  FrameHeader depth_header, color_header;
};

Sensor opened(const OpenNi2Request& request = {}) {
  auto sensor = open_openni2(request);
  if (!sensor) {
    ADD_FAILURE() << sensor.error().message;
    std::abort();
  }
  return std::move(*sensor);
}

/// The source's own frames, in the driver's millimetres and by OpenNI's numbers, which begin at 1.
struct Reference {
  std::map<std::uint64_t, TakenDepth> depth;
  std::map<std::uint64_t, TakenColor> color;
};
const Reference& reference() {
  static const Reference made = [] {
    auto sensor = open_synthetic(*parse_synthetic_name(kSource));
    Reader reader(*sensor);
    Reference out;
    while (reader.depth({}) == rt::Status::ok) {
      for (auto& value : reader.raw) {
        const double mm = std::round(value * sensor->calibration.depth_m_per_unit * 1000);
        value = static_cast<std::uint16_t>(mm > 10000 ? 0 : mm);
      }
      out.depth[reader.depth_header.sequence + 1] = {reader.depth_header, reader.raw};
    }
    while (reader.color({}) == rt::Status::ok) out.color[reader.color_header.sequence + 1] = {reader.color_header, reader.rgb};
    return out;
  }();
  return made;
}

std::int64_t whole_us(rt::SensorTime time) { return time.ns / 1000 * 1000; }

TEST(OpenNi2Device, Frames_AreTheSourcesOwn) {
  set_driver(kSource, "1", false);
  const std::uint64_t last_number = reference().depth.rbegin()->first;
  Sensor sut = opened();
  EXPECT_TRUE(sut.is_live);
  EXPECT_GT(sut.buffers_bytes, 0U);
  Reader reader(sut);
  std::uint64_t depth_count = 0, color_count = 0, first = 0, last = 0;
  while (last < last_number) {
    ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
    const std::uint64_t number = reader.depth_header.sequence;
    ASSERT_TRUE(reference().depth.contains(number)) << number;
    const TakenDepth& own = reference().depth.at(number);
    EXPECT_TRUE(reader.raw == own.pixels) << "frame " << number;
    EXPECT_EQ(reader.depth_header.time.ns, whole_us(own.header.time));
    EXPECT_LE(reader.depth_header.arrived, rt::Clock::monotonic().now());
    EXPECT_GT(reader.depth_header.arrived.ns, 0);
    if (depth_count++ == 0) first = number;
    last = number;
    if (reader.color(kShort) != rt::Status::ok) continue;
    ++color_count;
    EXPECT_TRUE(reader.rgb == reference().color.at(reader.color_header.sequence).pixels);
  }
  EXPECT_GT(depth_count, 0U);
  EXPECT_GT(color_count, 0U);
  const CameraCounters& counters = sut.depth->counters();
  EXPECT_EQ(counters.frames_delivered, depth_count);
  EXPECT_EQ(counters.frames_missing, last - first + 1 - depth_count);
  EXPECT_EQ(counters.frames_rejected + counters.timestamps_rejected + counters.losses, 0U);
  EXPECT_EQ(reader.depth(kShort), rt::Status::timeout) << "a device that is silent";
}

TEST(OpenNi2Device, DepthAndColour_KeepTheRulesOfEveryCamera) {
  set_driver(kSource, "1", true);
  Sensor sut = opened();
  const RigCalibration& rig = sut.calibration;
  conformance::expect_live_rules(*sut.depth, rig.depth.width, rig.depth.height, 20);
  conformance::expect_live_rules(*sut.color, rig.color.width, rig.color.height, 20);
}

TEST(OpenNi2Device, Calibration_IsTheSourcesFieldOfViewAndSaysSo) {
  set_driver(kSource, "1", true);
  const Sensor sut = opened();
  const Intrinsics own = open_synthetic(*parse_synthetic_name(kSource))->calibration.depth;
  const Intrinsics& k = sut.calibration.depth;
  EXPECT_EQ(k.width, own.width);
  EXPECT_NEAR(k.fx, own.fx, 1e-3);
  EXPECT_NEAR(k.fy, own.fy, 1e-3);
  EXPECT_EQ(sut.calibration.depth_m_per_unit, 0.001);
  EXPECT_TRUE(sut.calibration.registered);
  EXPECT_EQ(sut.calibration.color, k);
  EXPECT_NE(sut.description.find("tactus://0"), std::string::npos) << sut.description;
  EXPECT_NE(sut.description.find("exposed together"), std::string::npos) << sut.description;
  ASSERT_FALSE(sut.notes.empty());
  EXPECT_NE(sut.notes.front().find("assumed from the field of view"), std::string::npos);
}

TEST(OpenNi2Device, NotRegisteredSource_HasTwoCameras) {
  set_driver("synthetic:corner?frames=3&mode=320x240&registered=0", "1", true);
  const Sensor sut = opened();
  EXPECT_TRUE(sut.calibration.has_color);
  EXPECT_FALSE(sut.calibration.registered);
  EXPECT_EQ(sut.notes.size(), 2U) << "the distance between the cameras is assumed";
}

TEST(OpenNi2Device, WithoutColour_GivesDepthAlone) {
  set_driver(kSource, "1", true);
  Sensor sut = opened({.wants_color = false});
  EXPECT_FALSE(sut.color);
  EXPECT_FALSE(sut.calibration.has_color);
  Reader reader(sut);
  EXPECT_EQ(reader.depth(kPatience), rt::Status::ok);
}

TEST(OpenNi2Device, SyncedPair_HasOneNumber) {
  // Colour 3 ms after depth would pair by time too; here both have the same times and must keep the same numbers.
  set_driver(kSource, "1", true);
  Sensor sut = opened();
  Reader reader(sut);
  std::map<std::int64_t, std::uint64_t> number_at;
  for (int i = 0; i < 6; ++i) {
    if (reader.depth(kPatience) == rt::Status::ok) number_at[reader.depth_header.time.ns] = reader.depth_header.sequence;
    if (reader.color(kPatience) != rt::Status::ok) continue;
    const auto depth = number_at.find(reader.color_header.time.ns);
    if (depth != number_at.end()) {
      EXPECT_EQ(depth->second, reader.color_header.sequence);
    }
  }
  EXPECT_GT(sut.color->counters().frames_delivered, 0U);
}

TEST(OpenNi2Device, LateReader_GetsTheNewestAndCountsTheRest) {
  set_driver(kSource, "4", true);
  Sensor sut = opened();
  Reader reader(sut);
  ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
  std::uint64_t gaps = 0, last = reader.depth_header.sequence;
  // Longer each time: under a sanitizer the source takes long over a frame.
  for (int pause_ms = 200; pause_ms < 7000 && gaps == 0; pause_ms *= 2) {
    std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
    for (int k = 0; k < 6; ++k) {
      ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
      ASSERT_GT(reader.depth_header.sequence, last);
      gaps += reader.depth_header.sequence - last - 1;
      last = reader.depth_header.sequence;
    }
  }
  EXPECT_GT(gaps, 0U);
  EXPECT_EQ(sut.depth->counters().frames_missing, gaps);
}

TEST(OpenNi2Device, PeekedColour_StaysAndSkippedIsShownToTheTap) {
  class Witness final : public FrameTap {
   public:
    void take(Stream stream, const RawFrame& frame) noexcept override {
      last_sequence = frame.header.sequence;
      count += stream == Stream::color && frame.bytes.size() == frame.row_bytes * static_cast<std::size_t>(frame.height);
    }
    int count = 0;
    std::uint64_t last_sequence = 0;
  };
  set_driver(kSource, "1", true);
  Sensor sut = opened();
  Witness witness;
  sut.color->set_tap(&witness);
  Reader reader(sut);
  FrameHeader announced, again;
  ASSERT_EQ(sut.color->peek(announced, kPatience), rt::Status::ok);
  EXPECT_EQ(witness.count, 0);
  ASSERT_EQ(sut.color->peek(again, kPatience), rt::Status::ok);
  EXPECT_EQ(announced.sequence, again.sequence);
  ASSERT_EQ(reader.color(kPatience), rt::Status::ok);
  EXPECT_EQ(reader.color_header.sequence, announced.sequence);
  EXPECT_EQ(witness.count, 1);
  ASSERT_EQ(sut.color->peek(announced, kPatience), rt::Status::ok);
  sut.color->skip();
  EXPECT_EQ(witness.count, 2);
  EXPECT_EQ(witness.last_sequence, announced.sequence);
  EXPECT_EQ(sut.color->counters().frames_delivered, 2U);
}

/// Reads until the status comes, or fails.
rt::Status read_until(Reader& reader, rt::Status wanted) {
  const rt::HostTime end = rt::Clock::monotonic().now() + rt::Duration{20'000'000'000};
  rt::Status status = rt::Status::timeout;
  while (status != wanted && rt::Clock::monotonic().now() < end) status = reader.depth(kShort);
  return status;
}

TEST(OpenNi2Device, UnpluggedAndPluggedInAgain_GoesOnAndCountsOneLoss) {
  set_driver(kSource, "1", true);
  Sensor sut = opened();
  Reader reader(sut);
  ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
  ASSERT_EQ(reader.color(kPatience), rt::Status::ok);
  for (std::uint64_t loss = 1; loss <= 2; ++loss) {
    const FrameHeader before = reader.depth_header, color_before = reader.color_header;
    std::ofstream(unplug_file()).put('x');
    ASSERT_EQ(read_until(reader, rt::Status::device_lost), rt::Status::device_lost);
    EXPECT_EQ(sut.depth->counters().losses, loss);
    EXPECT_EQ(reader.depth(kShort), rt::Status::device_lost);
    EXPECT_EQ(reader.color(kShort), rt::Status::device_lost);
    EXPECT_EQ(sut.color->counters().losses, loss);
    EXPECT_EQ(sut.depth->counters().losses, loss) << "one loss, however often it is told";
    std::filesystem::remove(unplug_file());
    ASSERT_EQ(read_until(reader, rt::Status::ok), rt::Status::ok);
    EXPECT_GT(reader.depth_header.time, before.time);
    EXPECT_GT(reader.depth_header.sequence, before.sequence);
    ASSERT_EQ(reader.color(kPatience), rt::Status::ok);
    EXPECT_GT(reader.color_header.time, color_before.time);
    EXPECT_GT(reader.color_header.sequence, color_before.sequence);
  }
  EXPECT_EQ(sut.depth->counters().timestamps_rejected, 0U);
  EXPECT_EQ(sut.color->counters().timestamps_rejected, 0U);
}

TEST(OpenNi2Device, ReadAfterBoot_TouchesNoHeap) {
  set_driver(kSource, "2", true);
  Sensor sut = opened();
  Reader reader(sut);
  ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
  ASSERT_EQ(reader.color(kPatience), rt::Status::ok);
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "this build does not count heap calls";
  rt::heap_guard::seal();
  const std::uint64_t guest_before = rt::heap_guard::was_guest_calls(), total_before = rt::heap_guard::was_total_calls();
  std::uint64_t count = 0;
  {
    const rt::RtScope step;
    for (int i = 0; i < 40; ++i) {
      count += reader.depth(kPatience) == rt::Status::ok ? 1U : 0U;
      count += reader.color(kPatience) == rt::Status::ok ? 1U : 0U;
    }
  }
  rt::heap_guard::unseal();
  EXPECT_EQ(rt::heap_guard::thread_calls(), 0U);
  EXPECT_EQ(rt::heap_guard::was_total_calls(), total_before);
  EXPECT_EQ(count, 80U);
  std::cout << "the library's own thread: " << (rt::heap_guard::was_guest_calls() - guest_before) << " heap calls in " << count
            << " frames\n";
}

TEST(OpenNi2Device, OpenedTenTimes_WorksTenTimes) {
  set_driver(kSource, "4", true);
  for (int i = 0; i < 10; ++i) {
    Sensor sut = opened();
    Reader reader(sut);
    ASSERT_EQ(reader.depth(kPatience), rt::Status::ok) << i;
    ASSERT_EQ(reader.color(kPatience), rt::Status::ok) << i;
  }
}

TEST(OpenNi2Device, ThreadsThatComeAndGo_DoNotUpsetTheLibrary) {
  set_driver(kSource, "4", true);
  for (int i = 0; i < 6; ++i)
    std::thread([] {
      Sensor sut = opened();
      Reader reader(sut);
      EXPECT_EQ(reader.depth(kPatience), rt::Status::ok);
      EXPECT_FALSE(open_openni2({.uri = "nothing://here"}));
    }).join();
}

TEST(OpenNi2Device, UnknownUri_IsOneSentence) {
  set_driver(kSource, "1", true);
  const auto refused = open_openni2({.uri = "nothing://here"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_EQ(refused.error().message.find("openni2:nothing://here: "), 0U) << refused.error().message;
}

TEST(OpenNi2Device, ModeItDoesNotHave_IsRefusedWithThoseItHas) {
  set_driver(kSource, "1", true);
  const auto refused = open_openni2({.mode = {1920, 1080, 0}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  EXPECT_NE(refused.error().message.find("depth 1 mm 320x240 30 Hz"), std::string::npos) << refused.error().message;
}

TEST(OpenNi2Device, AnySourceByItsUri_Opens) {
  set_driver(kSource, "1", true);
  Sensor sut = opened({.uri = "tactus://synthetic:wall?frames=3&mode=320x240"});
  Reader reader(sut);
  EXPECT_EQ(reader.depth(kPatience), rt::Status::ok);
  const auto refused = open_openni2({.uri = "tactus://synthetic:nowhere"});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("nowhere"), std::string::npos) << refused.error().message;
}

TEST(OpenNi2Device, RecordingInOneFile_IsServedFrameByFrame) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "room.tac";
  auto source = open_synthetic(*parse_synthetic_name("synthetic:wall?frames=5&mode=320x240&noise=0&trajectory=still"));
  auto writer = record::TacWriter::create(file, *source, {}, {.waits_when_full = true});
  ASSERT_TRUE(writer) << writer.error().message;
  source->depth->set_tap(writer->get());
  source->color->set_tap(writer->get());
  Reader recorded(*source);
  std::vector<std::uint16_t> first_mm;
  while (recorded.depth({}) == rt::Status::ok) {
    (void)recorded.color({});
    if (!first_mm.empty()) continue;
    for (const std::uint16_t units : recorded.raw)
      first_mm.push_back(static_cast<std::uint16_t>(std::lround(units * source->calibration.depth_m_per_unit * 1000)));
  }
  ASSERT_TRUE((*writer)->close());

  set_driver(kSource, "1", true);
  Sensor sut = opened({.uri = "tactus://" + file.string()});
  Reader reader(sut);
  ASSERT_EQ(reader.depth(kPatience), rt::Status::ok);
  const auto differs = [](std::uint16_t a, std::uint16_t b) { return a + 1 < b || b + 1 < a; };
  EXPECT_TRUE(std::equal(reader.raw.begin(), reader.raw.end(), first_mm.begin(), first_mm.end(),
                         [&](std::uint16_t a, std::uint16_t b) { return !differs(a, b); }))
      << "a wall before a camera that stands still, to the millimetre";
}

TEST(OpenNi2Devices, AreListedWithTheirModes) {
  set_driver(kSource, "1", true);
  const DeviceList list = list_devices();
  EXPECT_EQ(list.backend, "OpenNI2");
  const auto entry = std::find_if(list.devices.begin(), list.devices.end(),
                                  [](const DeviceEntry& e) { return e.source == "openni2:tactus://0"; });
  ASSERT_NE(entry, list.devices.end()) << list.why_none;
  EXPECT_TRUE(entry->trouble.empty()) << entry->trouble;
  EXPECT_EQ(entry->formats, (std::vector<std::string>{"depth 1 mm 320x240 30 Hz", "colour RGB 320x240 30 Hz"}));
}

}  // namespace
}  // namespace tactus::hal::openni2
