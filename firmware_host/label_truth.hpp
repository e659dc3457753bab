// True material ids of colour frames, from a folder of PNG files or from a source that knows its own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hal/camera.hpp"
#include "pipeline/label/material.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

class LabelTruthImages {
 public:
  /// `folder`/NAME.png: 8-bit grey material ids, named as the colour frames, 255 unlabelled. bad_input when
  /// the folder does not exist or holds no PNG. Boot.
  static rt::Result<LabelTruthImages> in_folder(const std::filesystem::path& folder);
  /// What the sensor itself knows; bad_usage when it knows nothing, or knows it in the pixels of a depth
  /// camera that is not the colour camera.
  static rt::Result<LabelTruthImages> of_sensor(const std::string& source, hal::Sensor& sensor);

  /// How many there are; 0 when every frame has one (the sensor's own).
  [[nodiscard]] std::size_t images_count() const { return images_count_; }
  /// Whether a frame has one. Cheap.
  [[nodiscard]] bool has(const std::string& name) const;
  /// Into `ids`, width * height of them. bad_input with the file's name: unreadable, another size, ids that
  /// do not exist.
  rt::Result<void> read(const std::string& name, std::uint64_t depth_sequence, int width, int height,
                        std::span<MaterialId> ids) const;

 private:
  std::filesystem::path folder_;
  std::size_t images_count_ = 0;
  hal::LabelTruth* sensor_labels_ = nullptr;
};

}  // namespace tactus::firmware
