#include <cstdio>

#include "firmware_host/cli.hpp"
#include "firmware_host/run.hpp"

int main(int argc, char** argv) {
  tactus::firmware::PipelineCommands pipeline;
  pipeline.run = tactus::firmware::run;
  return tactus::firmware::run_command_line(argc, argv, pipeline, stdout, stderr);
}
