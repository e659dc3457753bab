// How well depth lies on colour: what stands in front of something else ends, in most pictures, where the colour changes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct RegistrationReport {
  int pairs_count = 0;            // pairs of a depth and a colour frame that were looked at
  std::uint64_t edges_count = 0;  // pixels at the near side of a jump in depth that fall into the colour picture
  double edge_depth_m = 0;        // their median distance
  /// From such a pixel to the nearest strong colour edge of its direction, colour pixels.
  double median_px = 0, p90_px = 0;
  /// The same for the edges moved somewhere else: what pure chance gives with this much texture.
  double chance_median_px = 0, chance_p90_px = 0;
  /// Moving all depth edges by this fits best, colour pixels; beyond +-kShiftMax nothing is looked for.
  double shift_x_px = 0, shift_y_px = 0;
  double fit_share = 0;       // how well it fits then, against the mean of all shifts
  bool is_decidable = false;  // edges enough, and one shift fits most of them
  std::string verdict;        // one sentence
};

/// Looks at pairs one by one. One thread; allocates.
class RegistrationCheck {
 public:
  static constexpr int kShiftMax = 16;  // pixels each way

  explicit RegistrationCheck(const hal::RigCalibration& rig);
  /// Raw depth and RGB of one moment, in the rig's sizes.
  void add(std::span<const std::uint16_t> raw, std::span<const std::uint8_t> rgb);
  [[nodiscard]] RegistrationReport report() const;

 private:
  struct Edge {
    float u = 0, v = 0;      // in the colour picture
    bool is_across = false;  // the jump is met walking along a row, so that the edge is an upright one
  };
  void find_edges(std::span<const std::uint16_t> raw);
  void add_edge(int x, int y, int step_x, int step_y, std::uint16_t raw);

  hal::RigCalibration rig_;
  int pairs_count_ = 0;
  std::vector<Edge> edges_;                          // of the pair being looked at
  std::vector<std::uint32_t> at_place_, by_chance_;  // histograms of distances, kBinsPerPixel to a pixel
  std::vector<double> fit_;                          // by shift, rows of dy
  std::vector<std::uint32_t> depths_;                // histogram of the edges' distances, centimetres
  std::uint64_t random_state_ = 1;
};

/// Reads the sensor and checks up to `pairs_max` pairs spread over its frames (a live one: one in ten). bad_usage for a
/// sensor without colour. Boot.
rt::Result<RegistrationReport> check_registration(hal::Sensor& sensor, const std::string& source, int pairs_max);

}  // namespace tactus::firmware
