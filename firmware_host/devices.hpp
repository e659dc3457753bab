// `tactus devices`: what each backend sees, or why it sees nothing.
#pragma once

#include <span>
#include <string>

#include "firmware_host/options.hpp"
#include "hal/device_list.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Never fails: a backend that is not there is part of the answer. Boot.
rt::Result<std::string> devices(const DevicesOptions& options);

/// The lists as text or JSON. Pure.
std::string devices_text(std::span<const hal::DeviceList> lists);
std::string devices_json(std::span<const hal::DeviceList> lists);

}  // namespace tactus::firmware
