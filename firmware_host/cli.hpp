// The command line: words in, exit code out.
#pragma once

#include <cstdio>
#include <functional>
#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Commands that need the pipeline, handed in by main(): each answers the text for standard output or a
/// sentence. One that is empty is left out of the program and its help.
struct PipelineCommands {
  std::function<rt::Result<std::string>(const RunOptions&)> run;
  std::function<rt::Result<std::string>(const EvalLabelsOptions&)> eval_labels;
  /// All four or none.
  std::function<rt::Result<std::string>(const StudyOptions&)> study_accuracy, study_errors, study_keyframes;
  std::function<rt::Result<std::string>(const StudyStatsOptions&)> study_stats;
  std::function<rt::Result<std::string>(const StudyFormOptions&)> study_form;
  std::function<rt::Result<std::string>(const StudyClipsOptions&)> study_clips;
  std::function<rt::Result<std::string>(const StudyPlausibilityOptions&)> study_plausibility;
  std::function<rt::Result<std::string>(const RecordOptions&)> record;
  std::function<rt::Result<std::string>(const DevicesOptions&)> devices;
  std::function<rt::Result<std::string>(const QueryOptions&)> query;
  std::function<rt::Result<std::string>(const PlanOptions&)> plan;
  std::function<rt::Result<std::string>(const WiringOptions&)> wiring;
  std::function<rt::Result<std::string>(const BenchOptions&)> bench;
};

/// Parses, runs the command, prints its text to `out` and a failure's sentence to `err`. Answers the exit
/// code of the README's table. Catches what third parties throw.
int run_command_line(int argc, const char* const* argv, const PipelineCommands& pipeline, std::FILE* out,
                     std::FILE* err);

}  // namespace tactus::firmware
