// What a study runs on: the rooms that are always there and the recordings that may lie beside.
#pragma once

#include <string>
#include <vector>

#include "firmware_host/label_methods.hpp"
#include "firmware_host/options.hpp"

namespace tactus::firmware {

struct StudySet {
  std::string name;  // for people and files: letters, digits, _
  LabelStudyRequest request;
  bool has_exact_truth = true;  // else drawn by hand
};

struct StudySets {
  std::vector<StudySet> sets;
  std::vector<std::string> remarks;  // one sentence per set that is not there
};

/// The synthetic bedroom and office (13 and 12 frames spread over their trajectories, as many as the paper
/// labelled), then, where the data folder holds them, the rendered bedroom and the hand-labelled kitchen and
/// office. bad_input when --data names no folder. Boot.
rt::Result<StudySets> study_sets(const StudyOptions& options);

/// failed when it cannot be made.
rt::Result<void> make_study_folder(const std::filesystem::path& folder);

}  // namespace tactus::firmware
