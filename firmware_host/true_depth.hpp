// Exact depth of a source's frames, where it is known: a synthetic room's own, or a recording's depth_gt.txt.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "hal/camera.hpp"
#include "hal/synthetic/synthetic.hpp"

namespace tactus::firmware {

class TrueDepth {
 public:
  /// bad_usage when the source does not know any. Boot.
  static rt::Result<TrueDepth> of(const std::string& source, const hal::RigCalibration& rig);

  /// Whether every frame has one; a recording may have some only.
  [[nodiscard]] bool is_complete() const { return renderer_ != nullptr; }
  /// Metres along the optical axis, 0 where nothing is hit. False: unknown for this frame. Allocates.
  rt::Result<bool> read(std::uint64_t depth_sequence, rt::SensorTime time, std::span<float> depth_m);

  /// A depth camera with this in the place of its pixels; frames without are blank. `exact` must outlive it.
  static std::unique_ptr<hal::DepthCamera> camera(std::unique_ptr<hal::DepthCamera> real, TrueDepth& exact,
                                                  const hal::RigCalibration& rig);

 private:
  hal::RigCalibration rig_;
  std::unique_ptr<hal::synthetic::FrameRenderer> renderer_;
  std::map<std::int64_t, std::filesystem::path> files_;  // by time, ns
};

}  // namespace tactus::firmware
