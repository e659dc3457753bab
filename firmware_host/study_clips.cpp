#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "firmware_host/followed_order.hpp"
#include "firmware_host/machine.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/run_outputs.hpp"
#include "firmware_host/run_session.hpp"
#include "firmware_host/session.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_sets.hpp"
#include "firmware_host/study_text.hpp"
#include "firmware_host/summary.hpp"
#include "pipeline/contact/touched_room.hpp"

namespace tactus::firmware {
namespace {

struct Clip {
  std::string condition, file;
  std::uint64_t pictures_count = 0;
  std::array<std::size_t, contact::kOutcomesCount>
      outcomes{};  // of throws and shots, each by its first impact
  std::size_t throws_count = 0, shots_count = 0;
  std::uint64_t map_hash = 0;
  std::string trajectory;  // as trajectory.txt
  std::string labels;
  std::vector<Note> notes;
};

rt::Result<Clip> film(const StudyClipsOptions& options, std::string_view condition) {
  Clip clip;
  clip.condition = condition;
  clip.file = clip.condition + ".mp4";
  SessionRequest request;
  request.options = options.run;
  request.options.runner = "lockstep";
  request.options.collision = condition;
  request.draws = true;
  request.movie = options.run.out / clip.file;
  auto opened = Session::open(std::move(request));
  if (!opened) return opened.error();
  Session& session = **opened;
  if (auto made = make_study_folder(options.run.out); !made) return made.error();
  if (auto played = session.play(); !played) return played.error();
  // Relaxed: the flag carries no data, and the session is over.
  if (interrupted.load(std::memory_order_relaxed))
    return rt::Error{rt::ExitCode::failed, clip.file + " was interrupted before its end."};
  if (!session.has_film()) {
    std::string why;
    for (const Note& note : session.notes()) why += " " + note.text;
    return rt::Error{rt::ExitCode::device_unavailable, clip.file + " cannot be filmed here." + why};
  }
  if (!session.recorded()) return session.recorded().error();
  const Pipeline& pipeline = session.pipeline();
  clip.pictures_count = session.pictures_recorded();
  clip.map_hash = map_hash(pipeline.spine().map().hash_content());
  for (const TrackedPose& pose : pipeline.trajectory())
    clip.trajectory += trajectory_line({pose.time, pose.T_world_depth});
  const auto throws = follow_throws(pipeline.game().events()), shots = follow_shots(pipeline.game().events());
  clip.throws_count = throws.size();
  clip.shots_count = shots.size();
  for (const auto& orders : {throws, shots})
    for (const FollowedOrder& order : orders) ++clip.outcomes[static_cast<std::size_t>(order.outcome())];
  clip.labels = session.source().labels.name;
  clip.notes = session.notes();
  return clip;
}

/// FNV-1a.
std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

nlohmann::json json_of(const Clip& clip) {
  nlohmann::json outcomes = nlohmann::json::object();
  for (std::size_t i = 0; i < clip.outcomes.size(); ++i)
    outcomes[std::string(contact::kOutcomeNames[i])] = clip.outcomes[i];
  return {{"condition", clip.condition},
          {"file", clip.file},
          {"frames", clip.pictures_count},
          {"throws", clip.throws_count},
          {"shots", clip.shots_count},
          {"outcomes", outcomes},
          {"map_hash", hexadecimal(clip.map_hash)},
          {"trajectory_hash", hexadecimal(hash_of(clip.trajectory))}};
}

std::string row_of(const Clip& clip) {
  std::array<char, 80> counts{};
  std::snprintf(counts.data(), counts.size(), "  %-14s %6llu  %6zu  %5zu", clip.file.c_str(),
                static_cast<unsigned long long>(clip.pictures_count), clip.throws_count, clip.shots_count);
  std::string row = counts.data();
  for (const std::size_t count : clip.outcomes) {
    std::array<char, 32> column{};
    std::snprintf(column.data(), column.size(), "  %16zu", count);
    row += column.data();
  }
  return row + "\n";
}

}  // namespace

rt::Result<std::string> study_clips(const StudyClipsOptions& options) {
  std::vector<Clip> clips;
  for (const std::string_view condition : contact::kCollisionNames) {
    auto clip = film(options, condition);
    if (!clip) return clip.error();
    clips.push_back(std::move(*clip));
    const Clip &first = clips.front(), &last = clips.back();
    if (last.map_hash != first.map_hash || last.trajectory != first.trajectory ||
        last.throws_count != first.throws_count || last.shots_count != first.shots_count)
      return rt::Error{rt::ExitCode::failed, last.file + " differs from " + first.file +
                                                 " in more than its collisions; the clips do not compare."};
  }

  nlohmann::json json = {{"command", options.run.command},   {"source", options.run.source},
                         {"app", options.run.app},           {"labels", clips.front().labels},
                         {"clips", nlohmann::json::array()}, {"revision", revision()}};
  std::string text = "  clip           frames  throws  shots";
  for (const std::string_view name : contact::kOutcomeNames)
    text += "  " + std::string(16 - name.size(), ' ') + std::string(name);
  text += "\n";
  for (const Clip& clip : clips) {
    json["clips"].push_back(json_of(clip));
    text += row_of(clip);
  }
  text +=
      "Counted is the first impact of each throw or shot on something real. Camera path and map are the same "
      "in all three.\n";
  for (const Note& note : clips.front().notes) text += note.text + "\n";
  const std::string json_text = to_text(json);
  if (auto wrote = write_file(options.run.out / "clips.json", json_text); !wrote) return wrote.error();
  text += "The clips and clips.json are in " + options.run.out.string() +
          "; tactus study form makes a questionnaire of them.\n";
  return options.run.is_json ? json_text : text;
}

}  // namespace tactus::firmware
