// Surface points with unary costs and true labels in a file: what the CRF's parameters are fitted on.
//
// The file, little endian, nothing between the parts:
//
//   8 bytes    "TACTCRF1"
//   u32        number of points N
//   u32        number of materials, 23
//   N records  f32 x 3 position (metres), f32 x 3 normal (unit, 0 where unknown), u8 x 3 colour (R, G, B),
//              u8 true material (255: unknown, not scored), f32 x 23 unary cost (nats, -ln P up to a
//              constant)
//
// that is 16 + 120 N bytes.
#pragma once

#include <string>
#include <vector>

#include "pipeline/label/crf/crf.hpp"
#include "rt/status.hpp"

namespace tactus::bench {

struct LabelledPoints {
  std::vector<Vec3f> position_m, normal;
  std::vector<Rgb8> color;
  std::vector<float> unary_nat;
  std::vector<MaterialId> truth;

  [[nodiscard]] std::size_t size() const { return position_m.size(); }
  [[nodiscard]] label::CrfPoints points() const { return {position_m, color, normal, unary_nat}; }
};

/// Error (bad_input): one sentence with the file's name; sizes, magic, numbers that are not finite and
/// materials that do not exist are checked.
rt::Result<LabelledPoints> read_points(const std::string& path);

/// Error (failed) when the file cannot be written.
rt::Result<void> write_points(const std::string& path, const LabelledPoints& points);

}  // namespace tactus::bench
