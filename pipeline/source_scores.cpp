#include "pipeline/source_scores.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace tactus {

void scores_of_labels(std::span<const MaterialId> labels, const hal::Intrinsics& camera,
                      segment::MaterialScores& scores) noexcept {
  constexpr std::uint8_t kSure = 230;  // 0.9
  const double step_u = static_cast<double>(camera.width) / scores.width;
  const double step_v = static_cast<double>(camera.height) / scores.height;
  scores.columns = {static_cast<float>(1 / step_u), static_cast<float>(0.5 / step_u - 0.5)};
  scores.rows = {static_cast<float>(1 / step_v), static_cast<float>(0.5 / step_v - 0.5)};
  std::size_t at = 0;
  for (int y = 0; y < scores.height; ++y)
    for (int x = 0; x < scores.width; ++x, at += kMaterialCount) {
      const auto u = static_cast<std::size_t>((x + 0.5) * step_u),
                 v = static_cast<std::size_t>((y + 0.5) * step_v);
      const MaterialId id = labels[v * static_cast<std::size_t>(camera.width) + u];
      const bool known = id < kMaterialCount;
      // What is left over goes to the others evenly; nothing known is evenly everything.
      const auto other =
          static_cast<std::uint8_t>(known ? (255 - kSure) / (kMaterialCount - 1) : 255 / kMaterialCount);
      std::fill_n(scores.probability.begin() + static_cast<std::ptrdiff_t>(at), kMaterialCount, other);
      if (known) scores.probability[at + id] = kSure;
    }
}

}  // namespace tactus
