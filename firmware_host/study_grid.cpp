#include "firmware_host/study_grid.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "hal/replay/image_codec.hpp"

namespace tactus::firmware {
namespace {

constexpr int kGap_px = 4, kHeading_px = 22, kLegendRow_px = 18, kLegendPerRow = 8;
constexpr std::array<const char*, StudyGrid::kColumns> kHeadings = {
    "net (FCN)", "net_crf2d (CRF-RNN)", "fused (noCRF)", "fused_crf3d (Ours)", "truth", "image"};
constexpr std::array<LabelMethod, 4> kColumnMethods = {LabelMethod::net, LabelMethod::net_crf2d,
                                                       LabelMethod::fused, LabelMethod::fused_crf3d};
constexpr Rgb8 kNothing{0, 0, 0};  // no prediction, no truth

cv::Scalar scalar(Rgb8 color) {
  return {static_cast<double>(color.r), static_cast<double>(color.g), static_cast<double>(color.b)};
}

void write_word(cv::Mat& picture, const std::string& word, int x, int y) {
  cv::putText(picture, word, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.42, {255, 255, 255}, 1, cv::LINE_AA);
}

}  // namespace

void StudyGrid::add(const LabelStudy& study, std::size_t rows) {
  const int width = study.camera.width, height = study.camera.height;
  const int tile_height = height * kTileWidth_px / width;
  const auto pixel = [&](int x, int y) {
    // The middle of what a tile's pixel stands for: labels have no mean.
    const auto u = static_cast<std::size_t>((2 * x + 1) * width / (2 * kTileWidth_px)),
               v = static_cast<std::size_t>((2 * y + 1) * height / (2 * tile_height));
    return v * static_cast<std::size_t>(width) + u;
  };
  const std::size_t wanted = std::min(rows, study.views.size());
  for (std::size_t row = 0; row < wanted; ++row) {
    const LabelView& view = study.views[(2 * row + 1) * study.views.size() / (2 * wanted)];
    std::array<Tile, kColumns> tiles;
    for (std::size_t column = 0; column < kColumns; ++column) {
      Tile& tile = tiles[column];
      tile.width = kTileWidth_px;
      tile.height = tile_height;
      const std::vector<MaterialId>* labels = column == 4 ? &view.truth : nullptr;
      if (column < kColumnMethods.size())
        labels = &view.labels[static_cast<std::size_t>(kColumnMethods[column])];
      for (int y = 0; y < tile_height; ++y)
        for (int x = 0; x < kTileWidth_px; ++x) {
          const std::size_t p = pixel(x, y);
          Rgb8 color = kNothing;
          if (labels == nullptr) {
            color = {view.rgb[p * 3], view.rgb[p * 3 + 1], view.rgb[p * 3 + 2]};
          } else if (!labels->empty() && (*labels)[p] < kMaterialCount) {
            color = material_color((*labels)[p]);
            occurs_[(*labels)[p]] = true;
          }
          tile.rgb.insert(tile.rgb.end(), {color.r, color.g, color.b});
        }
    }
    rows_.push_back(std::move(tiles));
  }
}

rt::Result<void> StudyGrid::write(const std::filesystem::path& file) const {
  const int legend_rows =
      (static_cast<int>(std::count(occurs_.begin(), occurs_.end(), true)) + kLegendPerRow - 1) /
      kLegendPerRow;
  int height = kHeading_px + legend_rows * kLegendRow_px + kGap_px;
  for (const auto& row : rows_) height += row[0].height + kGap_px;
  const int width = static_cast<int>(kColumns) * (kTileWidth_px + kGap_px) + kGap_px;
  cv::Mat picture(height, width, CV_8UC3,
                  cv::Scalar(30, 30, 30));  // R, G, B in this order: OpenCV only draws
  for (std::size_t column = 0; column < kColumns; ++column)
    write_word(picture, kHeadings[column], kGap_px + static_cast<int>(column) * (kTileWidth_px + kGap_px),
               15);
  int y = kHeading_px;
  for (const auto& row : rows_) {
    for (std::size_t column = 0; column < kColumns; ++column) {
      const Tile& tile = row[column];
      const cv::Mat from(tile.height, tile.width, CV_8UC3, const_cast<std::uint8_t*>(tile.rgb.data()));
      from.copyTo(picture(
          {kGap_px + static_cast<int>(column) * (kTileWidth_px + kGap_px), y, tile.width, tile.height}));
    }
    y += row[0].height + kGap_px;
  }
  int place = 0;
  for (std::size_t id = 0; id < kMaterialCount; ++id) {
    if (!occurs_[id]) continue;
    const int x = kGap_px + place % kLegendPerRow * (width / kLegendPerRow),
              top = y + place / kLegendPerRow * kLegendRow_px;
    cv::rectangle(picture, {x, top + 2, 14, 12}, scalar(material_color(static_cast<MaterialId>(id))),
                  cv::FILLED);
    write_word(picture, std::string(kMaterialNames[id]), x + 20, top + 13);
    ++place;
  }
  return hal::replay::write_color_png(
      file, {picture.data, static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3}, width,
      height);
}

}  // namespace tactus::firmware
