#include "pipeline/interact/game.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "tests/pipeline/interact/striped_floor.hpp"
#include "tests/rt/aligned_memory.hpp"

namespace tactus::interact {
namespace {

const Vec3d kGravity{0, -9.81, 0};
constexpr rt::Duration kFrame{33'333'333};

/// 1.5 m above the middle of the floor's first edge, looking straight down; the picture's u runs along x.
View looking_down(double x = 0.5) {
  T_WorldDepth T;
  T.rotation.m = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  T.translation = {x, 1.5, 0};
  hal::Intrinsics picture;
  picture.width = 640;
  picture.height = 480;
  picture.fx = picture.fy = 525;
  picture.cx = 320;
  picture.cy = 240;
  return {T, picture, T};
}

/// A game with its world, over a floor.
class Session {
 public:
  /// `felt`: the room that stops things, where that is not the floor.
  Session(std::span<const std::string_view> stripes, Script script, std::size_t bodies = 64,
          const contact::DistanceField* felt = nullptr)
      : floor_(stripes), field_(felt != nullptr ? *felt : floor_.field()) {
    config_.bodies_capacity = bodies;
    world_config_.bodies_capacity = bodies;
    world_config_.contacts_capacity = 6 * bodies;
    game_memory_.emplace(Game::bytes_needed(config_));
    world_memory_.emplace(contact::World::bytes_needed(world_config_));
    const auto table = contact::default_material_table();
    auto bound = world.bind(world_memory_->slice(), world_config_, field_, table);
    TACTUS_ASSERT(bound.has_value());
    bound = sut.bind(game_memory_->slice(), config_, std::move(script), table, field_);
    TACTUS_ASSERT(bound.has_value());
  }
  void run(int frames, bool is_tracked = true) {
    for (int i = 0; i < frames; ++i) {
      ++header_.sequence;
      EXPECT_EQ(sut.step(view, is_tracked, header_, kFrame, world), rt::Status::ok);
      cues.insert(cues.end(), sut.cues().begin(), sut.cues().end());
    }
  }
  [[nodiscard]] std::vector<GameEvent> of_kind(GameEventKind kind) const {
    std::vector<GameEvent> found;
    for (const GameEvent& event : sut.events())
      if (event.kind == kind) found.push_back(event);
    return found;
  }

  View view = looking_down();
  std::vector<SoundCue> cues;

 private:
  test::StripedFloor floor_;
  contact::DistanceField field_;
  GameConfig config_;
  contact::WorldConfig world_config_;
  std::optional<test::AlignedMemory> game_memory_, world_memory_;
  hal::FrameHeader header_;

