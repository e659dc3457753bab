// intrinsics.txt, camera-intrinsics.txt, calibration.txt and calibration.toml: what is accepted can be a
// camera, and what we write of it reads back to the same bits.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hal/replay/intrinsics_file.hpp"
#include "rt/assert.hpp"

using namespace tactus;

namespace {

void check(const rt::Result<hal::RigCalibration>& result) {
  if (!result) {
    TACTUS_ASSERT(result.error().code == rt::ExitCode::bad_input && !result.error().message.empty());
    return;
  }
  const hal::RigCalibration& rig = result.value();
  TACTUS_ASSERT(hal::replay::fault_of(rig.depth).empty());
  if (rig.has_color) TACTUS_ASSERT(hal::replay::fault_of(rig.color).empty());
  const auto again =
      hal::replay::parse_calibration_toml(hal::replay::format_calibration_toml(rig), "calibration.toml");
  TACTUS_ASSERT(again.has_value());
  TACTUS_ASSERT(again.value().depth == rig.depth && again.value().depth_m_per_unit == rig.depth_m_per_unit);
  TACTUS_ASSERT(again.value().has_color == rig.has_color && again.value().registered == rig.registered);
  if (rig.has_color) {
    TACTUS_ASSERT(again.value().color == rig.color);
    TACTUS_ASSERT(again.value().T_color_depth.rotation.m == rig.T_color_depth.rotation.m);
    TACTUS_ASSERT(again.value().T_color_depth.translation == rig.T_color_depth.translation);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view text(reinterpret_cast<const char*>(data), bytes);
  check(hal::replay::parse_intrinsics(text, "intrinsics.txt"));
  check(hal::replay::parse_calibration_text(text, "calibration.txt"));
  check(hal::replay::parse_calibration_toml(text, "calibration.toml"));
  if (const auto camera = hal::replay::parse_camera_matrix(text, "camera-intrinsics.txt"))
    TACTUS_ASSERT(camera.value().width == 0);
  return 0;
}
