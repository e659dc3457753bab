#include "firmware_host/plan.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/open_source.hpp"
#include "firmware_host/plan_whole.hpp"
#include "firmware_host/run_settings.hpp"
#include "firmware_host/summary.hpp"
#include "hal/synthetic/options.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;

std::string mebibytes(std::size_t bytes) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f MiB", static_cast<double>(bytes) / (1 << 20));
  return text;
}

json json_of(const WholePlan& whole, const Profile& profile, const std::string& profile_name) {
  json rows = json::array();
  for (const rt::MemoryRow& row : whole.plan.rows()) {
    json holders = json::array();
    for (const rt::Holder& holder : row.holders)
      holders.push_back({{"name", holder.name}, {"count", holder.count}});
    rows.push_back({{"name", row.name},
                    {"holders", holders},
                    {"count", row.count()},
                    {"bytes_each", row.bytes_each},
                    {"bytes", row.bytes()},
                    {"owner", row.owner},
                    {"why", row.why},
                    {"outside_arena", row.is_outside_arena}});
  }
  return {{"profile", profile_name},
          {"rows", rows},
          {"total_bytes", whole.plan.total_bytes()},
          {"without_network_bytes", whole.without_network_bytes()},
          {"network_bytes", whole.network_bytes},
          {"limit_bytes", profile.memory_bytes_max},
          {"map_bytes_per_voxel", map::Map::bytes_per_voxel(profile.spine.map)}};
}

}  // namespace

rt::Result<std::string> plan(const PlanOptions& options) {
  const auto settings = read_settings(options.profile, options.settings);
  if (!settings) return settings.error();
  const Profile& profile = settings->profile;
  hal::synthetic::SyntheticOptions usual;
  if (profile.sensor_mode.width == 960 && profile.sensor_mode.height == 540)
    usual.mode = hal::synthetic::Mode::wide_960x540;
  hal::RigCalibration rig = hal::synthetic::calibration_of(usual);
  std::size_t camera_buffers_bytes = 0;
  if (!options.source.empty()) {
    SourceOptions source;
    source.live = {profile.sensor_mode, profile.needs_registered};
    const auto sensor = open_source(options.source, source);
    if (!sensor) return sensor.error();
    rig = sensor->calibration;
    camera_buffers_bytes = sensor->buffers_bytes;
  }
  const WholePlan whole = plan_whole_program(profile, rig, camera_buffers_bytes);
  if (whole.without_network_bytes() > profile.memory_bytes_max)
    return rt::Error{rt::ExitCode::budget_exceeded,
                     "the plan needs " + mebibytes(whole.without_network_bytes()) +
                         " without the network and profile " + settings->profile_name + " allows " +
                         mebibytes(profile.memory_bytes_max) +
                         "; lower map.blocks_capacity or raise memory.max_mib."};
  if (options.is_json) return to_text(json_of(whole, profile, settings->profile_name));
  std::string text(whole.plan.print({}) + 1, '\0');
  whole.plan.print(text);
  text.pop_back();
  const std::string size = std::to_string(rig.depth.width) + "x" + std::to_string(rig.depth.height);
  text += "\nProfile " + settings->profile_name + " at " + size + ": " +
          mebibytes(whole.without_network_bytes()) + " without the network, of " +
          mebibytes(profile.memory_bytes_max) + " allowed; " + mebibytes(whole.plan.total_bytes()) +
          " with it.\n";
  return text;
}

}  // namespace tactus::firmware
