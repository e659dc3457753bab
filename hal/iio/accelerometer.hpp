// Which way is down, from an accelerometer that the kernel shows through its Industrial I/O subsystem: text files in sysfs.
#pragma once

#include <filesystem>
#include <optional>

#include "hal/device_list.hpp"
#include "hal/transform.hpp"
#include "rt/clock.hpp"
#include "rt/status.hpp"

namespace tactus::hal::iio {

/// Direction of gravity (down, unit) in the depth frame: the mean of 30 samples within 0.3 s of a device that rests, whose
/// accelerometer then measures minus gravity. `folder`: such as /sys/bus/iio/devices/iio:device0. `R_depth_accelerometer`
/// turns the accelerometer's axes, after the driver's mount matrix where it has one, into those of the depth camera.
/// Nothing: the folder holds no accelerometer. device_unavailable: it cannot be read, is not what it should be, moves (a
/// sample is more than 0.5 m/s^2, 3 degrees, from the mean), or measures something else than 9.81 +- 1 m/s^2. Boot; waits
/// 0.3 s of `clock`.
rt::Result<std::optional<Vec3d>> read_gravity(const std::filesystem::path& folder, const Rotation& R_depth_accelerometer,
                                              rt::Clock clock = rt::Clock::monotonic());

/// What `tactus devices` shows; DeviceEntry::source is the folder to read. Boot.
DeviceList find_accelerometers(const std::filesystem::path& devices = "/sys/bus/iio/devices");

}  // namespace tactus::hal::iio
