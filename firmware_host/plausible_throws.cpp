#include "firmware_host/plausible_throws.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/interact/dice.hpp"

namespace tactus::firmware {
namespace {

using interact::GameEvent;

constexpr double kSame_m =
    1e-6;  // the same arithmetic on the same map; what else is in the world orders the solver's sums

double part(double value) { return value - std::floor(value); }

Flight flight_of(const GameEvent& thrown) {
  return {.start_world_m = thrown.position_world_m,
          .velocity_world_m_per_s = thrown.normal_world * thrown.impact_speed_m_per_s};
}

bool left_alike(const GameEvent& a, const GameEvent& b) {
  return a.frame.sequence == b.frame.sequence && (a.position_world_m - b.position_world_m).norm() < kSame_m &&
         (a.normal_world * a.impact_speed_m_per_s - b.normal_world * b.impact_speed_m_per_s).norm() < kSame_m;
}

bool arrived_alike(const GameEvent* a, const GameEvent* b) {
  if (a == nullptr || b == nullptr) return a == b;
  return a->frame.sequence == b->frame.sequence &&
         (a->position_world_m - b->position_world_m).norm() < 0.001 &&
         std::abs(a->impact_speed_m_per_s - b->impact_speed_m_per_s) < 0.01;
}

const FollowedOrder* find(std::span<const FollowedOrder> orders, std::size_t index) {
  const auto found = std::find_if(orders.begin(), orders.end(),
                                  [&](const FollowedOrder& order) { return order.index == index; });
  return found == orders.end() ? nullptr : &*found;
}

}  // namespace

interact::Script plausibility_script(int throws_count, std::uint64_t frames_count,
                                     const hal::Intrinsics& picture, std::uint64_t seed) {
  // Roberts' R2 sequence (2018) covers the picture evenly however many throws there are; the seed shifts it.
  constexpr double kPlastic = 1.32471795724474602596;
  constexpr std::uint64_t kFirstFrame = 30;
  interact::Dice dice(seed);
  const double shift_u = dice.between(0, 1), shift_v = dice.between(0, 1);
  const double span = static_cast<double>(frames_count) - static_cast<double>(kFirstFrame + kTailFrames);
  interact::Script script;
  for (int i = 0; i < throws_count; ++i) {
    interact::Throw what;
    what.when.at_frame = kFirstFrame + static_cast<std::uint64_t>(std::max(0.0, span * i / throws_count));
    what.thing = i % 3 == 2 ? interact::ThingKind::cup : interact::ThingKind::plate;
    what.aim.pixel = {picture.width * (0.03 + 0.94 * part(shift_u + i / kPlastic)),
                      picture.height * (0.03 + 0.94 * part(shift_v + i / (kPlastic * kPlastic)))};
    what.in_front_m = 0.3;
    what.speed_m_per_s = dice.between(3, 6);
    script.throws.push_back(what);
  }
  return script;
}

JudgedThrows judge_throws(const TrueRoom& room, const interact::Script& script, const ThingBuilds& things,
                          const contact::MaterialTable& table, const ThrowLog& none, const ThrowLog& uniform,
                          const ThrowLog& semantic) {
  const auto of_none = follow_throws(none.events), of_uniform = follow_throws(uniform.events),
             of_semantic = follow_throws(semantic.events);
  JudgedThrows result;
  result.thrown_count = of_semantic.size();
  for (const FollowedOrder& order : of_semantic) {
    const FollowedOrder *in_none = find(of_none, order.index), *in_uniform = find(of_uniform, order.index);
    if (in_none == nullptr || in_uniform == nullptr || !left_alike(*order.begun, *in_none->begun) ||
        !left_alike(*order.begun, *in_uniform->begun)) {
      ++result.differed;
      continue;
    }
    if (order.met_body_first || in_uniform->met_body_first) {
      ++result.met_body;
      continue;
    }
    if (!arrived_alike(order.impact, in_uniform->impact)) {
      ++result.differed;
      continue;
    }
    const ThingBuild& thing = things[static_cast<std::size_t>(script.throws[order.index].thing)];
    const Flight flight = flight_of(*order.begun);
    const double left_s = (semantic.end - order.begun->frame.time).seconds();
    const auto touch = room.first_touch(flight, left_s);

    JudgedThrow judged;
    judged.index = order.index;
    const GameEvent* impact = order.impact;
    double past_m = 0;
    if (impact != nullptr && touch) {
      const double impact_s = flight.nearest_s(impact->position_world_m, left_s);
      if (impact_s > touch->time_s) past_m = (flight.at(impact_s) - flight.at(touch->time_s)).norm();
    }
    if (impact == nullptr && !touch) {
      // Whether it would have met something is not known before it has come down to the floor.
      ++(room.first_touch(flight, left_s + 5) ? result.in_the_air : result.met_nothing);
      continue;
    }
    if (impact == nullptr || past_m > kPast_m) {
      judged.kind = ThrowKind::missing_surface;
      judged.position_world_m = touch->position_world_m;
      judged.energy_j = contact::impact_energy_j(
          thing.build.volume_m3 * table.of(thing.material).density_kg_per_m3, touch->approach_m_per_s);
    } else {
      judged.position_world_m = impact->position_world_m;
      judged.energy_j = impact->energy_j;
      judged.surface_distance_m = room.distance(impact->position_world_m);
      judged.label = impact->material;
      judged.probability = impact->probability;
      judged.uniform = in_uniform->impact->outcome;
      judged.semantic = impact->outcome;
      if (std::abs(judged.surface_distance_m) > kSurface_m) judged.kind = ThrowKind::nothing_there;
    }
    if (judged.kind != ThrowKind::nothing_there) {
      judged.true_material = room.material(judged.position_world_m);
      judged.expected = outcome_on(thing, judged.true_material, judged.energy_j, table);
    }
    result.judged.push_back(judged);
  }
  return result;
}

}  // namespace tactus::firmware
