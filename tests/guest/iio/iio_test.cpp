// A real driver of the kernel, mma7660, on the registers of i2c-stub. Skips unless the modules are loaded:
// modprobe -a i2c-dev mma7660; modprobe i2c-stub chip_addr=0x4c
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "hal/iio/accelerometer.hpp"

namespace tactus::hal::iio {
namespace {

constexpr int kAddress = 0x4c;
constexpr double kStep_m_s2 = 0.467142857;  // of the chip's six bits

class GuestIio : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& adapter : std::filesystem::directory_iterator("/sys/bus/i2c/devices", error_)) {
      std::string name;
      std::getline(std::ifstream(adapter.path() / "name"), name);
      if (name.starts_with("SMBus stub driver")) adapter_ = adapter.path();
    }
    if (adapter_.empty()) GTEST_SKIP() << "i2c-stub is not loaded";
    bus_ = open(("/dev/" + adapter_.filename().string()).c_str(), O_RDWR | O_CLOEXEC);
    if (bus_ < 0) GTEST_SKIP() << "i2c-dev is not loaded";
    ASSERT_EQ(ioctl(bus_, I2C_SLAVE_FORCE, kAddress), 0);
    measure(0, 0, 21);
    std::ofstream(adapter_ / "new_device") << "mma7660 0x4c\n";
    for (int i = 0; i < 100 && find_accelerometers().devices.empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  void TearDown() override {
    if (bus_ >= 0) close(bus_);
    if (!adapter_.empty()) std::ofstream(adapter_ / "delete_device") << "0x4c\n";
  }
  void measure(int x, int y, int z) const {
    const int values[3] = {x, y, z};
    for (unsigned char axis = 0; axis < 3; ++axis) {
      i2c_smbus_data data{};
      data.byte = static_cast<unsigned char>(values[axis] & 0x3f);
      i2c_smbus_ioctl_data write{I2C_SMBUS_WRITE, axis, I2C_SMBUS_BYTE_DATA, &data};
      ASSERT_EQ(ioctl(bus_, I2C_SMBUS, &write), 0);
    }
  }

  std::error_code error_;
  std::filesystem::path adapter_;
  int bus_ = -1;
};

TEST_F(GuestIio, DevicesListTheAccelerometer) {
  const DeviceList list = find_accelerometers();
  ASSERT_EQ(list.devices.size(), 1U) << list.why_none;
  EXPECT_EQ(list.devices[0].name, "mma7660");
  EXPECT_EQ(list.devices[0].trouble, "");
  ASSERT_EQ(list.devices[0].formats.size(), 1U);
  std::printf("%s: %s\n", list.devices[0].source.c_str(), list.devices[0].formats[0].c_str());
}

TEST_F(GuestIio, GravityPointsAgainstWhatTheRestingChipMeasures) {
  const DeviceList list = find_accelerometers();
  ASSERT_EQ(list.devices.size(), 1U) << list.why_none;
  const int readings[][3] = {{0, 0, 21}, {0, -21, 0}, {12, 12, -12}, {-15, 0, 15}};
  for (const auto& reading : readings) {
    measure(reading[0], reading[1], reading[2]);
    const auto gravity = read_gravity(list.devices[0].source, {});
    ASSERT_TRUE(gravity) << gravity.error().message;
    ASSERT_TRUE(gravity->has_value());
    const Vec3d measured = Vec3d{double(reading[0]), double(reading[1]), double(reading[2])};
    ASSERT_NEAR(measured.norm() * kStep_m_s2, 9.81, 1);
    EXPECT_LT((**gravity + measured.normalized()).norm(), 1e-6);
  }
}

TEST_F(GuestIio, ChipThatFallsHasNoGravity) {
  const DeviceList list = find_accelerometers();
  ASSERT_EQ(list.devices.size(), 1U) << list.why_none;
  measure(0, 1, 2);
  const auto refused = read_gravity(list.devices[0].source, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("where gravity is 9.81"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace tactus::hal::iio
