// Late frames and slow consumers under a clock, which here moves only when somebody waits.
#include <gtest/gtest.h>

#include "hal/faults/faults.hpp"
#include "tests/hal/faults/scripted_sensor.hpp"

namespace tactus::hal::faults {
namespace {

constexpr std::uint64_t kBuffers = 4;

/// A device on the clock: frame n is there at its time, and four of them are kept for whoever is late.
class LiveDepth final : public DepthCamera {
 public:
  explicit LiveDepth(rt::Clock clock) : clock_(clock) {}
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) override {
    const rt::HostTime due{time_of(next_).ns};
    const rt::HostTime deadline = clock_.now() + timeout;
    if (due > deadline) {
      clock_.sleep_until(deadline);
      return rt::Status::timeout;
    }
    clock_.sleep_until(due);
    const auto newest = static_cast<std::uint64_t>(clock_.now().ns / kFrameNs);
    if (newest >= next_ + kBuffers) {
      counters_.frames_missing += newest - kBuffers + 1 - next_;
      next_ = newest - kBuffers + 1;
    }
    for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = pixel_of<std::uint16_t>(next_, i);
    header = {time_of(next_), next_, {time_of(next_).ns}};
    ++next_;
    ++counters_.frames_delivered;
    return rt::Status::ok;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return counters_; }

 private:
  rt::Clock clock_;
  std::uint64_t next_ = 1;
  CameraCounters counters_;
};

class Waiting : public testing::Test {
 protected:
  void open(FaultKind kind, std::int64_t delay_ms, std::uint64_t first) {
    Fault fault;
    fault.kind = kind;
    fault.first = first;
    fault.count = 1;
    fault.delay = {delay_ms * 1'000'000};
    sensor_ = scripted_sensor({}, Script{});
    sensor_.is_live = true;
    sensor_.depth = std::make_unique<LiveDepth>(clock_);
    counts_ = inject({1, {fault}}, sensor_, clock_);
  }
  rt::Status read(std::int64_t timeout_ms = 1000) {
    return sensor_.depth->read(depth_, header_, {timeout_ms * 1'000'000});
  }
  [[nodiscard]] double now_ms() const { return rt::Duration{clock_.now().ns}.milliseconds(); }

  rt::ManualClock manual_;
  rt::Clock clock_ = rt::Clock::manual(manual_);
  Sensor sensor_;
  std::shared_ptr<const FaultCounts> counts_;
  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(kPixels);
  FrameHeader header_;
};

TEST_F(Waiting, LateFrameComesThatMuchLater) {
  open(FaultKind::late, 40, 3);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_EQ(header_.sequence, 3U);
  EXPECT_NEAR(now_ms(), 140, 0.01) << "100 and 40";
  EXPECT_EQ(header_.arrived.ns, time_of(3).ns + 40'000'000);
  EXPECT_EQ(header_.time, time_of(3));
  ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_NEAR(now_ms(), 140, 0.01) << "the next was there meanwhile";
}

TEST_F(Waiting, LateFrameBeyondTheTimeoutComesWithALaterRead) {
  open(FaultKind::late, 90, 3);
  for (int i = 0; i < 2; ++i) ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_EQ(read(50), rt::Status::timeout);
  EXPECT_EQ(read(50), rt::Status::timeout);
  EXPECT_NEAR(now_ms(), 66.67 + 100, 0.1) << "no read waits for longer than it may";
  EXPECT_EQ(read(50), rt::Status::ok);
  EXPECT_EQ(header_.sequence, 3U);
  EXPECT_NEAR(now_ms(), 190, 0.1);
  EXPECT_EQ(hash_of<std::uint16_t>(depth_), true_depth_hash(3));
}

TEST_F(Waiting, SlowConsumerMakesTheDeviceOverflow) {
  open(FaultKind::slow_consumer, 400, 3);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_NEAR(now_ms(), 100, 0.01);
  ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_NEAR(now_ms(), 500, 0.01);
  EXPECT_EQ(header_.sequence, 12U) << "15 is the newest, 12 to 15 were kept";
  EXPECT_EQ(sensor_.depth->counters().frames_missing, 8U);
  EXPECT_EQ(counts_->of(Stream::depth, FaultKind::slow_consumer), 1U);
}

TEST_F(Waiting, SlowConsumerWaitsWithinTheTimeout) {
  open(FaultKind::slow_consumer, 120, 3);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(read(), rt::Status::ok);
  EXPECT_EQ(read(50), rt::Status::timeout);
  EXPECT_EQ(read(50), rt::Status::timeout);
  EXPECT_EQ(read(50), rt::Status::ok);
  EXPECT_NEAR(now_ms(), 220, 0.01);
  EXPECT_EQ(header_.sequence, 4U);
}

TEST_F(Waiting, LateColourIsAnnouncedWhenItIsDue) {
  open(FaultKind::late, 90, 2);
  FrameHeader header;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(sensor_.color->peek(header, {}), rt::Status::ok);
    sensor_.color->skip();
  }
  EXPECT_EQ(sensor_.color->peek(header, {50'000'000}), rt::Status::timeout);
  EXPECT_EQ(sensor_.color->peek(header, {50'000'000}), rt::Status::ok);
  EXPECT_EQ(header.sequence, 2U);
  EXPECT_NEAR(now_ms(), 90, 0.01);
}

}  // namespace
}  // namespace tactus::hal::faults
