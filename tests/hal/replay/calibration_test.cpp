#include <gtest/gtest.h>

#include <random>

#include "hal/replay/intrinsics_file.hpp"

namespace tactus::hal::replay {
namespace {

std::string error_of(const rt::Result<RigCalibration>& result) {
  if (result) return "accepted";
  EXPECT_EQ(result.error().code, rt::ExitCode::bad_input);
  return result.error().message;
}

TEST(IntrinsicsFile, TumLineIsARegisteredRig) {
  auto sut = parse_intrinsics("# fx fy ...\n517.3 516.5 318.6 255.3 640 480 5000\n", "intrinsics.txt");
  ASSERT_TRUE(sut.has_value());
  EXPECT_TRUE(sut->registered);
  EXPECT_EQ(sut->depth, sut->color);
  EXPECT_EQ(sut->depth.fx, 517.3);
  EXPECT_EQ(sut->depth.height, 480);
  EXPECT_EQ(sut->depth_m_per_unit, 1.0 / 5000);
}

TEST(IntrinsicsFile, ImpossibleValuesNameTheLine) {
  const auto message = [](const char* text) { return error_of(parse_intrinsics(text, "intrinsics.txt")); };
  EXPECT_EQ(message("\n517 516 318 255 640 480\n"),
            "intrinsics.txt:2: \"517 516 318 255 640 480\" must be \"fx fy cx cy width height depth_scale\" "
            "(units per metre)");
  EXPECT_EQ(message(""),
            "intrinsics.txt: has no values; one line must be \"fx fy cx cy width height depth_scale\" (units "
            "per metre)");
  EXPECT_EQ(message("517 516 318 255 640 480 0"),
            "intrinsics.txt:1: the depth scale must be 1 to 1000000 units per metre");
  EXPECT_EQ(message("-517 516 318 255 640 480 5000"),
            "intrinsics.txt:1: focal lengths must be 1 to 100000 pixels");
  EXPECT_EQ(message("517 516 318 255 0 480 5000"),
            "intrinsics.txt:1: width and height must be 1 to 8192 pixels and 16 Mpixel together");
  EXPECT_EQ(message("517 516 318 255 8192 8192 5000"),
            "intrinsics.txt:1: width and height must be 1 to 8192 pixels and 16 Mpixel together");
  EXPECT_EQ(message("517 516 99999 255 640 480 5000"),
            "intrinsics.txt:1: the centre cx cy is far outside of the image");
  EXPECT_EQ(message("517 516 318 255 640 480 5000\n1 1 1 1 1 1 1\n"),
            "intrinsics.txt:2: a second line of values; there must be one");
  EXPECT_NE(message("nan 516 318 255 640 480 5000"), "accepted");
  EXPECT_NE(message("517 516 318 255 99999999999 480 5000"), "accepted");
  EXPECT_NE(message("517 516 318 255 640.5 480 5000"), "accepted");
}

TEST(CameraMatrix, ReadsPinholeAndRefusesOthers) {
  auto sut = parse_camera_matrix("5.85e+02 0 3.2e+02\n0 585 240\n0 0 1\n", "camera-intrinsics.txt");
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->cx, 320);
  EXPECT_EQ(sut->width, 0);
  EXPECT_FALSE(parse_camera_matrix("585 1 320 0 585 240 0 0 1", "f").has_value());
  EXPECT_FALSE(parse_camera_matrix("585 0 320 0 585 240 0 0", "f").has_value());
  EXPECT_FALSE(parse_camera_matrix("585 0 320 0 585 240 0 0 1 1", "f").has_value());
  EXPECT_FALSE(parse_camera_matrix("inf 0 320 0 585 240 0 0 1", "f").has_value());
}

TEST(CalibrationText, ColourOffsetMovesAPointTheWayTheFormulaSays) {
  auto sut = parse_calibration_text(
      "# two cameras\ndepth 585 585 320 240 640 480\ncolor 526.2 526.2 322.6 236.6 640 480 tx -0.03107 ty "
      "0.00514\n",
      "c");
  ASSERT_TRUE(sut.has_value());
  EXPECT_FALSE(sut->registered);
  ASSERT_TRUE(sut->has_color);
  // u = f (X + tx) / Z + cx
  const Vec3d p = sut->T_color_depth * Vec3d{0.4, -0.2, 2};
  EXPECT_NEAR(sut->color.fx * p.x / p.z + sut->color.cx, 526.2 * (0.4 - 0.03107) / 2 + 322.6, 1e-9);
  EXPECT_NEAR(sut->color.fy * p.y / p.z + sut->color.cy, 526.2 * (-0.2 + 0.00514) / 2 + 236.6, 1e-9);
}

TEST(CalibrationText, FaultsNameTheLine) {
  const auto message = [](const char* text) {
    return error_of(parse_calibration_text(text, "calibration.txt"));
  };
  EXPECT_EQ(message("color 1 1 1 1 2 2\n"),
            "calibration.txt: has no line \"depth fx fy cx cy width height\"");
  EXPECT_EQ(message("depth 585 585 320 240 640\n"),
            "calibration.txt:1: must be \"depth fx fy cx cy width height\"");
  EXPECT_EQ(message("infrared 1\n"), "calibration.txt:1: \"infrared\" is neither \"depth\" nor \"color\"");
  EXPECT_EQ(message("depth 9 9 1 1 2 2\ndepth 9 9 1 1 2 2\n"),
            "calibration.txt:2: a second depth line; there must be one");
  const std::string only = "only tx, ty, tz in metres may follow, on the color line";
  EXPECT_EQ(message("depth 9 9 1 1 2 2 tx 1\n"), "calibration.txt:1: \"tx\": " + only);
  EXPECT_EQ(message("color 9 9 1 1 2 2 tx\n"), "calibration.txt:1: \"tx\": " + only);
  EXPECT_EQ(message("color 9 9 1 1 2 2 tx 50\n"), "calibration.txt:1: \"tx\": " + only);
  EXPECT_EQ(message("color 9 9 1 1 2 2 roll 1\n"), "calibration.txt:1: \"roll\": " + only);
}

Rotation random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Rotation::from(
      Quaternion{normal(random), normal(random), normal(random), normal(random)}.normalized());
}

