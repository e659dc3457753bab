// The paper's picture grid: a row per frame; FCN, CRF-RNN, Ours_noCRF, Ours, truth and image as columns.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/label_methods.hpp"

namespace tactus::firmware {

/// Rows as they come; copies what it shows, so that studies need not be kept.
class StudyGrid {
 public:
  /// Adds `rows` frames spread evenly over the study.
  void add(const LabelStudy& study, std::size_t rows);
  /// PNG with headings and the colours of the materials that occur. failed when it cannot be written.
  rt::Result<void> write(const std::filesystem::path& file) const;
  [[nodiscard]] std::size_t rows_count() const { return rows_.size(); }

  static constexpr std::size_t kColumns = 6;
  static constexpr int kTileWidth_px = 240;

 private:
  struct Tile {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
  };
  std::vector<std::array<Tile, kColumns>> rows_;
  std::array<bool, kMaterialCount> occurs_{};
};

}  // namespace tactus::firmware
