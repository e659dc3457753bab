// `tactus devices`.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "firmware_host/devices.hpp"
#include "tests/support/command_line.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;

std::vector<hal::DeviceList> lists() {
  return {{"V4L2",
           {{"v4l2:/dev/video2", "Depth camera", {"depth Z16 640x480 30 Hz", "depth Z16 320x240 60 Hz"}, ""},
            {"v4l2:/dev/video0", "Webcam", {}, "/dev/video0: this user may not open it"}},
           ""},
          {"OpenNI2", {}, "this program was built without it"}};
}

TEST(Devices, TextNamesEverySourceFormatAndTrouble) {
  EXPECT_EQ(devices_text(lists()),
            "V4L2\n"
            "  v4l2:/dev/video2  Depth camera\n"
            "    depth Z16 640x480 30 Hz\n"
            "    depth Z16 320x240 60 Hz\n"
            "  v4l2:/dev/video0  Webcam\n"
            "    cannot be used: /dev/video0: this user may not open it\n"
            "OpenNI2\n"
            "  none: this program was built without it\n");
}

TEST(Devices, JsonHoldsTheSame) {
  const json j = json::parse(devices_json(lists()));
  ASSERT_EQ(j.size(), 2u);
  EXPECT_EQ(j[0]["devices"][0]["source"], "v4l2:/dev/video2");
  EXPECT_EQ(j[0]["devices"][0]["formats"].size(), 2u);
  EXPECT_EQ(j[0]["devices"][1]["trouble"], "/dev/video0: this user may not open it");
  EXPECT_EQ(j[1]["why_none"], "this program was built without it");
  EXPECT_TRUE(j[1]["devices"].empty());
}

TEST(Devices, EveryBackendAnswersOnThisMachine) {
  PipelineCommands commands;
  commands.devices = devices;
  const test::Outcome o = test::call_tactus({"devices", "--json"}, commands);
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  std::vector<std::string> backends;
  for (const json& list : j) {
    backends.push_back(list["backend"]);
    EXPECT_NE(list["devices"].empty(), list["why_none"].get<std::string>().empty()) << list;
  }
  EXPECT_EQ(backends.size(), 4u);
  const test::Outcome text = test::call_tactus({"devices"}, commands);
  for (const std::string& backend : backends) EXPECT_NE(text.out.find(backend + "\n"), std::string::npos) << text.out;
}

}  // namespace
}  // namespace tactus::firmware
