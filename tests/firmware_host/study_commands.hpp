// `tactus study` as the program has it.
#pragma once

#include <string>
#include <vector>

#include "firmware_host/study.hpp"
#include "tests/support/command_line.hpp"

namespace tactus::test {

/// `tactus study WORDS...`.
inline Outcome call_study(std::vector<std::string> words) {
  firmware::PipelineCommands commands;
  commands.study_accuracy = firmware::study_accuracy;
  commands.study_errors = firmware::study_errors;
  commands.study_keyframes = firmware::study_keyframes;
  commands.study_stats = firmware::study_stats;
  commands.study_form = firmware::study_form;
  commands.study_clips = firmware::study_clips;
  commands.study_plausibility = firmware::study_plausibility;
  words.insert(words.begin(), "study");
  return call_tactus(words, commands);
}

}  // namespace tactus::test
