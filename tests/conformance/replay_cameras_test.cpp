#include <algorithm>

#include "hal/replay/recording_writer.hpp"
#include "hal/replay/replay.hpp"
#include "tests/conformance/camera_suite.hpp"
#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::conformance {
namespace {

using replay::RecordingFolder;

/// Made when the first case opens it, gone with the process.
template <typename Make>
std::function<rt::Result<Sensor>()> opens(Make make, ReplayOptions options) {
  return [make, options] { return open_replay(make(), options); };
}

const std::filesystem::path& good_folder() {
  static const RecordingFolder folder(9);
  return folder.path();
}

/// Two depth frames and one of colour are spoilt, one depth time goes back, one frame holds 65535.
const std::filesystem::path& spoilt_folder() {
  static const RecordingFolder* folder = [] {
    static const RecordingFolder made(9);
    made.write("depth/2.png", "not a picture");
    auto saturated = replay::depth_image(0);
    std::fill(saturated.begin(), saturated.begin() + 50, std::uint16_t{65535});
    EXPECT_TRUE(
        replay::write_depth_png(made.path() / "depth/0.png", saturated, replay::kWidth, replay::kHeight));
    std::filesystem::remove(made.path() / "depth/5.png");
    made.write("rgb/3.png", made.read("rgb/3.png").substr(0, 700));
    std::string list = made.read("depth.txt");
    const std::string time = RecordingFolder::time_text(7, 0);
    made.write("depth.txt", list.replace(list.find(time), time.size(), "0.000"));
    return &made;
  }();
  return folder->path();
}

const std::filesystem::path& depth_only_folder() {
  static const RecordingFolder* folder = [] {
    static const RecordingFolder made(4);
    std::filesystem::remove(made.path() / "rgb.txt");
    return &made;
  }();
  return folder->path();
}

std::filesystem::path seven_scenes_folder() {
  static const test::TemporaryFolder folder;
  const auto path = folder.path() / "seven";
  if (std::filesystem::exists(path)) return path;
  auto source = open_replay(good_folder(), {});
  EXPECT_TRUE(source && write_recording(path, *source, {.layout = RecordingLayout::seven_scenes}));
  return path;
}

INSTANTIATE_TEST_SUITE_P(
    Replay, CameraConformance,
    testing::Values(CameraCase{"tum", opens(good_folder, {}), 9, 9},
                    CameraCase{"tum_prefetch", opens(good_folder, {.prefetch = 3}), 9, 9},
                    CameraCase{"tum_part", opens(good_folder, {.first = 2, .last = 6, .prefetch = 1}), 4, 4},
                    CameraCase{"tum_spoilt", opens(spoilt_folder, {}), 6, 8, 3, 1},
                    CameraCase{"tum_spoilt_prefetch", opens(spoilt_folder, {.prefetch = 2}), 6, 8, 3, 1},
                    CameraCase{"tum_depth_only", opens(depth_only_folder, {}), 4, 0},
                    CameraCase{"seven_scenes", opens(seven_scenes_folder, {}), 9, 9},
                    CameraCase{"seven_scenes_prefetch", opens(seven_scenes_folder, {.prefetch = 2}), 9, 9}),
    case_name);

}  // namespace
}  // namespace tactus::hal::conformance
