// What machine and what build a result comes from: a figure without them is not a figure.
#pragma once

#include <cstdint>
#include <string>

namespace tactus::firmware {

struct Machine {
  std::string cpu;      // model name, "unknown" where the system does not say
  int cores_count = 0;  // usable by this process
  std::uint64_t memory_bytes = 0;
  std::string kernel;  // "Linux 6.1.0 x86_64"
  std::string compiler;
  [[nodiscard]] std::string description() const;  // one line for people
};

/// Asks the system; never fails, says "unknown" instead. Boot or end.
Machine describe_machine();

/// Largest resident set of this process so far, bytes; 0 where the system does not say.
std::uint64_t resident_bytes_peak();

/// Version and git revision of the source, "-dirty" when it had changes; "unknown" when built without git.
const char* revision();

/// "2026-11-22 14:03 UTC".
std::string date_and_time_utc();

}  // namespace tactus::firmware
