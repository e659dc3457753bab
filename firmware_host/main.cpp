#include <cstdio>

#include "firmware_host/cli.hpp"

int main(int argc, char** argv) {
  tactus::firmware::PipelineCommands pipeline;
  return tactus::firmware::run_command_line(argc, argv, pipeline, stdout, stderr);
}
