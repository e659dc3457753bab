#include "pipeline/interact/script.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>

#include "pipeline/interact/schedule.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::interact {
namespace {

const Vec3d kGravity{0, -9.81, 0};

/// A camera 1.2 m above the floor that looks along -z and 30 degrees down: rows of the rotation are world
/// axes.
View camera() {
  T_WorldDepth T;
  const double c = 0.8660254037844386, s = 0.5;
  T.rotation.m = {1, 0, 0, 0, -c, -s, 0, s, -c};
  T.translation = {0, 1.2, 0};
  hal::Intrinsics picture;
  picture.width = 640;
  picture.height = 480;
  picture.fx = picture.fy = 525;
  picture.cx = 320;
  picture.cy = 240;
  return {T, picture, T};
}

Script dropped_ball() {
  Script script = default_script(App::none, 640, 480);
  script.throws.resize(1);
  return script;
}

std::string complaint(const std::string& toml) {
  const auto result = parse_script(toml, "drop.toml");
  EXPECT_FALSE(result.has_value()) << toml;
  if (result) return "";
  EXPECT_EQ(result.error().code, rt::ExitCode::bad_usage);
  return result.error().message;
}

TEST(Script, EveryKeyIsRead) {
  const auto script = parse_script(R"(
[[throw]]
at_frame = 12
shape = "box"
size_m = [0.2, 0.1, 0.3]
material = "ceramic"
position_m = [1, 2, -3]
velocity_m_per_s = [0.5, 0, -1]
[[throw]]
at_s = 2.5
radius_m = 0.03
in_front_m = 1.5
above_surface_m = 0.2
speed_m_per_s = 4
)",
                                        "drop.toml");
  ASSERT_TRUE(script.has_value()) << script.error().message;
  const auto& throws = script.value().throws;
  ASSERT_EQ(throws.size(), 2U);
  EXPECT_EQ(throws[0].when.at_frame, 12U);
  EXPECT_EQ(throws[0].shape.kind, contact::ShapeKind::box);
  EXPECT_EQ(throws[0].shape.half_extents_m, (Vec3d{0.1, 0.05, 0.15}));
  EXPECT_EQ(throws[0].material, material_from_name("ceramic"));
  EXPECT_EQ(throws[0].position_world_m, (Vec3d{1, 2, -3}));
  EXPECT_EQ(throws[0].velocity_world_m_per_s, (Vec3d{0.5, 0, -1}));
  EXPECT_EQ(throws[1].when.at_time->ns, 2'500'000'000);
  EXPECT_DOUBLE_EQ(throws[1].shape.radius_m, 0.03);
  EXPECT_FALSE(throws[1].position_world_m.has_value());
  EXPECT_DOUBLE_EQ(throws[1].in_front_m, 1.5);
  EXPECT_DOUBLE_EQ(*throws[1].above_surface_m, 0.2);
  EXPECT_DOUBLE_EQ(throws[1].speed_m_per_s, 4);
}

TEST(Script, MistakesAreOneSentenceWithFileLineAndKey) {
  EXPECT_EQ(complaint(""), "drop.toml: the script has no [[throw]], no [[shot]] and no [[walker]]");
  EXPECT_NE(complaint("[throw]\nat_s = 1\n").find("drop.toml:1: write [[throw]]"), std::string::npos);
  EXPECT_NE(complaint("speed = 3\n").find("drop.toml:1: unknown key \"speed\""), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nradios_m = 3\n")
                .find("drop.toml:3: [[throw]] has the unknown key \"radios_m\""),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nradius_m = 30\n").find("drop.toml:3: [[throw]] radius_m is 30"),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nradius_m = nan\n").find("radius_m is nan"), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nradius_m = 0.1\n").find("exactly one of at_s and at_frame"),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nat_frame = 1\n").find("exactly one of"), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_frame = 1.5\n").find("whole number"), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_frame = -1\n").find("at_frame is -1"), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nshape = \"cone\"\n").find("shape is \"cone\""),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nshape = 3\n").find("must be a text"), std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nsize_m = [1, 1, 1]\n").find("a sphere has radius_m"),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nmaterial = \"gold\"\n").find("\"gold\" is not one of the 23"),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nposition_m = [1, 2]\n").find("three numbers"), std::string::npos);
  EXPECT_NE(
      complaint("[[throw]]\nat_s = 1\nposition_m = [1, 2, \"a\"]\n").find("position_m[2] must be a number"),
      std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = 1\nposition_m = [1, 2, 3]\nin_front_m = 1\n").find("keep one"),
            std::string::npos);
  EXPECT_NE(complaint("[[throw]]\nat_s = = 1\n").find("drop.toml:2: not valid TOML"), std::string::npos);
  EXPECT_NE(complaint("throw = [1]\n").find("must be a table"), std::string::npos);
  std::string many;
  for (std::size_t i = 0; i <= kEntriesMax; ++i) many += "[[throw]]\nat_s = 1\n";
  EXPECT_NE(complaint(many).find("more than 256 entries [[throw]]"), std::string::npos);
  const auto missing = load_script("/nowhere/drop.toml");
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().message, "/nowhere/drop.toml: the script cannot be read");
}

