#include "firmware_host/label_outputs.hpp"

#include <bit>
#include <cstring>

#include "firmware_host/label_crf.hpp"
#include "firmware_host/output_file.hpp"
#include "hal/replay/image_codec.hpp"

namespace tactus::firmware {

rt::Result<void> make_prediction_folders(const std::filesystem::path& folder,
                                         const std::array<bool, kLabelMethodsCount>& has_method) {
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
    if (!has_method[m]) continue;
    const auto path = folder / kLabelMethodNames[m];
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error)
      return rt::Error{rt::ExitCode::failed,
                       path.string() + ": the folder cannot be made: " + error.message() + "."};
  }
  return {};
}

rt::Result<void> save_predictions(const std::filesystem::path& folder, const LabelStudy& study) {
  for (const LabelView& view : study.views)
    for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
      if (view.labels[m].empty()) continue;
      const auto path = folder / kLabelMethodNames[m] / (view.name + ".png");
      if (auto wrote =
              hal::replay::write_label_png(path, view.labels[m], study.camera.width, study.camera.height);
          !wrote)
        return wrote;
    }
  return {};
}

rt::Result<void> save_points(const std::filesystem::path& file, std::span<const map::SurfaceCell> cells,
                             std::span<const MaterialId> truth) {
  static_assert(std::endian::native == std::endian::little, "the file is little endian");
  TACTUS_ASSERT(cells.size() == truth.size());
  auto out = OutputFile::create(file);
  if (!out) return out.error();
  const CellPoints points(cells);
  const std::array<std::uint32_t, 2> counts = {static_cast<std::uint32_t>(cells.size()), kMaterialCount};
  out->write("TACTCRF1");
  out->write(counts.data(), sizeof(counts));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Vec3f &p = points.position_m[i], &n = points.normal[i];
    const std::array<float, 6> place = {p.x, p.y, p.z, n.x, n.y, n.z};
    const std::array<std::uint8_t, 4> look = {points.color[i].r, points.color[i].g, points.color[i].b,
                                              truth[i]};
    out->write(place.data(), sizeof(place));
    out->write(look.data(), sizeof(look));
    out->write(&points.unary_nat[i * kMaterialCount], sizeof(float) * kMaterialCount);
  }
  return out->close();
}

}  // namespace tactus::firmware