TEST(CalibrationToml, EveryRigReadsBackToTheSameBits) {
  const unsigned seed = 11;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 200; ++round) {
    const auto camera = [&] {
      return Intrinsics{.width = 640,
                        .height = 480,
                        .fx = 400 + 300 * unit(random),
                        .fy = 400 + 300 * unit(random),
                        .cx = 640 * unit(random),
                        .cy = 480 * unit(random),
                        .k1 = unit(random),
                        .k2 = -unit(random),
                        .p1 = 1e-4 * unit(random),
                        .p2 = 0,
                        .k3 = unit(random)};
    };
    RigCalibration rig;
    rig.depth = camera();
    rig.depth_m_per_unit = 1e-4 + 1e-3 * unit(random);
    rig.has_color = true;
    rig.color = camera();
    rig.T_color_depth = {random_rotation(random), {unit(random), -unit(random), unit(random)}};
    auto sut = parse_calibration_toml(format_calibration_toml(rig), "calibration.toml");
    ASSERT_TRUE(sut.has_value()) << sut.error().message;
    EXPECT_EQ(sut->depth, rig.depth);
    EXPECT_EQ(sut->color, rig.color);
    EXPECT_EQ(sut->depth_m_per_unit, rig.depth_m_per_unit);
    EXPECT_EQ(sut->T_color_depth.rotation.m, rig.T_color_depth.rotation.m);
    EXPECT_EQ(sut->T_color_depth.translation, rig.T_color_depth.translation);
    EXPECT_FALSE(sut->registered);
  }
}

