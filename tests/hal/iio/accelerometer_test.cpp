#include "hal/iio/accelerometer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <random>
#include <string>
#include <thread>

#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::iio {
namespace {

/// A folder as the kernel's IIO core lays it out.
class Accelerometer {
 public:
  explicit Accelerometer(double scale = 0.01) : scale_(scale) {
    put("name", "kxcjk1013");
    put("in_accel_scale", std::to_string(scale));
  }
  void put(const std::string& attribute, const std::string& text) const {
    // Renamed into place: a reader sees the old or the new text, as in sysfs.
    sysfs_.write("new", text + "\n");
    std::filesystem::create_directories(folder());
    std::filesystem::rename(sysfs_.path() / "new", folder() / attribute);
  }
  void measure(const Vec3d& acceleration_m_s2) const {
    put("in_accel_x_raw", std::to_string(std::lround(acceleration_m_s2.x / scale_)));
    put("in_accel_y_raw", std::to_string(std::lround(acceleration_m_s2.y / scale_)));
    put("in_accel_z_raw", std::to_string(std::lround(acceleration_m_s2.z / scale_)));
  }
  [[nodiscard]] std::filesystem::path folder() const { return devices() / "iio:device0"; }
  [[nodiscard]] std::filesystem::path devices() const { return sysfs_.path() / "devices"; }

 private:
  test::TemporaryFolder sysfs_;
  double scale_;
};

rt::Result<std::optional<Vec3d>> read(const Accelerometer& sut, const Rotation& R_depth_accelerometer = {}) {
  rt::ManualClock clock;
  return read_gravity(sut.folder(), R_depth_accelerometer, rt::Clock::manual(clock));
}

void expect_near(const Vec3d& actual, const Vec3d& expected, double tolerance) {
  EXPECT_LT((actual - expected).norm(), tolerance) << actual.x << ' ' << actual.y << ' ' << actual.z;
}

void expect_refused(const Accelerometer& sut, const char* word) {
  const auto refused = read(sut);
  ASSERT_FALSE(refused) << word;
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
}

TEST(IioAccelerometer, RestingDeviceMeasuresMinusGravity) {
  Accelerometer sut;
  sut.measure({0, 9.81, 0});
  const auto gravity = read(sut);
  ASSERT_TRUE(gravity) << gravity.error().message;
  ASSERT_TRUE(gravity->has_value());
  expect_near(**gravity, {0, -1, 0}, 1e-9);
}

TEST(IioAccelerometer, RandomAttitudesAreFoundThroughMountAndRigRotation) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const auto rotation = [&] {
      return Rotation::from(Quaternion{normal(random), normal(random), normal(random), normal(random)}.normalized());
    };
    const Rotation R_mount = rotation(), R_rig = rotation();
    const Vec3d down_depth = Vec3d{normal(random), normal(random), normal(random)}.normalized();
    Accelerometer sut;
    std::string matrix;
    for (std::size_t i = 0; i < 9; ++i)
      matrix += (i == 0 ? "" : i % 3 == 0 ? "; " : ", ") + std::to_string(R_mount.m[i]);
    sut.put("in_mount_matrix", matrix);
    sut.measure(R_mount.transposed() * (R_rig.transposed() * (down_depth * -9.6)));
    const auto gravity = read(sut, R_rig);
    ASSERT_TRUE(gravity) << gravity.error().message;
    ASSERT_TRUE(gravity->has_value());
    expect_near(**gravity, down_depth, 0.001);
  }
}

TEST(IioAccelerometer, ScaleAndOffsetOfAnAxisGoBeforeTheSharedOnes) {
  Accelerometer sut;
  sut.put("in_accel_x_raw", "0");
  sut.put("in_accel_y_raw", "0");
  sut.put("in_accel_z_raw", "-19");
  sut.put("in_accel_z_scale", "0.5");
  sut.put("in_accel_z_offset", "-0.62");
  const auto gravity = read(sut);
  ASSERT_TRUE(gravity) << gravity.error().message;
  ASSERT_TRUE(gravity->has_value());
  expect_near(**gravity, {0, 0, 1}, 1e-9);
}

TEST(IioAccelerometer, ReadingTakesThirtySamplesInThreeTenthsOfASecond) {
  Accelerometer sut;
  sut.measure({0, 0, 9.81});
  rt::ManualClock clock;
  ASSERT_TRUE(read_gravity(sut.folder(), {}, rt::Clock::manual(clock)));
  EXPECT_EQ(clock.now().ns, 290'000'000);
}

