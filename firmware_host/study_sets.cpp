#include "firmware_host/study_sets.hpp"

#include <algorithm>
#include <cstdlib>

#include "firmware_host/label_crf.hpp"

namespace tactus::firmware {
namespace {

namespace fs = std::filesystem;

constexpr int kBedroomViews = 13, kOfficeViews = 12;  // the paper's 25 key-frames of two scenes

fs::path data_folder(const StudyOptions& options) {
  std::error_code error;
  if (!options.data.empty()) return options.data;
  if (const char* named = std::getenv("TACTUS_SHARED_DATA"); named != nullptr) return named;
  for (const char* beside : {"shared/data", "../shared/data"})
    if (fs::is_directory(beside, error)) return beside;
  return {};
}

StudySet synthetic(const StudyOptions& options, const RunSettings& settings, const std::string& room,
                   int views_count) {
  StudySet set;
  set.name = "synthetic_" + room;
  set.request.session.source =
      "synthetic:" + room + "?frames=" + std::to_string(options.frames_count) + "&mode=" + options.mode;
  set.request.session.model = options.model;
  set.request.settings = settings;
  // Spread evenly, from the first frame on.
  set.request.every = static_cast<std::uint64_t>(std::max(1, options.frames_count / views_count));
  set.request.views_max = static_cast<std::uint64_t>(views_count);
  return set;
}

}  // namespace

rt::Result<StudySets> study_sets(const StudyOptions& options) {
  auto settings = read_settings(options.profile, options.settings);
  if (!settings) return settings.error();
  if (settings->label_source == LabelSource::automatic) settings->label_source = LabelSource::network;
  const auto crf = crf_parameters(options.crf);
  if (!crf) return crf.error();
  StudySets sets;
  for (const std::string& room : options.rooms) {
    if (room == "none") continue;
    const int usual_count = room == "bedroom" ? kBedroomViews : kOfficeViews;
    sets.sets.push_back(
        synthetic(options, *settings, room, options.views_count > 0 ? options.views_count : usual_count));
  }

  std::error_code error;
  const fs::path data = data_folder(options);
  if (!options.data.empty() && !fs::is_directory(options.data, error))
    return rt::Error{rt::ExitCode::bad_input,
                     options.data.string() + ": there is no such folder of recordings."};
  const struct {
    const char *name, *source, *truth;
    bool has_exact_truth;
  } beside[] = {{"bedroom_rendered", "bedroom_rendered", "bedroom_rendered/label", true},
                {"kitchen_by_hand", "kitchen_7scenes", "hand_labels/kitchen", false},
                {"office_by_hand", "tum_fr1_rpy", "hand_labels/office", false}};
  for (const auto& one : beside) {
    if (data.empty() || !fs::is_directory(data / one.source, error) ||
        !fs::is_directory(data / one.truth, error)) {
      sets.remarks.push_back(std::string(one.name) + " was left out: there is no " + one.source + " with " +
                             one.truth + " in " +
                             (data.empty() ? "a data folder (--data DIR)" : data.string()) + ".");
      continue;
    }
    StudySet set;
    set.name = one.name;
    set.request.session.source = (data / one.source).string();
    set.request.session.model = options.model;
    set.request.settings = *settings;
    set.request.truth = data / one.truth;
    set.has_exact_truth = one.has_exact_truth;
    sets.sets.push_back(std::move(set));
  }
  if (sets.sets.empty())
    return rt::Error{rt::ExitCode::bad_usage,
                     "There is nothing to study: no room was asked for and no recording found; "
                     "name a folder of recordings with --data DIR."};
  for (StudySet& set : sets.sets) set.request.crf = *crf;
  return sets;
}

rt::Result<void> make_study_folder(const std::filesystem::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return rt::Error{rt::ExitCode::failed,
                     folder.string() + ": the folder cannot be made: " + error.message() + "."};
  return {};
}

}  // namespace tactus::firmware