 public:
  contact::World world;  // closed before its memory goes
  Game sut;
};

Script thrown(ThingKind thing, Vec3d target, double speed) {
  Throw what;
  what.when.at_frame = 1;
  what.thing = thing;
  what.aim.target_world_m = target;
  what.speed_m_per_s = speed;
  Script script;
  script.throws.push_back(what);
  return script;
}

Throw plate_at_the_middle() {
  Throw what;
  what.thing = ThingKind::plate;
  what.aim.pixel = std::array<double, 2>{320, 240};
  what.speed_m_per_s = 5;
  return what;
}

Script shot_at(Vec3d target, double projectile_m_per_s = 0) {
  Shot shot;
  shot.when.at_frame = 1;
  shot.aim.target_world_m = target;
  shot.projectile_m_per_s = projectile_m_per_s;
  Script script;
  script.shots.push_back(shot);
  return script;
}

constexpr std::array<std::string_view, 1> kWood = {"wood"};
constexpr std::array<std::string_view, 1> kGlass = {"glass"};

struct Case {
  std::string_view surface;
  double speed;
  contact::Outcome outcome;
};

class PlateGame : public testing::TestWithParam<Case> {};

// The paper's figure 7, played: desk, book, screen and chair, and the same throw at other speeds.
TEST_P(PlateGame, ThrowEndsAsThePaperShows) {
  const auto& [surface, speed, outcome] = GetParam();
  const std::array<std::string_view, 1> stripes = {surface};
  Session session(stripes, thrown(ThingKind::plate, {0.5, 0, 0}, speed));
  session.run(60);
  const GameEvent* first = nullptr;
  for (const GameEvent& event : session.sut.events())
    if (event.kind == GameEventKind::contact || event.kind == GameEventKind::broke) {
      first = &event;
      break;
    }
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(contact::kOutcomeNames[static_cast<std::size_t>(first->outcome)], contact::kOutcomeNames[static_cast<std::size_t>(outcome)]);
  EXPECT_EQ(first->material, material_from_name(surface));
  EXPECT_EQ(first->order_index, 0);
  const bool breaks = outcome == contact::Outcome::broke || outcome == contact::Outcome::broke_with_chips;
  EXPECT_EQ(session.sut.counters().broken, breaks ? 1U : 0U);
  if (!breaks) {
    ASSERT_EQ(session.world.bodies().size(), 1U) << "the plate is whole";
    EXPECT_EQ(session.world.bodies()[0].shape.kind, contact::ShapeKind::cylinder);
  } else {
    EXPECT_GE(session.world.bodies().size(), ThingCatalogue::kPiecesCount);
    EXPECT_EQ(first->chips_count > 0, outcome == contact::Outcome::broke_with_chips);
  }
  EXPECT_EQ(first->mark_index >= 0, outcome == contact::Outcome::broke_with_chips);
}
INSTANTIATE_TEST_SUITE_P(Matrix, PlateGame,
                         testing::Values(Case{"wood", 5, contact::Outcome::broke}, Case{"paper", 5, contact::Outcome::bounced},
                                         Case{"glass", 5, contact::Outcome::broke_with_chips},
                                         Case{"fabric", 5, contact::Outcome::intact},
                                         Case{"fabric", 15, contact::Outcome::intact},
                                         Case{"carpet", 5, contact::Outcome::intact}, Case{"stone", 5, contact::Outcome::broke},
                                         Case{"painted", 5, contact::Outcome::broke}),
                         [](const auto& p) {
                           return std::string(p.param.surface) + "At" + std::to_string(static_cast<int>(p.param.speed));
                         });

TEST(Game, PiecesOfABrokenPlateKeepItsMassAndItsWay) {
  Session session(kWood, thrown(ThingKind::plate, {0.5, 0, 0}, 5));
  double mass = 0;
  for (int i = 0; i < 60 && session.sut.counters().broken == 0; ++i) {
    if (!session.world.bodies().empty()) mass = session.world.bodies()[0].mass_kg;
    session.run(1);
  }
  ASSERT_EQ(session.sut.counters().broken, 1U);
  double pieces = 0;
  for (const contact::BodyState& body : session.world.bodies()) {
    EXPECT_EQ(body.shape.kind, contact::ShapeKind::hull);
    EXPECT_LT(body.velocity_world_m_per_s.norm(), 8);
    EXPECT_LT((body.position_world_m - Vec3d{0.5, 0, 0}).norm(), 0.6);
    pieces += body.mass_kg;
  }
  EXPECT_NEAR(pieces, mass, 1e-9);
  session.run(150);
  EXPECT_EQ(session.world.counters().bodies_lost, 0U);
  for (const contact::BodyState& body : session.world.bodies()) EXPECT_GT(body.position_world_m.y, -0.002);
}

TEST(Game, CupShattersOnStoneAndStaysWholeOnFabric) {
  for (const auto& [surface, breaks] : {std::pair<std::string_view, bool>{"stone", true}, {"fabric", false}}) {
    const std::array<std::string_view, 1> stripes = {surface};
    Script script = thrown(ThingKind::cup, {0.5, 0, 0}, 1);
    script.throws[0].aim = {};
    script.throws[0].position_world_m = Vec3d{0.5, 0.8, 0};
    Session session(stripes, std::move(script));
    session.run(45);
    EXPECT_EQ(session.sut.counters().broken, breaks ? 1U : 0U) << surface;
  }
}

class Shooting : public testing::TestWithParam<std::size_t> {};

TEST_P(Shooting, HoleChipsAndSoundAreThoseOfTheMaterial) {
  const auto id = static_cast<MaterialId>(GetParam());
  const std::array<std::string_view, 1> stripes = {kMaterialNames[id]};
  const contact::MaterialTable table = contact::default_material_table();
  for (const double projectile : {0.0, 100.0}) {
    Session session(stripes, shot_at({0.5, 0, 0}, projectile));
    session.run(3);
    const auto hits = session.of_kind(GameEventKind::hit);
    ASSERT_EQ(hits.size(), 1U) << "projectile " << projectile;
    EXPECT_EQ(hits[0].material, id);
    EXPECT_FLOAT_EQ(hits[0].probability, 1);
    EXPECT_NEAR(hits[0].position_world_m.x, 0.5, 0.01);
    EXPECT_NEAR(hits[0].position_world_m.y, 0, 0.01);
    const contact::FractureProperties& fracture = table.fracture_of(id);
    EXPECT_EQ(hits[0].chips_count > 0, fracture.chips_per_joule > 0) << hits[0].chips_count;
    EXPECT_EQ(hits[0].mark_index >= 0, fracture.decal != DecalKind::none);
    EXPECT_EQ(session.sut.counters().chips, static_cast<std::uint64_t>(hits[0].chips_count));
    if (fracture.decal != DecalKind::none) {
      ASSERT_EQ(session.sut.marks().size(), 1U);
      const Mark& mark = session.sut.marks()[0];
      EXPECT_EQ(mark.kind, fracture.decal);
      EXPECT_NEAR(static_cast<double>(mark.normal_world.y), 1, 1e-6);
      // All 60 J, or what a hard surface leaves in the bullet, 60^(1/3) = 3.9.
      EXPECT_GT(static_cast<double>(mark.radius_m), fracture.decal_radius_m * 2);
      EXPECT_LT(static_cast<double>(mark.radius_m), fracture.decal_radius_m * 3.92);
      EXPECT_EQ(mark.color, (Rgb8{10, 20, 30}));
    }
    ASSERT_GE(session.cues.size(), 1U);
    EXPECT_EQ(session.cues[0].surface_material, id);
    EXPECT_GT(session.cues[0].energy_j, 0);
    for (const contact::BodyState& body : session.world.bodies()) {
      EXPECT_EQ(body.material, id) << "only chips are left";
      EXPECT_EQ(session.sut.look_of(body).color, (Rgb8{10, 20, 30})) << "coloured as the surface";
    }
  }
}
INSTANTIATE_TEST_SUITE_P(AllMaterials, Shooting, testing::Range(std::size_t{0}, std::size_t{kMaterialCount}),
                         [](const auto& p) { return std::string(kMaterialNames[p.param]); });

TEST(Game, ShotIntoUnlabelledOrUniformSurfaceActsAsOther) {
  Session session(kGlass, shot_at({-0.5, 0, 0}));
  session.run(3);
  const auto hits = session.of_kind(GameEventKind::hit);
  ASSERT_EQ(hits.size(), 1U);
  EXPECT_EQ(hits[0].material, kUnknownMaterial);
  ASSERT_EQ(session.sut.marks().size(), 1U);
  EXPECT_EQ(session.sut.marks()[0].kind,
            contact::default_material_table().fracture_of(material_from_name("other")).decal);
}

TEST(Game, ShotThatMeetsNothingIsCounted) {
  Session session(kWood, shot_at({0.5, 3, 0}));
  session.run(3);
  EXPECT_TRUE(session.of_kind(GameEventKind::hit).empty());
  EXPECT_EQ(session.sut.counters().misses, 1U);
}

TEST(Game, PlateInTheWayOfAShotBreaksInTheAir) {
  Script script = thrown(ThingKind::plate, {0.5, 0, 0}, 1);
  script.throws[0].aim = {};
  script.throws[0].position_world_m = Vec3d{0.5, 1, 0};
  Shot shot;
  shot.when.at_frame = 3;
  shot.aim.target_world_m = Vec3d{0.5, 0, 0};
  script.shots.push_back(shot);
  Session session(kWood, std::move(script));
  session.run(4);
  EXPECT_EQ(session.sut.counters().broken, 1U);
  EXPECT_TRUE(session.sut.marks().empty()) << "the plate took it";
  for (const contact::BodyState& body : session.world.bodies()) EXPECT_GT(body.position_world_m.y, 0.5);
}

TEST(Game, BallInTheWayOfAShotIsPushed) {
  Script script;
  Throw ball;
  ball.when.at_frame = 1;
  ball.shape = contact::Shape::sphere(0.05);
  ball.position_world_m = Vec3d{0.5, 1, 0};
  script.throws.push_back(ball);
  Shot shot;
  shot.when.at_frame = 2;
  shot.aim.target_world_m = Vec3d{0.5, 0, 0};
  script.shots.push_back(shot);
  Session session(kWood, std::move(script));
  session.run(1);
  const double before = session.world.bodies()[0].velocity_world_m_per_s.y;
  session.run(1);
  const double fallen = kGravity.y * kFrame.seconds();
  EXPECT_LT(session.world.bodies()[0].velocity_world_m_per_s.y - before, fallen - 0.1);
}

TEST(Game, OldestDebrisMakesRoomForWhatIsNew) {
  Script script;
  for (std::uint64_t i = 0; i < 6; ++i) {
    Shot shot;
    shot.when.at_frame = 1 + i;
    shot.aim.target_world_m = Vec3d{0.5, 0, 0};
    script.shots.push_back(shot);
  }
  Session session(kGlass, std::move(script), 16);
  session.run(8);
  EXPECT_EQ(session.of_kind(GameEventKind::hit).size(), 6U);
  EXPECT_LE(session.world.bodies().size(), 16U);
  EXPECT_GT(session.sut.counters().debris_recycled, 0U);
  EXPECT_EQ(session.sut.marks().size(), 6U);
}

TEST(Game, ChipsGoAfterTheirTime) {
  Session session(kGlass, shot_at({0.5, 0, 0}));
  session.run(3);
  EXPECT_GT(session.world.bodies().size(), 0U);
  session.run(100);
  EXPECT_EQ(session.world.bodies().size(), 0U);
}

TEST(Game, NothingIsThrownWithoutAPose) {
  Session session(kWood, thrown(ThingKind::plate, {0.5, 0, 0}, 5));
  session.run(5, false);
  EXPECT_TRUE(session.world.bodies().empty());
  EXPECT_EQ(session.sut.throw_now(plate_at_the_middle(), session.world), rt::Status::lost);
  session.run(1, true);
  EXPECT_EQ(session.world.bodies().size(), 1U) << "it comes when the pose does";
}

TEST(Game, HandThrowsAndShootsAtOnce) {
  Session session(kWood, {});
  session.run(1);
  Throw what = plate_at_the_middle();
  EXPECT_EQ(session.sut.throw_now(what, session.world), rt::Status::ok);
  EXPECT_EQ(session.sut.shoot_now({}, session.world), rt::Status::ok);
  session.run(40);
  EXPECT_EQ(session.of_kind(GameEventKind::thrown)[0].order_index, -1);
  EXPECT_EQ(session.sut.counters().shots, 1U);
}

TEST(Game, ThrowIsAimedAtWhatIsSeenWhetherItStopsThingsOrNot) {
  Script script;
  script.throws.push_back(plate_at_the_middle());
  script.throws[0].when.at_frame = 1;
  const auto start = [&](bool is_solid) {  // one world at a time
    const test::StripedFloor floor(kWood);
    contact::DistanceField nothing;
    nothing.sample_fn = [](const void*, const Vec3f&, map::DistanceSample&) noexcept { return false; };
    nothing.materials_fn = [](const void*, const Vec3f&, MaterialDistribution&) noexcept { return false; };
    Session session(kWood, script, 64, is_solid ? nullptr : &nothing);
    if (!is_solid) session.view.seen = floor.field();
    session.run(1);
    return session.of_kind(GameEventKind::thrown).at(0);
  };
  const GameEvent sut = start(false), expected = start(true);
  EXPECT_EQ(sut.position_world_m, expected.position_world_m);
  EXPECT_EQ(sut.normal_world, expected.normal_world);
  EXPECT_EQ(sut.impact_speed_m_per_s, expected.impact_speed_m_per_s);
  EXPECT_NEAR(sut.normal_world.norm(), 1, 1e-12);
}

TEST(Game, ContactSaysWhetherABodyOrTheRoomWasMet) {
  Script script;
  for (const double height_m : {0.05, 0.4}) {
    Throw ball;
    ball.when.at_frame = 1;
    ball.shape = contact::Shape::sphere(0.05);
    ball.position_world_m = Vec3d{0.5, height_m, 0};
    script.throws.push_back(ball);
  }
  script.throws[1].velocity_world_m_per_s = {0, -3, 0};
  Session session(kWood, std::move(script));
  session.run(10);
  bool has_met_a_body = false;
  for (const GameEvent& event : session.of_kind(GameEventKind::contact)) {
    if (event.other_body_index < 0) {
      EXPECT_NEAR(event.position_world_m.y, 0, 0.005);
      continue;
    }
    has_met_a_body = true;
    EXPECT_NE(event.other_body_index, event.body_index);
    EXPECT_NEAR(event.position_world_m.y, 0.1, 0.01) << "between the two balls";
  }
  EXPECT_TRUE(has_met_a_body);
}

TEST(Game, MomentInFramesDoesNotDependOnHowOftenTheGameIsAsked) {
  Script script = thrown(ThingKind::plate, {0.5, 0, 0}, 5);
  script.throws[0].when.at_frame = 10;
  Session session(kWood, script);
  hal::FrameHeader header;
  const auto round = [&](std::uint64_t sequence) {
    header.sequence = sequence;
    EXPECT_EQ(session.sut.step(session.view, true, header, kFrame, session.world), rt::Status::ok);
  };
  for (std::uint64_t frame = 100; frame < 109; ++frame)
    for (int i = 0; i < 3; ++i) round(frame);
  EXPECT_EQ(session.sut.counters().throws, 0U) << "nine frames, however many rounds";
  round(111);  // two were dropped
  EXPECT_EQ(session.sut.counters().throws, 1U);
}

TEST(Game, SameScriptGivesTheSameEvents) {
  const auto play = [] {
    Session session(kGlass, default_script(App::plates, 640, 480));
    session.run(200);
    return std::vector<GameEvent>(session.sut.events().begin(), session.sut.events().end());
  };
  const auto first = play(), second = play();
  ASSERT_EQ(first.size(), second.size());
  ASSERT_GT(first.size(), 5U);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].position_world_m, second[i].position_world_m);
    EXPECT_EQ(first[i].impulse_n_s, second[i].impulse_n_s);
    EXPECT_EQ(first[i].chips_speed_m_per_s, second[i].chips_speed_m_per_s);
  }
}

TEST(Game, HundredSecondsOfPlatesLoseNoPieceThroughTheFloor) {
  Session session(kWood, default_script(App::plates, 640, 480));
  session.run(3000);
  EXPECT_EQ(session.world.counters().bodies_lost, 0U);
  EXPECT_EQ(session.sut.counters().throws, 96U);
  EXPECT_EQ(session.sut.counters().events_dropped, 0U);
}

}  // namespace
}  // namespace tactus::interact
