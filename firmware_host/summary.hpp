// summary.json: the figures of a run for other programs (README, output files).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "firmware_host/run_result.hpp"

namespace tactus::firmware {

/// Key names are a contract. Hashes are 16 hexadecimal digits in a string, since JSON numbers hold 53 bits;
/// figures that are unknown (no truth) are left out.
nlohmann::json summary_json(const RunResult& result);

/// 16 digits.
std::string hexadecimal(std::uint64_t value);

/// Indented, ends with a line feed; bytes that are not UTF-8 become U+FFFD.
std::string to_text(const nlohmann::json& json);

rt::Result<void> write_summary(const std::filesystem::path& file, const RunResult& result);

/// One event per line.
rt::Result<void> write_events(const std::filesystem::path& file, std::span<const RunEvent> events);

/// One line of events.jsonl, without the line feed; for writers that append while running.
std::string event_line(const RunEvent& event);

/// One line of trajectory.txt, with the line feed: `time tx ty tz qx qy qz qw`, the time exact to the
/// nanosecond, the rest with the 17 digits that give back the same bits.
std::string trajectory_line(const evaluate::StampedPose& pose);

rt::Result<void> write_trajectory(const std::filesystem::path& file,
                                  std::span<const evaluate::StampedPose> poses);

}  // namespace tactus::firmware
