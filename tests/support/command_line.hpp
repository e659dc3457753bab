// The program called as its user calls it, with both of its outputs caught.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "firmware_host/cli.hpp"

namespace tactus::test {

struct Outcome {
  int code = 0;
  std::string out, err;
};

/// `tactus WORDS...`.
inline Outcome call_tactus(const std::vector<std::string>& words, const firmware::PipelineCommands& commands = {}) {
  std::vector<const char*> argv = {"tactus"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  char *out = nullptr, *err = nullptr;
  std::size_t out_size = 0, err_size = 0;
  std::FILE* out_file = open_memstream(&out, &out_size);
  std::FILE* err_file = open_memstream(&err, &err_size);
  Outcome outcome;
  outcome.code =
      firmware::run_command_line(static_cast<int>(argv.size()), argv.data(), commands, out_file, err_file);
  std::fclose(out_file);
  std::fclose(err_file);
  outcome.out.assign(out, out_size);
  outcome.err.assign(err, err_size);
  std::free(out);
  std::free(err);
  return outcome;
}

}  // namespace tactus::test
