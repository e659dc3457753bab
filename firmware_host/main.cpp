#include <cstdio>

#include "firmware_host/bench.hpp"
#include "firmware_host/cli.hpp"
#include "firmware_host/devices.hpp"
#include "firmware_host/label_command.hpp"
#include "firmware_host/plan.hpp"
#include "firmware_host/query.hpp"
#include "firmware_host/record.hpp"
#include "firmware_host/run.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/wiring.hpp"

int main(int argc, char** argv) {
  tactus::firmware::PipelineCommands pipeline;
  pipeline.run = tactus::firmware::run;
  pipeline.eval_labels = tactus::firmware::eval_labels;
  pipeline.study_accuracy = tactus::firmware::study_accuracy;
  pipeline.study_errors = tactus::firmware::study_errors;
  pipeline.study_keyframes = tactus::firmware::study_keyframes;
  pipeline.study_stats = tactus::firmware::study_stats;
  pipeline.study_form = tactus::firmware::study_form;
  pipeline.study_clips = tactus::firmware::study_clips;
  pipeline.study_plausibility = tactus::firmware::study_plausibility;
  pipeline.record = tactus::firmware::record;
  pipeline.devices = tactus::firmware::devices;
  pipeline.query = tactus::firmware::query;
  pipeline.plan = tactus::firmware::plan;
  pipeline.wiring = tactus::firmware::wiring;
  pipeline.bench = tactus::firmware::bench;
  return tactus::firmware::run_command_line(argc, argv, pipeline, stdout, stderr);
}
