// The sections of report.html, in the order of the page. Each is empty when it has nothing to say.
#pragma once

#include <string>

#include "firmware_host/run_result.hpp"

namespace tactus::firmware {

std::string headline_section(const RunResult& result);  // what ran, the figures first
std::string notes_section(const RunResult& result);     // warnings before notes
rt::Result<std::string> pictures_section(const RunResult& result);
std::string trajectory_section(const RunResult& result);  // from above, from the side, error over time
std::string latency_section(const RunResult& result);     // frame over time, stages against their budgets
std::string memory_section(const RunResult& result);      // planned and used, row by row
std::string sensor_section(const RunResult& result);      // what became of each frame, which colour it got
std::string labels_section(const RunResult& result);      // materials by share of the surface
std::string game_section(const RunResult& result);        // film, counters, outcomes by material
std::string events_section(const RunResult& result);      // contacts, breaks, losses
std::string provenance_section(const RunResult& result);  // machine, date, command, revision, hashes

}  // namespace tactus::firmware
