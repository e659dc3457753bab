#include "firmware_host/label_crf.hpp"

#include <string>

#include "pipeline/label/crf/batch_crf.hpp"
#include "pipeline/label/crf/crf_settings.hpp"
#include "rt/arena.hpp"

namespace tactus::firmware {

rt::Result<label::CrfParameters> crf_parameters(const std::string& choice) {
  if (choice == "default") return label::default_crf_parameters();
  if (choice == "paper") return label::paper_crf_parameters();
  return label::load_crf_parameters(choice);
}

CellPoints::CellPoints(std::span<const map::SurfaceCell> cells) {
  position_m.reserve(cells.size());
  normal.reserve(cells.size());
  color.reserve(cells.size());
  unary_nat.resize(cells.size() * kMaterialCount);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    position_m.push_back(cells[i].position_world_m);
    normal.push_back(cells[i].normal_world);
    color.push_back(cells[i].color);
    label::unary_costs_of(cells[i].word,
                          std::span<float, kMaterialCount>(&unary_nat[i * kMaterialCount], kMaterialCount));
  }
}

rt::Result<RefinedCells> refine_cells(const label::CrfPoints& points,
                                      const label::CrfParameters& parameters) {
  RefinedCells refined;
  if (points.size() == 0) return refined;
  rt::Status status = rt::Status::full;
  // Room for rooms first; where points share too few lattice vertices for that, room for anything.
  for (const auto& config : {label::BatchCrfConfig::for_points(points.size()),
                             label::BatchCrfConfig::for_any_points(points.size())}) {
    auto arena = rt::Arena::reserve(label::BatchCrf::bytes_needed(config));
    if (!arena) return arena.error();
    rt::Slice memory = arena->carve(label::BatchCrf::bytes_needed(config));
    label::BatchCrf crf;
    crf.bind(memory, config);
    status = crf.prepare(points, parameters);
    if (status == rt::Status::full) continue;
    if (status != rt::Status::ok) break;
    std::vector<float> marginals(points.size() * kMaterialCount);
    refined.report = crf.solve(marginals);
    refined.labels.resize(points.size());
    label::most_probable(marginals, refined.labels);
    return refined;
  }
  return rt::Error{rt::ExitCode::failed, "The 3D CRF cannot take the map's " + std::to_string(points.size()) +
                                             " cells with these parameters: " + rt::name(status) + "."};
}

}  // namespace tactus::firmware
