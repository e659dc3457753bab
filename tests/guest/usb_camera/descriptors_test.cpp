#include "tests/guest/usb_camera/descriptors.hpp"

#include <gtest/gtest.h>

#include <map>

namespace tactus::guest {
namespace {

CameraSpec spec(std::size_t streams_count) {
  CameraSpec camera{"a camera", "42", {{hal::PixelFormat::depth16, 320, 240}}, {2'000'000, 333'333, 5'000'000}};
  if (streams_count == 2) camera.streams.push_back({hal::PixelFormat::yuyv, 640, 480});
  return camera;
}

unsigned u16(const Bytes& bytes, std::size_t at) { return bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8; }
unsigned u32(const Bytes& bytes, std::size_t at) { return u16(bytes, at) | u16(bytes, at + 2) << 16; }

std::vector<Bytes> split(const Bytes& bytes) {
  std::vector<Bytes> parts;
  for (std::size_t at = 0; at < bytes.size(); at += bytes[at]) {
    EXPECT_GE(bytes[at], 2) << "at " << at;
    EXPECT_LE(at + bytes[at], bytes.size()) << "at " << at;
    if (bytes[at] < 2 || at + bytes[at] > bytes.size()) break;
    parts.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                       bytes.begin() + static_cast<std::ptrdiff_t>(at + bytes[at]));
  }
  return parts;
}

class Descriptors : public testing::TestWithParam<std::size_t> {};

TEST_P(Descriptors, LengthsOfThePartsAddUpToThoseOfTheWholes) {
  const Bytes whole = configuration_descriptor(spec(GetParam()));
  EXPECT_EQ(u16(whole, 2), whole.size());
  const auto parts = split(whole);
  // A class header's total spans the class descriptors that follow it without a break.
  std::size_t headers_count = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i][1] != 0x24 || parts[i - 1][1] == 0x24) continue;
    std::size_t total = 0;
    for (std::size_t j = i; j < parts.size() && parts[j][1] == 0x24; ++j) total += parts[j].size();
    const bool is_control = parts[i - 1][6] == 1;
    EXPECT_EQ(u16(parts[i], is_control ? 5 : 4), total);
    ++headers_count;
  }
  EXPECT_EQ(headers_count, GetParam() + 1);
}

TEST_P(Descriptors, InterfacesAndEndpointsAreThoseThatTheHeadersName) {
  const auto parts = split(configuration_descriptor(spec(GetParam())));
  EXPECT_EQ(parts[0][4], GetParam() + 1) << "interfaces of the configuration";
  EXPECT_EQ(parts[1][3], GetParam() + 1) << "interfaces of the video function";
  std::vector<unsigned> interfaces, endpoints, named_interfaces, named_endpoints;
  std::map<unsigned, unsigned> source_of, kind_of_terminal;
  std::vector<unsigned> linked_outputs;
  unsigned subclass = 0;
  for (const Bytes& part : parts) {
    if (part[1] == 4) {
      interfaces.push_back(part[2]);
      subclass = part[6];
    } else if (part[1] == 5) {
      endpoints.push_back(part[2]);
      EXPECT_EQ(part[3], 2) << "bulk";
      EXPECT_EQ(u16(part, 4), 512u) << "high speed";
    } else if (part[1] == 0x24 && subclass == 1 && part[2] == 1) {
      for (unsigned i = 0; i < part[11]; ++i) named_interfaces.push_back(part[12 + i]);
    } else if (part[1] == 0x24 && subclass == 1 && part[2] == 3) {
      source_of[part[3]] = part[7];
    } else if (part[1] == 0x24 && subclass == 1 && part[2] == 5) {
      source_of[part[3]] = part[4];
    } else if (part[1] == 0x24 && subclass == 1 && part[2] == 2) {
      kind_of_terminal[part[3]] = u16(part, 4);
    } else if (part[1] == 0x24 && subclass == 2 && part[2] == 1) {
      named_endpoints.push_back(part[6]);
      linked_outputs.push_back(part[8]);
    }
  }
  ASSERT_EQ(interfaces.size(), GetParam() + 1);
  EXPECT_EQ(interfaces[0], 0u);
  EXPECT_EQ(std::vector<unsigned>(interfaces.begin() + 1, interfaces.end()), named_interfaces);
  EXPECT_EQ(endpoints, named_endpoints);
  for (const unsigned output : linked_outputs) {
    unsigned entity = output;
    while (source_of.count(entity) != 0) entity = source_of[entity];
    EXPECT_NE(entity, output);
    EXPECT_EQ(kind_of_terminal[entity], 0x0201u) << "a camera";
  }
}

TEST_P(Descriptors, FramesHaveTheSizeFormatAndRatesOfTheirStream) {
  const CameraSpec camera = spec(GetParam());
  std::size_t stream = 0;
  unsigned subclass = 0;
  for (const Bytes& part : split(configuration_descriptor(camera))) {
    if (part[1] == 4) subclass = part[6];
    if (part[1] != 0x24 || subclass != 2) continue;
    if (part[2] == 4) {
      const std::string fourcc(part.begin() + 5, part.begin() + 9);
      EXPECT_EQ(fourcc, stream == 0 ? "Z16 " : "YUY2");
      EXPECT_EQ(part[21], 16) << "bits a pixel";
    } else if (part[2] == 5) {
      EXPECT_EQ(u16(part, 5), static_cast<unsigned>(camera.streams[stream].width));
      EXPECT_EQ(u16(part, 7), static_cast<unsigned>(camera.streams[stream].height));
      EXPECT_EQ(u32(part, 17), camera.streams[stream].frame_bytes());
      EXPECT_EQ(u32(part, 21), 2'000'000u) << "the default interval is the first";
      ASSERT_EQ(part[25], 3);
      ASSERT_EQ(part.size(), 26u + 4 * 3);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(u32(part, 26 + 4 * i), camera.frame_intervals[i]);
      ++stream;
    }
  }
  EXPECT_EQ(stream, GetParam());
}

INSTANTIATE_TEST_SUITE_P(OneStreamAndTwo, Descriptors, testing::Values(1, 2));

TEST(DeviceDescriptor, IsThatOfAVideoDeviceWithOneConfiguration) {
  const Bytes device = device_descriptor();
  ASSERT_EQ(device.size(), 18u);
  EXPECT_EQ(device[0], 18);
  EXPECT_EQ(device[1], 1);
  EXPECT_EQ(u16(device, 2), 0x0200u);
  EXPECT_EQ(device[17], 1);
}

TEST(StringDescriptor, HoldsTheNameInUtf16) {
  EXPECT_EQ(string_descriptor(spec(1), 3), (Bytes{6, 3, '4', 0, '2', 0}));
  EXPECT_EQ(string_descriptor(spec(1), 0), (Bytes{4, 3, 9, 4}));
  EXPECT_TRUE(string_descriptor(spec(1), 4).empty());
}

}  // namespace
}  // namespace tactus::guest
