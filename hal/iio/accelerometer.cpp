#include "hal/iio/accelerometer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <system_error>
#include <vector>

#include "hal/iio/sysfs.hpp"

namespace tactus::hal::iio {
namespace {

using rt::operator""_ms;

constexpr int kSamplesCount = 30;
constexpr rt::Duration kBetweenSamples = 10_ms;
constexpr double kGravity_m_s2 = 9.81;
constexpr double kMagnitudeTolerance_m_s2 = 1;  // drift and bias of cheap sensors, not a device that is carried about
constexpr double kRestTolerance_m_s2 = 0.5;     // noise of cheap sensors; sideways it is 3 degrees
constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};

rt::Error refuse(const std::filesystem::path& folder, const std::string& why) {
  return {rt::ExitCode::device_unavailable, folder.string() + ": " + why + "."};
}

std::string with_digits(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

bool has_accelerometer(const std::filesystem::path& folder) {
  std::error_code error;
  return std::filesystem::exists(folder / "in_accel_x_raw", error);
}

/// A driver gives an attribute to each axis, or one to all three.
rt::Result<std::optional<double>> attribute(const std::filesystem::path& folder, const std::string& axis, const char* name) {
  const auto own = read_number_if_any(folder / ("in_accel_" + axis + "_" + name));
  if (!own || *own) return own;
  return read_number_if_any(folder / (std::string("in_accel_") + name));
}

/// acceleration = (raw + offset) * scale, in m/s^2.
struct Axis {
  std::filesystem::path raw;
  double offset = 0, scale = 0;
};

rt::Result<std::array<Axis, 3>> read_axes(const std::filesystem::path& folder) {
  std::array<Axis, 3> axes;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i].raw = folder / (std::string("in_accel_") + kAxes[i] + "_raw");
    const auto scale = attribute(folder, kAxes[i], "scale"), offset = attribute(folder, kAxes[i], "offset");
    if (!scale) return scale.error();
    if (!offset) return offset.error();
    if (!*scale || **scale == 0) return refuse(folder, "has no in_accel_scale, so that its units are unknown");
    axes[i].scale = **scale;
    axes[i].offset = offset->value_or(0);
  }
  return axes;
}

rt::Result<Vec3d> sample(const std::array<Axis, 3>& axes) {
  std::array<double, 3> v{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto raw = read_number(axes[i].raw);
    if (!raw) return raw.error();
    v[i] = (*raw + axes[i].offset) * axes[i].scale;
  }
  return Vec3d{v[0], v[1], v[2]};
}

/// "1, 0, 0; 0, 1, 0; 0, 0, 1": what the driver knows of how the chip is built in. None: it is built in straight.
rt::Result<Rotation> read_mount_matrix(const std::filesystem::path& folder) {
  for (const char* name : {"in_accel_mount_matrix", "in_mount_matrix", "mount_matrix"}) {
    std::error_code none;
    const std::filesystem::path file = folder / name;
    if (!std::filesystem::exists(file, none)) continue;
    const auto text = read_text(file);
    if (!text) return text.error();
    const auto bad = refuse(file, "\"" + *text + "\" is not a rotation such as \"1, 0, 0; 0, 1, 0; 0, 0, 1\"");
    Rotation matrix;
    std::size_t count = 0;
    std::string word;
    for (const char c : *text + ";") {
      if (c == ' ') continue;
      if (c != ',' && c != ';') {
        word += c;
        continue;
      }
      const auto number = parse_number(word);
      if (!number || count == matrix.m.size()) return bad;
      matrix.m[count++] = *number;
      word.clear();
    }
    if (count != matrix.m.size()) return bad;
    const Rotation product = matrix * matrix.transposed();
    for (int i = 0; i < 9; ++i)
      if (!(std::abs(product(i / 3, i % 3) - (i % 4 == 0 ? 1 : 0)) < 0.01)) return bad;
    return matrix;
  }
  return Rotation{};
}

}  // namespace

rt::Result<std::optional<Vec3d>> read_gravity(const std::filesystem::path& folder, const Rotation& R_depth_accelerometer,
                                              rt::Clock clock) {
  if (!has_accelerometer(folder)) return std::optional<Vec3d>();
  const auto axes = read_axes(folder);
  if (!axes) return axes.error();
  const auto mount = read_mount_matrix(folder);
  if (!mount) return mount.error();

  std::vector<Vec3d> samples;
  Vec3d sum;
  const rt::HostTime start = clock.now();
  for (int i = 0; i < kSamplesCount; ++i) {
    clock.sleep_until(start + rt::Duration{kBetweenSamples.ns * i});
    const auto measured = sample(*axes);
    if (!measured) return measured.error();
    samples.push_back(*measured);
    sum += *measured;
  }
  const Vec3d mean = sum * (1.0 / kSamplesCount);
  double deviation = 0;
  for (const Vec3d& each : samples) deviation = std::max(deviation, (each - mean).norm());
  if (!(deviation <= kRestTolerance_m_s2))
    return refuse(folder, "the device moves, its acceleration changes by " + with_digits(deviation) +
                              " m/s^2 within 0.3 s; hold it still, or give the direction of gravity by hand");
  if (!(std::abs(mean.norm() - kGravity_m_s2) <= kMagnitudeTolerance_m_s2))
    return refuse(folder, "measures " + with_digits(mean.norm()) +
                              " m/s^2 where gravity is 9.81; hold it still, or give the direction of gravity by hand");
  return std::optional<Vec3d>((-(R_depth_accelerometer * (*mount * mean))).normalized());
}

DeviceList find_accelerometers(const std::filesystem::path& devices) {
  DeviceList list{"IIO", {}, {}};
  std::vector<std::filesystem::path> folders;
  std::error_code error;
  for (std::filesystem::directory_iterator it(devices, error), end; !error && it != end; it.increment(error))
    folders.push_back(it->path());
  std::sort(folders.begin(), folders.end());
  for (const std::filesystem::path& folder : folders) {
    if (!has_accelerometer(folder)) continue;
    DeviceEntry entry{folder.string(), "accelerometer", {}, {}};
    if (const auto name = read_text(folder / "name")) entry.name = *name;
    if (const auto label = read_text(folder / "label")) entry.name += " (" + *label + ")";
    const auto axes = read_axes(folder);
    if (!axes) {
      entry.trouble = axes.error().message;
    } else if (const auto first = sample(*axes); !first) {
      entry.trouble = first.error().message;
    } else {
      entry.formats.push_back("acceleration, 3 axes in steps of " + with_digits(std::abs((*axes)[0].scale)) + " m/s^2");
    }
    list.devices.push_back(std::move(entry));
  }
  if (!list.devices.empty()) return list;
  if (folders.empty())
    list.why_none = devices.string() +
                    " is empty or absent: this machine has no sensors of the kernel's Industrial I/O, or no driver for them.";
  else
    list.why_none = "None of the sensors in " + devices.string() + " is an accelerometer.";
  return list;
}

}  // namespace tactus::hal::iio
