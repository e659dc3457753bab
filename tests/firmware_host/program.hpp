// The program itself as a process of its own, as its user starts it.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::test {

struct ProgramSetup {
  std::vector<std::pair<std::string, std::string>> environment;  // on top of this process's
  std::vector<std::string> without;                              // variables that are taken away
  std::uint64_t file_bytes_max = 0;                              // of any one file it writes; 0: no limit
};

class Program {
 public:
  /// Starts `tactus WORDS...`; it dies with this process.
  explicit Program(const std::vector<std::string>& words, const ProgramSetup& setup = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void send(int signal) const;
  /// Until it ends, a minute at most; then it is killed and the code is -1. A death by a signal is 128 + its number.
  Outcome wait();

 private:
  TemporaryFolder folder_;  // of what it prints
  pid_t process_ = -1;
};

/// Runs it to its end.
Outcome run_tactus(const std::vector<std::string>& words, const ProgramSetup& setup = {});

nlohmann::json summary_of(const std::filesystem::path& folder);
std::vector<nlohmann::json> events_of(const std::filesystem::path& folder);
/// Events of those kinds.
std::vector<nlohmann::json> events_of(const std::filesystem::path& folder, const std::vector<std::string>& kinds);

/// Whether a note or warning of the summary holds these words.
bool is_noted(const nlohmann::json& summary, const std::string& words);

}  // namespace tactus::test
