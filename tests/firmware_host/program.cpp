#include "tests/firmware_host/program.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace tactus::test {

Program::Program(const std::vector<std::string>& words, const ProgramSetup& setup) {
  std::vector<const char*> argv = {TACTUS_PROGRAM};
  for (const std::string& word : words) argv.push_back(word.c_str());
  argv.push_back(nullptr);
  const std::string out = (folder_.path() / "out").string(), err = (folder_.path() / "err").string();
  process_ = fork();
  if (process_ != 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const auto& [name, value] : setup.environment) setenv(name.c_str(), value.c_str(), 1);
  for (const std::string& name : setup.without) unsetenv(name.c_str());
  dup2(open(out.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
  dup2(open(err.c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
  if (setup.file_bytes_max > 0) {
    const rlimit limit{setup.file_bytes_max, setup.file_bytes_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  execv(TACTUS_PROGRAM, const_cast<char* const*>(argv.data()));
  _exit(127);
}

Program::~Program() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

void Program::send(int signal) const { kill(process_, signal); }

Outcome Program::wait() {
  int status = 0;
  pid_t ended = 0;
  for (int i = 0; i < 6000 && (ended = waitpid(process_, &status, WNOHANG)) == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  Outcome outcome;
  outcome.code = -1;
  if (ended == process_) {
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    process_ = -1;
  }
  outcome.out = folder_.read("out");
  outcome.err = folder_.read("err");
  return outcome;
}

Outcome run_tactus(const std::vector<std::string>& words, const ProgramSetup& setup) {
  return Program(words, setup).wait();
}

nlohmann::json summary_of(const std::filesystem::path& folder) {
  std::ifstream file(folder / "summary.json");
  return nlohmann::json::parse(file, nullptr, false);
}

std::vector<nlohmann::json> events_of(const std::filesystem::path& folder) {
  std::ifstream file(folder / "events.jsonl");
  std::vector<nlohmann::json> events;
  for (std::string line; std::getline(file, line);) events.push_back(nlohmann::json::parse(line));
  return events;
}

std::vector<nlohmann::json> events_of(const std::filesystem::path& folder, const std::vector<std::string>& kinds) {
  std::vector<nlohmann::json> events = events_of(folder);
  std::erase_if(events, [&](const nlohmann::json& event) {
    return std::find(kinds.begin(), kinds.end(), event["kind"].get<std::string>()) == kinds.end();
  });
  return events;
}

bool is_noted(const nlohmann::json& summary, const std::string& words) {
  for (const nlohmann::json& note : summary["notes"])
    if (note["text"].get<std::string>().find(words) != std::string::npos) return true;
  return false;
}

}  // namespace tactus::test
