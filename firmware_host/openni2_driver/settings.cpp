#include "firmware_host/openni2_driver/settings.hpp"

#include <cstdlib>

#include "hal/record/tac.hpp"
#include "hal/replay/replay.hpp"
#include "hal/synthetic/synthetic.hpp"

namespace tactus::openni2_driver {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

Settings read_settings() {
  Settings settings;
  settings.source = environment("TACTUS_OPENNI2_SOURCE");
  const double speed = std::atof(environment("TACTUS_OPENNI2_SPEED").c_str());
  if (speed > 0) settings.speed = speed;
  settings.has_loop = environment("TACTUS_OPENNI2_LOOP") != "0";
  return settings;
}

std::string unplug_file() { return environment("TACTUS_OPENNI2_UNPLUG"); }

rt::Result<hal::Sensor> open_source(const std::string& source) {
  if (source.starts_with("synthetic:")) {
    auto options = hal::parse_synthetic_name(source);
    if (!options) return options.error();
    return hal::open_synthetic(*options);
  }
  constexpr std::size_t kPrefetch = 2;
  if (source.ends_with(".tac")) {
    hal::record::TacReadOptions options;
    options.prefetch = kPrefetch;
    return hal::record::open_tac(source, options);
  }
  hal::ReplayOptions options;
  options.prefetch = kPrefetch;
  return hal::open_replay(source, options);
}

}  // namespace tactus::openni2_driver