TEST(IioAccelerometer, FolderWithoutAccelerometerHasNoGravity) {
  const test::TemporaryFolder folder;
  folder.write("in_illuminance_raw", "7\n");
  const auto gravity = read_gravity(folder.path(), {});
  ASSERT_TRUE(gravity) << gravity.error().message;
  EXPECT_FALSE(gravity->has_value());
}

TEST(IioAccelerometer, MagnitudeFarFromGravityIsRefused) {
  Accelerometer sut;
  for (const double magnitude : {0.0, 1.0, 8.7, 10.9, 20.0}) {
    sut.measure({0, 0, magnitude});
    expect_refused(sut, "where gravity is 9.81");
  }
  for (const double magnitude : {8.9, 10.7}) {
    sut.measure({0, 0, magnitude});
    EXPECT_TRUE(read(sut)) << magnitude;
  }
}

TEST(IioAccelerometer, MovingDeviceIsRefused) {
  const Accelerometer sut;
  sut.measure({0, 0, 9.81});
  std::atomic<bool> is_over{false};
  std::thread shaking([&] {
    for (int i = 0; !is_over; ++i) {
      sut.put("in_accel_x_raw", i % 2 == 0 ? "150" : "-150");
      usleep(3000);
    }
  });
  const auto refused = read_gravity(sut.folder(), {});
  is_over = true;
  shaking.join();
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("the device moves"), std::string::npos) << refused.error().message;
}

TEST(IioAccelerometer, WhatIsNotAsTheKernelWritesItIsRefused) {
  Accelerometer sut;
  sut.put("in_accel_x_raw", "12");
  expect_refused(sut, "in_accel_y_raw");
  sut.measure({0, 0, 9.81});
  for (const char* matrix : {"", "1, 0, 0", "1, 0, 0; 0, 1, 0; 0, 0, 1; 0", "2, 0, 0; 0, 1, 0; 0, 0, 1",
                             "1, 0, 0; 0, 1, 0; 0, 0, x", "nan, 0, 0; 0, 1, 0; 0, 0, 1"}) {
    sut.put("in_accel_mount_matrix", matrix);
    expect_refused(sut, "is not a rotation");
  }
  std::filesystem::remove(sut.folder() / "in_accel_mount_matrix");
  sut.put("in_accel_z_raw", "12 13");
  expect_refused(sut, "is not a number");
  sut.put("in_accel_z_raw", "");
  expect_refused(sut, "is not a number");
  sut.measure({0, 0, 9.81});
  sut.put("in_accel_scale", "0");
  expect_refused(sut, "units are unknown");
}

TEST(IioAccelerometer, UnreadableAttributeIsRefusedWithItsReason) {
  Accelerometer sut;
  sut.measure({0, 0, 9.81});
  std::filesystem::remove(sut.folder() / "in_accel_z_raw");
  std::filesystem::create_directory(sut.folder() / "in_accel_z_raw");
  expect_refused(sut, "cannot be read");
}

TEST(IioAccelerometer, DevicesListAccelerometersAlone) {
  Accelerometer sut;
  sut.measure({0, 0, 9.81});
  sut.put("label", "accel-display");
  std::filesystem::create_directories(sut.devices() / "iio:device1");
  const DeviceList list = find_accelerometers(sut.devices());
  EXPECT_EQ(list.backend, "IIO");
  ASSERT_EQ(list.devices.size(), 1U);
  EXPECT_EQ(list.devices[0].source, sut.folder().string());
  EXPECT_EQ(list.devices[0].name, "kxcjk1013 (accel-display)");
  EXPECT_EQ(list.devices[0].formats, std::vector<std::string>{"acceleration, 3 axes in steps of 0.01 m/s^2"});
  EXPECT_EQ(list.devices[0].trouble, "");
  std::filesystem::remove(sut.folder() / "in_accel_y_raw");
  EXPECT_NE(find_accelerometers(sut.devices()).devices.at(0).trouble.find("in_accel_y_raw"), std::string::npos);
}

TEST(IioAccelerometer, WithoutDevicesTheSentenceSaysWhy) {
  const test::TemporaryFolder empty;
  EXPECT_NE(find_accelerometers(empty.path() / "nowhere").why_none.find("empty or absent"), std::string::npos);
  std::filesystem::create_directory(empty.path() / "iio:device0");
  EXPECT_NE(find_accelerometers(empty.path()).why_none.find("is an accelerometer"), std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::iio
