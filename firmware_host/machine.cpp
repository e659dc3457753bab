#include "firmware_host/machine.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/sysinfo.h>
#include <sys/utsname.h>

#include <array>
#include <ctime>
#include <fstream>
#include <string_view>

namespace tactus::firmware {
namespace {

/// First value of one of `keys` in a file of "key : value" lines.
std::string value_of(const char* path, std::initializer_list<std::string_view> keys) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::string_view key =
        std::string_view(line).substr(0, line.find_last_not_of(" \t", colon - 1) + 1);
    for (const std::string_view wanted : keys) {
      if (key != wanted) continue;
      const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
      if (begin != std::string::npos) return line.substr(begin);
    }
  }
  return {};
}

}  // namespace

std::string Machine::description() const {
  const auto gib_tenths = static_cast<long long>(static_cast<double>(memory_bytes) / (1 << 30) * 10 + 0.5);
  return cpu + ", " + std::to_string(cores_count) + (cores_count == 1 ? " core, " : " cores, ") +
         std::to_string(gib_tenths / 10) + "." + std::to_string(gib_tenths % 10) + " GiB, " + kernel;
}

Machine describe_machine() {
  Machine machine;
  // x86 says "model name", arm64 boards "Model" or only implementer codes.
  machine.cpu = value_of("/proc/cpuinfo", {"model name", "Model", "Hardware"});
  if (machine.cpu.empty()) machine.cpu = "unknown CPU";
  cpu_set_t usable;
  CPU_ZERO(&usable);
  machine.cores_count = sched_getaffinity(0, sizeof(usable), &usable) == 0 ? CPU_COUNT(&usable) : 1;
  struct sysinfo info {};
  if (sysinfo(&info) == 0) machine.memory_bytes = static_cast<std::uint64_t>(info.totalram) * info.mem_unit;
  utsname name{};
  machine.kernel =
      uname(&name) == 0 ? std::string(name.sysname) + " " + name.release + " " + name.machine : "unknown";
#if defined(__clang__)
  machine.compiler = "clang " __clang_version__;
#else
  machine.compiler = "gcc " __VERSION__;
#endif
  return machine;
}

std::uint64_t resident_bytes_peak() {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::string date_and_time_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc);
  return {text.data(), length};
}

}  // namespace tactus::firmware
