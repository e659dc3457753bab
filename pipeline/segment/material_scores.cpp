#include "pipeline/segment/material_scores.hpp"

#include <algorithm>

namespace tactus::segment {

void MaterialScores::sample(float u, float v, MaterialDistribution& out) const noexcept {
  const float x = std::clamp(columns.scale * u + columns.offset, 0.0F, static_cast<float>(width - 1));
  const float y = std::clamp(rows.scale * v + rows.offset, 0.0F, static_cast<float>(height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto a = pixel(x0, y0), b = pixel(x1, y0), c = pixel(x0, y1), d = pixel(x1, y1);
  float sum = 0;
  for (std::size_t m = 0; m < kMaterialCount; ++m) {
    const float top = static_cast<float>(a[m]) * (1 - fx) + static_cast<float>(b[m]) * fx;
    const float bottom = static_cast<float>(c[m]) * (1 - fx) + static_cast<float>(d[m]) * fx;
    out[m] = top * (1 - fy) + bottom * fy;
    sum += out[m];
  }
  // Memory that step never wrote is all zeros: nothing is known there.
  if (!(sum > 0)) {
    out.fill(1.0F / kMaterialCount);
    return;
  }
  const float inverse = 1.0F / sum;
  for (float& p : out) p *= inverse;
}

}  // namespace tactus::segment
