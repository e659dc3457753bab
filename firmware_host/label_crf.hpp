// The random field over the cells of a map, with the memory it needs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "pipeline/label/crf/crf.hpp"
#include "pipeline/map/cell_list.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// "default", "paper" or a TOML file (crf_settings.hpp). bad_usage when it cannot be read. Boot.
rt::Result<label::CrfParameters> crf_parameters(const std::string& choice);

/// Cells as the 3D field wants them.
struct CellPoints {
  explicit CellPoints(std::span<const map::SurfaceCell> cells);
  [[nodiscard]] label::CrfPoints points() const { return {position_m, color, normal, unary_nat}; }

  std::vector<Vec3f> position_m, normal;
  std::vector<Rgb8> color;
  std::vector<float> unary_nat;
};

struct RefinedCells {
  std::vector<MaterialId> labels;  // per cell; a cell never labelled takes what its neighbours say
  label::CrfReport report;
};

/// The batch field over all cells of a map. failed when the parameters or the map cannot be computed with.
rt::Result<RefinedCells> refine_cells(const label::CrfPoints& points, const label::CrfParameters& parameters);

}  // namespace tactus::firmware
