// What a folder holds, read and checked, before any camera is made of it; the two layouts end in this one
// form.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hal/camera.hpp"
#include "hal/replay/lists.hpp"

namespace tactus::hal::replay {

/// Depth and colour of one moment are taken at most this far apart (half a frame at 30 Hz is 17 ms).
inline constexpr rt::Duration kPairDistanceMax{20'000'000};
/// A label image belongs to exactly one depth frame; the slack is for times rounded to milliseconds.
inline constexpr rt::Duration kLabelDistanceMax{1'000'000};

struct Recording {
  std::filesystem::path directory;
  std::string layout;  // for people
  FrameList depth;
  std::optional<FrameList> color;
  std::optional<FrameList> labels;
  RigCalibration calibration;  // depth.width == 0: unknown, to be taken from the first image
  std::vector<TruthPose> truth;
  std::vector<std::string> notes;
  // Gravity as far as the folder knows it, in order of preference.
  std::optional<Vec3d> gravity_first_depth;  // in the depth frame of the recording's first frame
  std::optional<Vec3d> gravity_truth_world;  // in the world of `truth`
  std::string accelerometer_text;            // TUM's; empty when absent
};

/// Boot phase. Errors as open_replay.
rt::Result<Recording> read_tum_folder(const std::filesystem::path& directory);
rt::Result<Recording> read_seven_scenes_folder(const std::filesystem::path& directory);

/// True when the folder holds at least one frame-NNNNNN.depth.png.
bool has_seven_scenes_frames(const std::filesystem::path& directory);

/// Number of "frame-<digits>.<what>" ("depth.png", ...), when the name is of this form.
std::optional<std::uint64_t> frame_number(std::string_view file_name, std::string_view what);

/// Reads directory/calibration.toml when it is there.
rt::Result<std::optional<RigCalibration>> read_calibration_toml(const std::filesystem::path& directory);
/// Reads directory/gravity.txt when it is there.
rt::Result<std::optional<Vec3d>> read_gravity(const std::filesystem::path& directory, const char* name);

}  // namespace tactus::hal::replay
