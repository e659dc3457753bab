// A run as the runner would report it, with every field filled: 300 hand-held frames in a room, one loss,
// bounces.
#pragma once

#include "firmware_host/run_result.hpp"

namespace tactus::firmware::test {

RunResult sample_run();

}  // namespace tactus::firmware::test
