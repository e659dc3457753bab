#include <algorithm>
#include <optional>

#include "hal/openni2/oni_writer.hpp"
#include "hal/openni2/openni2.hpp"
#include "hal/replay/replay.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "tests/conformance/camera_suite.hpp"
#include "tests/hal/replay/recording_folder.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::hal::conformance {
namespace {

/// Written when the first case opens it, gone with the process.
const std::filesystem::path& synthetic_file() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    auto made = folder.path() / "synthetic.oni";
    auto sensor = open_synthetic(*parse_synthetic_name("synthetic:bedroom?frames=5&mode=320x240"));
    EXPECT_TRUE(sensor && openni2::write_oni(made, *sensor));
    return made;
  }();
  return path;
}

/// Random images in 0.2 mm, colour 3 ms after depth; its last three colour frames are not there.
const std::filesystem::path& folder_file() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path path = [] {
    const replay::RecordingFolder source(9);
    std::string list = source.read("rgb.txt");
    source.write("rgb.txt", list.substr(0, list.find(replay::RecordingFolder::time_text(6, 3))));
    auto made = folder.path() / "folder.oni";
    auto sensor = open_replay(source.path(), {});
    EXPECT_TRUE(sensor && openni2::write_oni(made, *sensor));
    return made;
  }();
  return path;
}

std::vector<CameraCase> cases() {
  const auto opens = [](const std::filesystem::path& (*make)(), openni2::OniOptions options) {
    return [make, options] { return openni2::open_oni(make(), options); };
  };
  std::vector<CameraCase> out{
      {"written_synthetic", opens(synthetic_file, {}), 5, 5},
      {"written_synthetic_prefetch", opens(synthetic_file, {.prefetch = 2}), 5, 5},
      {"written_folder", opens(folder_file, {}), 9, 6},
      {"written_folder_part", opens(folder_file, {.first = 2, .last = 6, .prefetch = 1}), 4, 4},
  };
  if (const auto shared = test::shared_data("oni/kinect_v1_12frames.oni")) {
    out.push_back({"kinect_v1", [shared] { return openni2::open_oni(*shared, {}); }, 12, 12});
    out.push_back({"kinect_v1_prefetch", [shared] { return openni2::open_oni(*shared, {.prefetch = 2}); }, 12, 12});
  }
  return out;
}

INSTANTIATE_TEST_SUITE_P(OpenNi2, CameraConformance, testing::ValuesIn(cases()), case_name);

}  // namespace
}  // namespace tactus::hal::conformance
