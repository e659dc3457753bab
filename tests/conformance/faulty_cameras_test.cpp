#include "hal/faults/faults.hpp"
#include "hal/replay/replay.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "tests/conformance/camera_suite.hpp"
#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::conformance {
namespace {

using faults::Fault;
using faults::FaultKind;
using faults::FaultPlan;

Fault fault(FaultKind kind, std::uint64_t first, std::uint64_t count) {
  Fault made;
  made.kind = kind;
  made.first = first;
  made.count = count;
  made.delay = {1'000'000};
  return made;
}

std::function<rt::Result<Sensor>()> bedroom(const FaultPlan& plan, std::optional<rt::Clock> clock = {}) {
  return [plan, clock]() -> rt::Result<Sensor> {
    auto options = parse_synthetic_name("synthetic:bedroom?frames=5&mode=320x240");
    if (!options) return options.error();
    auto sensor = open_synthetic(*options);
    if (sensor) (void)faults::inject(plan, *sensor, clock);
    return sensor;
  };
}

std::function<rt::Result<Sensor>()> recording(const FaultPlan& plan, std::size_t prefetch) {
  return [plan, prefetch]() -> rt::Result<Sensor> {
    static const replay::RecordingFolder folder(9);
    ReplayOptions options;
    options.prefetch = prefetch;
    auto sensor = open_replay(folder.path(), options);
    if (sensor) (void)faults::inject(plan, *sensor);
    return sensor;
  };
}

CameraCase losing(CameraCase one) {
  one.loses_after_tap = true;
  return one;
}

const FaultPlan kNone;
const FaultPlan kDrops{1, {fault(FaultKind::drop, 2, 2)}};
const FaultPlan kHalves{1, {fault(FaultKind::half_frame, 3, 1)}};
const FaultPlan kLate{1, {fault(FaultKind::late, 1, 2), fault(FaultKind::slow_consumer, 3, 1)}};

INSTANTIATE_TEST_SUITE_P(
    Faulty, CameraConformance,
    testing::Values(losing({"bedroom_drops", bedroom(kDrops), 3, 3}),
                    CameraCase{"bedroom_late", bedroom(kLate, rt::Clock::monotonic()), 5, 5},
                    CameraCase{"recording_without_faults", recording(kNone, 0), 9, 9},
                    losing({"recording_drops", recording(kDrops, 0), 7, 7}),
                    losing({"recording_drops_prefetch", recording(kDrops, 2), 7, 7}),
                    losing({"recording_half_frames_prefetch", recording(kHalves, 2), 8, 8, 1, 1})),
    case_name);

}  // namespace
}  // namespace tactus::hal::conformance
