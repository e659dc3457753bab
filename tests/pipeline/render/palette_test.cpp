#include "pipeline/render/palette.hpp"

#include <gtest/gtest.h>

namespace tactus::render {
namespace {

TEST(OverlayPalette, MaterialsAreOpaqueAndEverythingElseLeavesTheVideo) {
  constexpr Palette sut = overlay_palette();
  for (std::size_t id = 0; id < sut.size(); ++id) {
    const bool is_material = id < static_cast<std::size_t>(kMaterialCount);
    EXPECT_EQ(sut[id][3], is_material ? 255 : 0) << id;
    if (is_material) {
      EXPECT_EQ((Rgb8{sut[id][0], sut[id][1], sut[id][2]}), material_color(static_cast<MaterialId>(id)));
    }
  }
}

}  // namespace
}  // namespace tactus::render
