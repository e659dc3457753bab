// What happens in the room when no script says it.
#include "pipeline/interact/script.hpp"

namespace tactus::interact {
namespace {

constexpr rt::Duration milliseconds(std::int64_t ms) { return {ms * 1'000'000}; }

Script balls() {
  Script script;
  Throw drop;
  drop.when.at_time = milliseconds(1000);
  drop.shape = contact::Shape::sphere(0.05);
  drop.above_surface_m = 0.4;
  script.throws.push_back(drop);
  constexpr struct {
    std::int64_t at_ms;
    std::string_view material;
    double speed;
  } kTosses[] = {{500, "plastic", 2.6}, {1200, "wood", 3.0}, {2000, "leather", 3.4}};
  for (const auto& toss : kTosses) {
    Throw ball;
    ball.when.at_time = milliseconds(toss.at_ms);
    ball.shape = contact::Shape::sphere(0.08);
    ball.material = material_from_name(toss.material);
    ball.in_front_m = 0.6;
    ball.speed_m_per_s = toss.speed;
    script.throws.push_back(ball);
  }
  return script;
}

/// Over the picture in an order that jumps, so that neighbours are hit at different times; shares of its size.
constexpr std::array<std::array<double, 2>, 12> kTargets = {{{0.5, 0.6}, {0.25, 0.7}, {0.75, 0.65}, {0.4, 0.45}, {0.6, 0.8}, {0.15, 0.5},
                                                             {0.85, 0.45}, {0.35, 0.85}, {0.65, 0.4}, {0.5, 0.3}, {0.2, 0.85}, {0.8, 0.8}}};

std::array<double, 2> target_px(std::size_t i, int width, int height) {
  const auto& share = kTargets[i % kTargets.size()];
  return {share[0] * width, share[1] * height};
}

constexpr std::size_t kRounds = 96;  // a minute and a half of plates

}  // namespace

Script default_script(App app, int width, int height) {
  if (app == App::none) return balls();
  Script script;
  Walker walker;
  walker.when.at_time = milliseconds(1000);
  script.walkers.push_back(walker);
  for (std::size_t i = 0; i < kRounds; ++i) {
    const auto round = static_cast<std::int64_t>(i);
    if (app == App::plates) {
      Throw plate;
      plate.when.at_time = milliseconds(800 + 1000 * round);
      plate.thing = i % 4 == 3 ? ThingKind::cup : ThingKind::plate;
      plate.aim.pixel = target_px(i, width, height);
      plate.in_front_m = 0.3;
      plate.speed_m_per_s = 5;
      script.throws.push_back(plate);
    } else {
      Shot shot;
      shot.when.at_time = milliseconds(800 + 500 * round);
      shot.aim.pixel = target_px(i, width, height);
      if (i % 3 == 2) shot.projectile_m_per_s = 100;
      script.shots.push_back(shot);
    }
  }
  return script;
}

}  // namespace tactus::interact
