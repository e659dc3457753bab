#include "hal/synthetic/synthetic.hpp"
#include "tests/conformance/camera_suite.hpp"

namespace tactus::hal::conformance {
namespace {

CameraCase synthetic(const char* name, const char* source, std::uint64_t frames) {
  return {name,
          [source]() -> rt::Result<Sensor> {
            auto options = parse_synthetic_name(source);
            if (!options) return options.error();
            return open_synthetic(*options);
          },
          frames, frames};
}

INSTANTIATE_TEST_SUITE_P(
    Synthetic, CameraConformance,
    testing::Values(synthetic("bedroom", "synthetic:bedroom?frames=3&mode=320x240", 3),
                    synthetic("office_two_cameras", "synthetic:office?frames=3&mode=320x240&registered=0", 3),
                    synthetic("bedroom_blank_and_jump",
                              "synthetic:bedroom?frames=4&mode=320x240&blank=1:1&jump=1", 4)),
    case_name);

}  // namespace
}  // namespace tactus::hal::conformance
