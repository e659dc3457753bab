#include "tests/guest/usb_camera/device.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace tactus::guest {
namespace {

using namespace rt::literals;

constexpr int kWidth = 128, kHeight = 96, kFramesCount = 3;  // 24 KiB a frame: two payloads
constexpr std::size_t kFrameBytes = std::size_t{kWidth} * kHeight * 2;

std::shared_ptr<const Clip> clip() {
  auto made = std::make_shared<Clip>(kWidth, kHeight);
  for (int i = 0; i < kFramesCount; ++i)
    made->append(std::vector<std::uint8_t>(kFrameBytes, static_cast<std::uint8_t>(i)),
                 std::vector<std::uint8_t>(kFrameBytes, static_cast<std::uint8_t>(100 + i)));
  return made;
}

CameraSpec camera() {
  return {"a camera", "1", {{hal::PixelFormat::depth16, kWidth, kHeight}, {hal::PixelFormat::yuyv, kWidth, kHeight}}, {333'333}};
}

// Puts the payloads of one stream together, as uvcvideo does.
struct Frames {
  Bytes partial;
  std::vector<Bytes> whole;
  void take(std::span<const std::uint8_t> payload) {
    ASSERT_GE(payload.size(), 12u);
    partial.insert(partial.end(), payload.begin() + 12, payload.end());
    if ((payload[1] & 2) != 0) whole.push_back(std::exchange(partial, {}));
  }
};

// The other end: asks as vhci_hcd does, and keeps what it gets.
class Host {
 public:
  explicit Host(const PlayOptions& options = {}) : device(camera(), clip(), options) {}

  void commit(std::size_t stream) {
    Bytes block(26);
    send(0, false, {0x21, 1, 0, 2, interface_of(stream), 0, 26, 0}, block);
  }
  void stop(std::size_t stream) {
    send(0, false, {2, 1, 0, 0, static_cast<std::uint8_t>(0x80 | endpoint_of(stream)), 0, 0, 0}, {});
  }
  std::uint32_t ask(std::size_t stream) {
    stream_of_request[number] = stream;
    send(endpoint_of(stream), true, {}, {}, kPayloadBytes);
    return number - 1;
  }
  void unlink(std::uint32_t submit_number) {
    Bytes message(48);
    put(message, 0, 2);
    put(message, 4, number++);
    put(message, 20, submit_number);
    feed(message);
  }
  void advance(rt::Duration by) {
    now = now + by;
    (void)device.step(now);
    collect();
  }

  Device device;
  rt::HostTime now{1'000'000'000};
  std::uint32_t number = 1;
  std::map<std::uint32_t, std::size_t> stream_of_request;
  std::map<std::size_t, Frames> frames;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> unlink_answers;  // number, status
  std::mt19937 random{3};

 private:
  static void put(Bytes& bytes, std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  }
  static std::uint32_t get(std::span<const std::uint8_t> bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes[at + i];
    return value;
  }
  void send(std::uint32_t endpoint, bool is_in, std::array<std::uint8_t, 8> setup, const Bytes& data,
            std::uint32_t room = 0) {
    Bytes message(48);
    put(message, 0, 1);
    put(message, 4, number++);
    put(message, 12, is_in ? 1 : 0);
    put(message, 16, endpoint);
    put(message, 24, is_in ? room : static_cast<std::uint32_t>(data.size()));
    std::copy(setup.begin(), setup.end(), message.begin() + 40);
    message.insert(message.end(), data.begin(), data.end());
    feed(message);
  }
  // In pieces of any size, as a socket gives them.
  void feed(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const std::size_t part = std::min<std::size_t>(bytes.size(), 1 + random() % 40);
      ASSERT_TRUE(device.feed(bytes.first(part), now));
      bytes = bytes.subspan(part);
    }
    collect();
  }
  void collect() {
    const Bytes output = device.take_output();
    std::span<const std::uint8_t> rest(output);
    while (!rest.empty()) {
      ASSERT_GE(rest.size(), 48u);
      const std::uint32_t command = get(rest, 0), answered = get(rest, 4), status = get(rest, 20);
      const std::size_t stream_data = stream_of_request.count(answered) != 0 && command == 3 ? get(rest, 24) : 0;
      if (command == 4) unlink_answers.emplace_back(answered, status);
      if (stream_data > 0) frames[stream_of_request[answered]].take(rest.subspan(48, stream_data));
      rest = rest.subspan(48 + stream_data);
    }
  }
};

Bytes filled(int value) { return Bytes(kFrameBytes, static_cast<std::uint8_t>(value)); }

TEST(UsbDevice, BothStreamsShowTheClipAtItsRateAndFromTheStartAgain) {
  Host host;
  for (const std::size_t stream : {std::size_t{0}, std::size_t{1}}) {
    host.commit(stream);
    for (int i = 0; i < 12; ++i) host.ask(stream);
  }
  for (int i = 0; i < 4; ++i) host.advance({33'333'300});
  for (const std::size_t stream : {std::size_t{0}, std::size_t{1}}) {
    const auto& whole = host.frames[stream].whole;
    ASSERT_GE(whole.size(), 4u);
    // Colour came on after the first frame had begun, so that its first is the clip's second.
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_EQ(whole[i], filled(static_cast<int>((i + stream) % kFramesCount + 100 * stream))) << i << " of " << stream;
  }
  const auto shown = host.device.take_shown();
  ASSERT_EQ(shown.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(shown[i].frame, i);
    EXPECT_EQ(shown[i].time.ns, 1'000'000'000 + static_cast<std::int64_t>(i) * 33'333'300);
  }
}

TEST(UsbDevice, ASlowHostMissesNothing) {
  Host host;
  host.commit(0);
  for (int i = 0; i < 9; ++i) {
    host.ask(0);
    host.advance(500_ms);
  }
  ASSERT_EQ(host.frames[0].whole.size(), 4u);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(host.frames[0].whole[static_cast<std::size_t>(i)], filled(i % kFramesCount));
}

TEST(UsbDevice, AfterAStopTheNextStreamBeginsWithFrameZero) {
  Host host;
  host.commit(0);
  for (int i = 0; i < 4; ++i) host.ask(0);
  host.advance(100_ms);
  host.stop(0);
  const std::size_t before = host.frames[0].whole.size();
  for (int i = 0; i < 4; ++i) host.ask(0);
  host.advance(100_ms);
  EXPECT_EQ(host.frames[0].whole.size(), before) << "a stopped stream sends nothing";
  host.commit(0);
  host.advance(1_ms);
  ASSERT_GT(host.frames[0].whole.size(), before);
  EXPECT_EQ(host.frames[0].whole[before], filled(0));
}

TEST(UsbDevice, UnlinkTakesBackWhatWaitsAndSaysSo) {
  Host host;
  const std::uint32_t asked = host.ask(0);
  const std::uint32_t first_unlink = host.number;
  host.unlink(asked);
  host.unlink(asked);
  ASSERT_EQ(host.unlink_answers.size(), 2u);
  EXPECT_EQ(host.unlink_answers[0], std::pair(first_unlink, static_cast<std::uint32_t>(usbip::kUnlinked)));
  EXPECT_EQ(host.unlink_answers[1], std::pair(first_unlink + 1, 0u));
  host.commit(0);
  host.advance(1_s);
  EXPECT_TRUE(host.frames[0].partial.empty()) << "nobody waits for data";
}

TEST(UsbDevice, FaultsHitTheFramesTheyWerePlannedFor) {
  PlayOptions options;
  options.short_at = 1;
  options.unplug_at = 3;
  Host host(options);
  host.commit(0);
  for (int i = 0; i < 12; ++i) host.ask(0);
  for (int i = 0; i < 3; ++i) host.advance(34_ms);
  ASSERT_EQ(host.frames[0].whole.size(), 3u);
  EXPECT_EQ(host.frames[0].whole[0].size(), kFrameBytes);
  EXPECT_EQ(host.frames[0].whole[1].size(), kFrameBytes / 2);
  EXPECT_EQ(host.frames[0].whole[2].size(), kFrameBytes);
  EXPECT_TRUE(host.device.is_unplugged());
  EXPECT_GE(host.frames[0].partial.size(), kFrameBytes / 2);
  EXPECT_LT(host.frames[0].partial.size(), kFrameBytes);
  host.advance(1_s);
  EXPECT_EQ(host.frames[0].whole.size(), 3u);
}

TEST(UsbDevice, WithoutRepeatTheLastFrameIsTheLast) {
  PlayOptions options;
  options.repeats = false;
  Host host(options);
  host.commit(0);
  for (int i = 0; i < 20; ++i) host.ask(0);
  for (int i = 0; i < 10; ++i) host.advance(34_ms);
  EXPECT_EQ(host.frames[0].whole.size(), static_cast<std::size_t>(kFramesCount));
  EXPECT_FALSE(host.device.step(host.now));
}

TEST(UsbDevice, BytesThatAreNoMessageEndTheTalk) {
  Device device(camera(), clip(), {});
  EXPECT_FALSE(device.feed(Bytes(48, 0xff), {}));
}

}  // namespace
}  // namespace tactus::guest