TEST(Script, WalkersAreRead) {
  const auto script = parse_script(
      "[[walker]]\nat_frame = 3\nposition_m = [1, 0, -2]\ngoal_m = [2, 0, 1]\n"
      "[[walker]]\nat_s = 1.5\nin_front_m = 0.6\nwander = 7\n",
      "walk.toml");
  ASSERT_TRUE(script.has_value()) << script.error().message;
  const auto& walkers = script.value().walkers;
  ASSERT_EQ(walkers.size(), 2U);
  EXPECT_EQ(walkers[0].when.at_frame, 3U);
  EXPECT_EQ(walkers[0].position_world_m, (Vec3d{1, 0, -2}));
  EXPECT_EQ(walkers[0].goal_world_m, (Vec3d{2, 0, 1}));
  EXPECT_EQ(walkers[1].when.at_time->ns, 1'500'000'000);
  EXPECT_FALSE(walkers[1].position_world_m || walkers[1].goal_world_m);
  EXPECT_DOUBLE_EQ(walkers[1].in_front_m, 0.6);
  EXPECT_EQ(walkers[1].wander_seed, 7U);
  const auto plain = parse_script("[[walker]]\nat_s = 1\n", "walk.toml");
  ASSERT_TRUE(plain.has_value());
  EXPECT_DOUBLE_EQ(plain.value().walkers[0].in_front_m, 1);
  EXPECT_EQ(plain.value().walkers[0].wander_seed, 1U);
}

TEST(Script, MistakesInWalkersAreOneSentenceWithFileLineAndKey) {
  EXPECT_EQ(complaint("[[walker]]\nat_s = 1\nspeed = 3\n"), "drop.toml:3: [[walker]] has the unknown key \"speed\"");
  EXPECT_EQ(complaint("[[walker]]\nwander = 3\n"), "drop.toml:1: [[walker]] needs exactly one of at_s and at_frame");
  EXPECT_EQ(complaint("[[walker]]\nat_s = 1\ngoal_m = [1, 0, 0]\nwander = 3\n"),
            "drop.toml:4: [[walker]] has both goal_m and wander; keep one");
  EXPECT_EQ(complaint("[[walker]]\nat_s = 1\nposition_m = [1, 0, 0]\nin_front_m = 1\n"),
            "drop.toml:4: [[walker]] has both position_m and in_front_m; keep one");
  EXPECT_EQ(complaint("[[walker]]\nat_s = 1\nwander = 1.5\n"), "drop.toml:3: [[walker]] wander must be a whole number");
  EXPECT_NE(complaint("[[walker]]\nat_s = 1\nwander = -1\n").find("wander is -1; it must lie between 0"),
            std::string::npos);
  EXPECT_NE(complaint("[[walker]]\nat_s = 1\ngoal_m = [1, 0]\n").find("goal_m must be three numbers"), std::string::npos);
  EXPECT_EQ(complaint("[[walker]]\nat_s = 1\n[[walker]]\nat_s = 1\n[[walker]]\nat_s = 1\n"),
            "drop.toml:1: more than 2 entries [[walker]] in one script");
}

TEST(Script, BothGamesHaveAWanderer) {
  for (const App app : {App::shooting, App::plates}) {
    const Script script = default_script(app, 640, 480);
    ASSERT_EQ(script.walkers.size(), 1U);
    EXPECT_EQ(script.walkers[0].when.at_time->ns, 1'000'000'000);
    EXPECT_FALSE(script.walkers[0].goal_world_m);
  }
  EXPECT_TRUE(default_script(App::none, 640, 480).walkers.empty());
}

TEST(Script, BuiltInBallStartsAboveTheFloorInView) {
  auto scene = test::floor_scene();
  const contact::DistanceField field = scene.field();
  Schedule sut(dropped_ball());
  std::array<DueThrow, 4> out;
  EXPECT_EQ(sut.due_throws(29, {999'999'999}, camera(), kGravity, field, out), 0U);
  ASSERT_EQ(sut.due_throws(30, {1'000'000'000}, camera(), kGravity, field, out), 1U);
  EXPECT_NEAR(out[0].start.position_world_m.y, 0.4 + 0.05, 0.002);
  EXPECT_NEAR(out[0].start.position_world_m.z, -0.8 * 0.8660254, 1e-6);
  EXPECT_EQ(out[0].start.velocity_world_m_per_s, Vec3d{});
  EXPECT_EQ(sut.left(), 0U);
  EXPECT_EQ(sut.due_throws(31, {2'000'000'000}, camera(), kGravity, field, out), 0U) << "only once";
}

TEST(Script, TableNearerThanTheThrowIsFoundByComingNearer) {
  // A table whose far edge is at z = -0.57, seen from above; behind it nothing is known.
  test::AnalyticField scene([](const Vec3d& p) { return p.y - 0.7; });
  scene.set_seen([](const Vec3d& p) { return p.z > -0.57; });
  const auto start =
      place_above_surface(contact::Shape::sphere(0.05), 0.8, 0.3, camera().T_world_depth, kGravity, scene.field());
  ASSERT_TRUE(start.has_value());
  EXPECT_GT(start->z, -0.57);
  EXPECT_LT(start->z, -0.5);
  EXPECT_NEAR(start->y, 0.7 + 0.35, 0.002);
}

TEST(Script, WallInTheWayIsNotPassed) {
  test::AnalyticField scene(
      [](const Vec3d& p) { return std::min(p.y, p.z + 0.4); });  // a wall 0.46 m along the view
  EXPECT_FALSE(
      place_above_surface(contact::Shape::sphere(0.05), 0.8, 0.3, camera().T_world_depth, kGravity, scene.field()));
}

TEST(Script, WaitsForTheMapAndThenDropsStraightInFront) {
  auto scene = test::floor_scene();
  scene.set_solid(false);
  const contact::DistanceField field = scene.field();
  Schedule sut(dropped_ball());
  std::array<DueThrow, 4> out;
  EXPECT_EQ(sut.due_throws(30, {1'000'000'000}, camera(), kGravity, field, out), 0U);
  EXPECT_EQ(sut.due_throws(150, {5'900'000'000}, camera(), kGravity, field, out), 0U);
  ASSERT_EQ(sut.due_throws(180, {6'000'000'000}, camera(), kGravity, field, out), 1U);
  EXPECT_NEAR(out[0].start.position_world_m.y, 1.2 - 0.4, 1e-9);

  Schedule other(dropped_ball());
  EXPECT_EQ(other.due_throws(30, {1'000'000'000}, camera(), kGravity, field, out), 0U);
  scene.set_solid(true);
  ASSERT_EQ(other.due_throws(31, {1'033'000'000}, camera(), kGravity, field, out), 1U);
  EXPECT_NEAR(out[0].start.position_world_m.y, 0.45, 0.002);
}

TEST(Script, SpeedGoesAlongTheViewAndOverflowWaits) {
  auto scene = test::floor_scene();
  const auto script = parse_script(
      "[[throw]]\nat_frame = 1\nspeed_m_per_s = 2\nvelocity_m_per_s = [1, 0, 0]\n[[throw]]\nat_frame = 1\n",
      "drop.toml");
  ASSERT_TRUE(script.has_value());
  Schedule sut(script.value());
  std::array<DueThrow, 1> out;
  ASSERT_EQ(sut.due_throws(1, {0}, camera(), kGravity, scene.field(), out), 1U);
  EXPECT_NEAR(out[0].start.velocity_world_m_per_s.x, 1, 1e-12);
  EXPECT_NEAR(out[0].start.velocity_world_m_per_s.y, -1, 1e-12);
  EXPECT_NEAR(out[0].start.velocity_world_m_per_s.z, -1.7320508, 1e-6);
  EXPECT_EQ(sut.left(), 1U);
  EXPECT_EQ(sut.due_throws(2, {0}, camera(), kGravity, scene.field(), out), 1U);
  EXPECT_EQ(sut.left(), 0U);
}

TEST(Script, ExamplesOfTheProgramAreRead) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TACTUS_SOURCE_DIR) / "firmware_host/examples")) {
    const auto script = load_script(entry.path().string());
    ASSERT_TRUE(script.has_value()) << script.error().message;
    EXPECT_GE(script->throws.size() + script->shots.size(), 5U) << entry.path();
    EXPECT_EQ(script->walkers.size(), 1U) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 2);
}

}  // namespace
}  // namespace tactus::interact
