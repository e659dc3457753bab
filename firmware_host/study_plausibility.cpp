#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "firmware_host/machine.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/plausibility.hpp"
#include "firmware_host/plausible_throws.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/session.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_sets.hpp"
#include "firmware_host/study_text.hpp"
#include "firmware_host/summary.hpp"
#include "pipeline/contact/touched_room.hpp"

namespace tactus::firmware {
namespace {

using Conditions = std::vector<PlausibilityCondition>;

/// What of a session is judged once its pipeline, and with it ODE's memory, is gone.
struct Played {
  std::vector<interact::GameEvent> events;
  rt::SensorTime end;
  T_WorldDepth T_world_first;
  ThingBuilds builds;
  std::string labels;
  std::uint64_t events_dropped = 0;
  [[nodiscard]] ThrowLog log() const { return {events, end}; }
};

rt::Result<Played> play(const StudyPlausibilityOptions& options, const std::string& source,
                        std::string_view condition, const interact::Script& script) {
  SessionRequest request;
  request.options.source = source;
  request.options.runner = "lockstep";
  request.options.profile = options.profile;
  request.options.settings = {"labels.source=" + options.labels};  // before the user's, which win
  request.options.settings.insert(request.options.settings.end(), options.settings.begin(),
                                  options.settings.end());
  request.options.model = options.model;
  request.options.materials = options.materials;
  request.options.app = "plates";
  request.options.collision = condition;
  request.script = script;
  auto opened = Session::open(std::move(request));
  if (!opened) return opened.error();
  Session& session = **opened;
  if (auto ran = session.play(); !ran) return ran.error();
  // Relaxed: the flag carries no data, and the session is over.
  if (interrupted.load(std::memory_order_relaxed))
    return rt::Error{rt::ExitCode::failed, "The study was interrupted before its end."};
  const Pipeline& pipeline = session.pipeline();
  if (pipeline.trajectory().empty())
    return rt::Error{rt::ExitCode::failed, source + ": no frame was tracked, so nothing was thrown."};
  Played played;
  played.events.assign(pipeline.game().events().begin(), pipeline.game().events().end());
  played.end = pipeline.trajectory().back().time;
  played.T_world_first = pipeline.trajectory().front().T_world_depth;
  for (std::size_t i = 0; i < played.builds.size(); ++i) {
    const interact::Thing& thing = pipeline.game().catalogue().of(static_cast<interact::ThingKind>(i));
    played.builds[i] = {thing.build, thing.material};
  }
  played.labels = session.source().labels.name;
  played.events_dropped = pipeline.game().counters().events_dropped;
  return played;
}

void add_contacts(Conditions& conditions, const JudgedThrows& throws, std::uint64_t first_id) {
  for (const JudgedThrow& one : throws.judged) {
    const std::uint64_t id = first_id + one.index;
    conditions[0].contacts.push_back({id, one.expected, contact::Outcome::through});
    conditions[1].contacts.push_back({id, one.expected, one.uniform});
    conditions[2].contacts.push_back({id, one.expected, one.semantic});
  }
}

Conditions empty_conditions() {
  Conditions conditions;
  for (const std::string_view name : contact::kCollisionNames) conditions.push_back({std::string(name), {}});
  return conditions;
}

std::string material_name(MaterialId id) {
  return id < kMaterialCount ? std::string(kMaterialNames[id]) : "nothing";
}
std::string name_of(contact::Outcome outcome) {
  return std::string(contact::kOutcomeNames[static_cast<std::size_t>(outcome)]);
}

nlohmann::json json_of(const JudgedThrow& one) {
  return {{"throw", one.index},
          {"kind", kThrowKindNames[static_cast<std::size_t>(one.kind)]},
          {"true_material", material_name(one.true_material)},
          {"label", material_name(one.label)},
          {"probability", one.probability},
          {"position_world_m", {one.position_world_m.x, one.position_world_m.y, one.position_world_m.z}},
          {"surface_distance_m", one.surface_distance_m},
          {"energy_j", one.energy_j},
          {"expected", name_of(one.expected)},
          {"uniform", name_of(one.uniform)},
          {"semantic", name_of(one.semantic)}};
}

nlohmann::json json_of(const JudgedThrows& throws) {
  nlohmann::json json = {{"thrown", throws.thrown_count},
                         {"left_out",
                          {{"met_another_thing", throws.met_body},
                           {"in_the_air_at_the_end", throws.in_the_air},
                           {"met_nothing", throws.met_nothing},
                           {"differed_between_conditions", throws.differed}}},
                         {"contacts", nlohmann::json::array()}};
  for (const JudgedThrow& one : throws.judged) json["contacts"].push_back(json_of(one));
  return json;
}

std::string left_out_text(const std::string& room, const JudgedThrows& throws) {
  return room + ": " + std::to_string(throws.thrown_count) + " thrown, " +
         std::to_string(throws.judged.size()) + " judged; left out: " + std::to_string(throws.met_body) +
         " that met another thing first, " + std::to_string(throws.in_the_air) + " in the air at the end, " +
         std::to_string(throws.met_nothing) + " that met nothing, " + std::to_string(throws.differed) +
         " that differed\n";
}

/// Where `semantic` was wrong: on what, taken for what.
std::string mismatch_text(const std::vector<JudgedThrow>& judged) {
  std::map<std::string, std::size_t> counts;
  for (const JudgedThrow& one : judged) {
    if (one.semantic == one.expected) continue;
    const std::string on = one.kind == ThrowKind::nothing_there
                               ? "nothing, where the map has " + material_name(one.label)
                           : one.kind == ThrowKind::missing_surface
                               ? material_name(one.true_material) + ", which the map does not have"
                               : material_name(one.true_material) + " taken for " + material_name(one.label);
    ++counts[on + ": " + name_of(one.semantic) + " instead of " + name_of(one.expected)];
  }
  if (counts.empty()) return {};
  std::string text = "\nWhere semantic went otherwise than expected\n";
  for (const auto& [what, count] : counts) text += "  " + std::to_string(count) + "  " + what + "\n";
  return text;
}

}  // namespace

rt::Result<std::string> study_plausibility(const StudyPlausibilityOptions& options) {
  auto table = contact::default_material_table();
  if (!options.materials.empty()) {
    auto loaded = contact::load_material_table(options.materials.string());
    if (!loaded) return loaded.error();
    table = *loaded;
  }
  if (!options.out.empty())
    if (auto made = make_study_folder(options.out); !made) return made.error();
  Conditions conditions = empty_conditions();
  nlohmann::json rooms = nlohmann::json::object();
  std::vector<JudgedThrow> judged;
  std::string shares, left_out, labels;
  for (std::size_t r = 0; r < options.rooms.size(); ++r) {
    const std::string& room = options.rooms[r];
    const std::string source =
        "synthetic:" + room + "?frames=" + std::to_string(options.frames_count) + "&mode=" + options.mode;
    auto parsed = hal::parse_synthetic_name(source);
    if (!parsed) return parsed.error();
    const interact::Script script =
        plausibility_script(options.throws_count, static_cast<std::uint64_t>(options.frames_count),
                            hal::synthetic::calibration_of(*parsed).color, options.seed + r);
    std::vector<Played> played;
    for (const std::string_view condition : contact::kCollisionNames) {
      auto one = play(options, source, condition, script);
      if (!one) return one.error();
      if (one->events_dropped > 0)
        left_out += room + ", " + std::string(condition) + ": " + std::to_string(one->events_dropped) +
                    " events found no place in the log; later throws may look as if they met nothing.\n";
      played.push_back(std::move(*one));
    }
    labels = played.back().labels;
    auto true_room = TrueRoom::of(source, played.front().T_world_first);
    if (!true_room) return true_room.error();
    const JudgedThrows throws = judge_throws(*true_room, script, played[0].builds, table, played[0].log(),
                                             played[1].log(), played[2].log());
    rooms[room] = json_of(throws);
    left_out += left_out_text(room, throws);
    add_contacts(conditions, throws, 1000 * r);
    judged.insert(judged.end(), throws.judged.begin(), throws.judged.end());
    if (options.rooms.size() > 1 && !throws.judged.empty()) {
      Conditions of_room = empty_conditions();
      add_contacts(of_room, throws, 0);
      const auto result = plausibility_of(of_room);
      if (!result) return result.error();
      rooms[room].update(plausibility_json(*result));
      shares += padded(room, 10);
      for (const ConditionShare& share : result->shares)
        shares += "  " + share.name + " " + fixed(100 * share.share, 1) + " %";
      shares += " of " + std::to_string(throws.judged.size()) + "\n";
    }
  }
  const auto result = plausibility_of(conditions);
  if (!result) return result.error();
  nlohmann::json json = plausibility_json(*result);
  json["rooms"] = rooms;
  json["labels"] = labels;
  json["seed"] = options.seed;
  json["command"] = options.command;
  json["revision"] = revision();
  const std::string json_text = to_text(json);
  if (!options.out.empty())
    if (auto wrote = write_file(options.out / "plausibility.json", json_text); !wrote) return wrote.error();
  if (options.is_json) return json_text;
  return "Labelled by " + labels + "\n" + plausibility_text(*result) + mismatch_text(judged) + "\n" + shares +
         left_out;
}

}  // namespace tactus::firmware