TEST(IntrinsicsFile, WrittenScaleReadsBackToTheSameBits) {
  for (int units_per_m = 1; units_per_m <= 100000; ++units_per_m) {
    RigCalibration rig;
    rig.depth = {.width = 4, .height = 3, .fx = 1.5, .fy = 1.25, .cx = 1.1, .cy = 0.3};
    rig.depth_m_per_unit = 1.0 / units_per_m;
    auto sut = parse_intrinsics(format_intrinsics(rig), "intrinsics.txt");
    ASSERT_TRUE(sut.has_value());
    ASSERT_EQ(sut->depth_m_per_unit, rig.depth_m_per_unit);
    ASSERT_EQ(sut->depth, rig.depth);
  }
}

constexpr const char* kGood =
    "format = 1\nregistered = false\n"
    "[depth]\nwidth = 640\nheight = 480\nfx = 585\nfy = 585.0\ncx = 320\ncy = 240\nm_per_unit = 0.001\n"
    "[color]\nwidth = 640\nheight = 480\nfx = 526.2\nfy = 526.2\ncx = 322.6\ncy = 236.6\n"
    "[color.from_depth]\nrotation = [1,0,0,0,1,0,0,0,1]\ntranslation_m = [-0.03, 0, 0]\n";

std::string with(std::string_view from, std::string_view to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CalibrationToml, HandWrittenFileIsRead) {
  auto sut = parse_calibration_toml(kGood, "calibration.toml");
  ASSERT_TRUE(sut.has_value()) << sut.error().message;
  EXPECT_EQ(sut->color.fx, 526.2);
  EXPECT_EQ(sut->T_color_depth.translation.x, -0.03);
}

TEST(CalibrationToml, FaultsNameLineTableAndKey) {
  const auto message = [](const std::string& text) {
    return error_of(parse_calibration_toml(text, "calibration.toml"));
  };
  EXPECT_EQ(message(with("fx = 585\n", "fx = \"wide\"\n")),
            "calibration.toml:6: [depth] fx must be a finite number");
  EXPECT_EQ(message(with("fx = 585\n", "fx = nan\n")),
            "calibration.toml:6: [depth] fx must be a finite number");
  EXPECT_EQ(message(with("fx = 585\n", "f = 585\n")), "calibration.toml:3: [depth] fx is missing");
  EXPECT_EQ(message(with("cx = 322.6\n", "cx = 322.6\nk1 = 0.1\n")),
            "calibration.toml:17: [color] \"k1\" is no key of this table");
  EXPECT_EQ(message(with("format = 1", "format = 2")),
            "calibration.toml:1: format = 1 is what this program reads");
  EXPECT_EQ(message(with("registered = false", "registered = true")),
            "calibration.toml:11: [color] contradicts registered = true; remove one");
  EXPECT_EQ(message(with("[1,0,0,0,1,0,0,0,1]", "[1,0,0,0,1,0,0,0,-1]")),
            "calibration.toml:18: [color.from_depth] rotation is not a rotation matrix (to 1e-6)");
  EXPECT_EQ(message(with("[1,0,0,0,1,0,0,0,1]", "[1,0,0,0,1,0,0,0]")),
            "calibration.toml:19: [color.from_depth] rotation must be 9 finite numbers");
  EXPECT_EQ(message(with("width = 640", "width = 64000")),
            "calibration.toml:4: [depth] width must be a whole number of pixels, 1 to 8192");
  EXPECT_EQ(message(with("m_per_unit = 0.001", "m_per_unit = 0.0")),
            "calibration.toml:3: [depth] m_per_unit must be 0.000001 to 1 metre");
  EXPECT_TRUE(message("format = [").starts_with("calibration.toml:1: not valid TOML: ")) << message("format = [");
  EXPECT_EQ(message("format = 1\nregistered = true\n"), "calibration.toml: the table [depth] is missing");
}

}  // namespace
}  // namespace tactus::hal::replay
