// A picture against one that somebody has looked at. TACTUS_UPDATE_GOLDEN=1 writes them anew: look at them.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "pipeline/render/png.hpp"
#include "tests/pipeline/render/picture.hpp"

namespace tactus::test {

// Drivers round colours and outlines differently: allowed is a mean difference of 2 of 255, and half a
// percent of the pixels (outlines) off by more than 24.
inline constexpr double kMeanAbsMax = 2.0, kPartFarOffMax = 0.005;

inline void expect_golden(const Picture& drawn, const std::string& name) {
  const auto golden_path =
      std::filesystem::path(TACTUS_SOURCE_DIR) / "tests/pipeline/render/golden" / (name + ".png");
  if (std::getenv("TACTUS_UPDATE_GOLDEN") != nullptr) {
    const auto written = render::write_png(golden_path, drawn.rgb, drawn.width_px, drawn.height_px);
    ASSERT_TRUE(written) << written.error().message;
    GTEST_SKIP() << "wrote " << golden_path << "; look at it before you commit it";
  }
  const auto golden = read_png(golden_path);
  ASSERT_TRUE(golden.has_value()) << "cannot read " << golden_path;
  ASSERT_EQ(golden->rgb.size(), drawn.rgb.size());
  const Difference difference = compare(drawn, *golden);
  EXPECT_LE(difference.mean_abs, kMeanAbsMax);
  EXPECT_LE(difference.part_far_off, kPartFarOffMax);
  if (difference.mean_abs <= kMeanAbsMax && difference.part_far_off <= kPartFarOffMax) return;
  const auto actual_path =
      std::filesystem::path(testing::TempDir()) / ("tactus_golden_actual_" + name + ".png");
  const auto written = render::write_png(actual_path, drawn.rgb, drawn.width_px, drawn.height_px);
  std::printf("expected %s, drawn %s\n", golden_path.c_str(),
              written ? actual_path.c_str() : written.error().message.c_str());
}

}  // namespace tactus::test
