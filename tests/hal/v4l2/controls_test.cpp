#include "hal/v4l2/controls.hpp"

#include <gtest/gtest.h>

namespace tactus::hal::v4l2 {
namespace {

using Kind = ControlInfo::Kind;

ControlInfo integer(std::uint32_t id, std::string name, std::int64_t min, std::int64_t max, std::int64_t step) {
  ControlInfo control;
  control.id = id;
  control.name = std::move(name);
  control.kind = Kind::integer;
  control.min = min;
  control.max = max;
  control.step = step;
  return control;
}

std::vector<ControlInfo> webcam() {
  std::vector<ControlInfo> controls{integer(1, "brightness", -64, 64, 1), integer(2, "exposure_time_absolute", 3, 2047, 4)};
  ControlInfo automatic;
  automatic.id = 3;
  automatic.name = "auto_exposure";
  automatic.kind = Kind::menu;
  automatic.max = 3;
  automatic.menu = {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}};
  controls.push_back(automatic);
  ControlInfo gain = integer(4, "gain", 0, 100, 1);
  gain.is_inactive = true;
  controls.push_back(gain);
  ControlInfo serial = integer(5, "serial_number", 0, 9, 1);
  serial.is_read_only = true;
  controls.push_back(serial);
  ControlInfo lamp;
  lamp.id = 6;
  lamp.name = "emitter";
  lamp.kind = Kind::boolean;
  controls.push_back(lamp);
  ControlInfo table;
  table.id = 7;
  table.name = "lens_table";
  controls.push_back(table);
  return controls;
}

std::string refusal(std::string_view name, std::string_view text) {
  const auto value = resolve_control(webcam(), name, text, "cam");
  return value ? "was taken" : value.error().message;
}

void expect_value(std::string_view name, std::string_view text, std::uint32_t id, std::int64_t number) {
  const auto value = resolve_control(webcam(), name, text, "cam");
  ASSERT_TRUE(value) << value.error().message;
  EXPECT_EQ(value->id, id);
  EXPECT_EQ(value->value, number);
}

TEST(V4l2Controls, NamesAreThoseOfV4l2Ctl) {
  EXPECT_EQ(control_name("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(control_name("White Balance, Auto & Preset"), "white_balance_auto_preset");
  EXPECT_EQ(control_name("Inject V4L2_BUF_FLAG_ERROR"), "inject_v4l2_buf_flag_error");
  EXPECT_EQ(control_name("  Gain (dB) "), "gain_db");
  EXPECT_EQ(control_name("u8 2x3x4x5 Array"), "u8_2x3x4x5_array");
  EXPECT_EQ(control_name(""), "");
}

TEST(V4l2Controls, NumbersWithinTheirRangeAreTaken) {
  expect_value("brightness", "-64", 1, -64);
  expect_value("Exposure Time, Absolute", "0xB", 2, 11);
  expect_value("emitter", "on", 6, 1);
  expect_value("emitter", "0", 6, 0);
}

TEST(V4l2Controls, MenuItemsAreTakenByNumberAndByName) {
  expect_value("auto_exposure", "1", 3, 1);
  expect_value("auto_exposure", "aperture_priority_mode", 3, 3);
  expect_value("auto_exposure", "Manual Mode", 3, 1);
}

TEST(V4l2Controls, RefusalsSayWhatIsTaken) {
  EXPECT_EQ(refusal("brightness", "65"), "cam has brightness asked for as 65; it takes -64 to 64");
  EXPECT_EQ(refusal("exposure_time_absolute", "5"),
            "cam has exposure_time_absolute asked for as 5; it takes 3 to 2047 in steps of 4");
  EXPECT_EQ(refusal("brightness", "bright"), "cam has brightness asked for as bright; it takes a number from -64 to 64");
  EXPECT_EQ(refusal("brightness", "--3"), "cam has brightness asked for as --3; it takes a number from -64 to 64");
  EXPECT_EQ(refusal("auto_exposure", "2"),
            "cam has auto_exposure asked for as 2; it takes 1 (Manual Mode), 3 (Aperture Priority Mode)");
  EXPECT_EQ(refusal("emitter", "2"), "cam has emitter asked for as 2; it takes 0 or 1");
  EXPECT_EQ(refusal("gain", "5"),
            "cam sets gain by itself at present; switch its automatic off by a control before it");
  EXPECT_EQ(refusal("serial_number", "5"), "cam lets its control serial_number be read only; leave it out");
  EXPECT_EQ(refusal("lens_table", "5"),
            "cam has no control lens_table; it has brightness, exposure_time_absolute, auto_exposure, gain, emitter");
  EXPECT_EQ(resolve_control({}, "gain", "5", "cam").error().message, "cam has no control gain; it has none");
}

TEST(V4l2Controls, WidestRangesDoNotOverflow) {
  const ControlInfo wide = integer(9, "wide", INT64_MIN, INT64_MAX, 1);
  ControlInfo stepped = wide;
  stepped.name = "stepped";
  stepped.step = 2;
  const std::vector<ControlInfo> controls{wide, stepped};
  EXPECT_TRUE(resolve_control(controls, "wide", "9223372036854775807", "cam"));
  EXPECT_FALSE(resolve_control(controls, "wide", "9223372036854775808", "cam"));
  EXPECT_FALSE(resolve_control(controls, "stepped", "9223372036854775807", "cam"));
  EXPECT_TRUE(resolve_control(controls, "stepped", "9223372036854775806", "cam"));
}

}  // namespace
}  // namespace tactus::hal::v4l2
