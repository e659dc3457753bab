#include "pipeline/evaluate/trimap.hpp"

#include <algorithm>
#include <cstddef>

#include "rt/assert.hpp"

namespace tactus::evaluate {

void mark_boundary_band(std::span<const MaterialId> truth, int width, int height, int radius_px,
                        std::span<std::uint8_t> band) {
  TACTUS_ASSERT(width > 0 && height > 0 && radius_px > 0);
  TACTUS_ASSERT(truth.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) &&
                band.size() == truth.size());
  std::fill(band.begin(), band.end(), std::uint8_t{0});
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  // The nearest pixel with another id always has a 4-neighbour with one: the step towards the pixel that asks
  // is nearer to it still, so has its id. Hence it is enough to look from such pixels.
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const MaterialId id = truth[at(x, y)];
      const bool is_boundary =
          (x > 0 && truth[at(x - 1, y)] != id) || (x + 1 < width && truth[at(x + 1, y)] != id) ||
          (y > 0 && truth[at(x, y - 1)] != id) || (y + 1 < height && truth[at(x, y + 1)] != id);
      if (!is_boundary) continue;
      for (int dy = -radius_px; dy <= radius_px; ++dy)
        for (int dx = -radius_px; dx <= radius_px; ++dx) {
          const int qx = x + dx, qy = y + dy;
          if (dx * dx + dy * dy > radius_px * radius_px || qx < 0 || qy < 0 || qx >= width || qy >= height)
            continue;
          if (truth[at(qx, qy)] != id) band[at(qx, qy)] = 1;
        }
    }
}

void TrimapConfusion::add(const TrimapConfusion& other) {
  all.add(other.all);
  band.add(other.band);
  inside.add(other.inside);
}

void count_pixels(std::span<const MaterialId> truth, std::span<const MaterialId> predicted,
                  std::span<const std::uint8_t> band, TrimapConfusion& counts) {
  TACTUS_ASSERT(truth.size() == predicted.size() && truth.size() == band.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    counts.all.add(truth[i], predicted[i]);
    (band[i] != 0 ? counts.band : counts.inside).add(truth[i], predicted[i]);
  }
}

}  // namespace tactus::evaluate
