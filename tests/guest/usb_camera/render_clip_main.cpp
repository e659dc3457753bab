// guest_render_clip SOURCE FOLDER: renders a synthetic room into FOLDER/clip, FOLDER/calibration.toml and FOLDER/poses.txt
// (one true pose "tx ty tz qx qy qz qw" a line, camera to world, one a frame).
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "hal/replay/intrinsics_file.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "tests/guest/usb_camera/clip.hpp"

namespace {

using namespace tactus;

rt::Result<void> render(const char* source, const std::filesystem::path& folder) {
  const auto options = hal::parse_synthetic_name(source);
  if (!options) return options.error();
  auto sensor = hal::open_synthetic(*options);
  if (!sensor) return sensor.error();
  const auto clip = guest::Clip::render(*sensor);
  if (!clip) return clip.error();
  std::filesystem::create_directories(folder);
  if (auto written = clip->write(folder / "clip"); !written) return written;

  std::ofstream calibration(folder / "calibration.toml");
  calibration << hal::replay::format_calibration_toml(sensor->calibration);
  std::ofstream poses(folder / "poses.txt");
  for (const hal::TruthPose& truth : sensor->truth) {
    const Vec3d& t = truth.T_world_depth.translation;
    const Quaternion q = truth.T_world_depth.rotation.quaternion();
    char line[200];
    std::snprintf(line, sizeof(line), "%.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    poses << line;
  }
  if (!calibration || !poses)
    return rt::Error{rt::ExitCode::failed, folder.string() + " cannot be written; is the disk full?"};
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: guest_render_clip synthetic:SCENE?key=value FOLDER\n", stderr);
    return 2;
  }
  const auto rendered = render(argv[1], argv[2]);
  if (rendered) return 0;
  std::fprintf(stderr, "%s\n", rendered.error().message.c_str());
  return static_cast<int>(rendered.error().code);
}
