// A Map filled from an exact distance, and materials if there are any, as fusing many frames would.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <new>
#include <random>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/map.hpp"
#include "pipeline/map/reader.hpp"

namespace tactus::test {

/// Known from the truncation band behind the surface to a little in front, with `sigma_m` of noise left in
/// each voxel.
class FilledMap {
 public:
  /// `distance`: signed, exact in front, metres. Cells are unlabelled.
  template <typename Distance>
  FilledMap(const Distance& distance, const Vec3d& low_m, const Vec3d& high_m, double sigma_m, unsigned seed)
      : FilledMap(
            distance, [](const Vec3d&) { return kUnknownMaterial; }, low_m, high_m, sigma_m, seed) {}

  /// `material`: of the surface nearest to a point; cells near a surface hold it with 95 %.
  template <typename Distance, typename Materials>
  FilledMap(const Distance& distance, const Materials& material, const Vec3d& low_m, const Vec3d& high_m,
            double sigma_m, unsigned seed) {
    map::MapConfig config;
    config.blocks_capacity = 14336;
    bytes_ = map::Map::bytes_needed(config);
    memory_.reset(static_cast<std::byte*>(::operator new (bytes_, std::align_val_t{64})));
    map_.bind(rt::Slice(std::span(memory_.get(), bytes_)), config);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, sigma_m);
    const double voxel_m = static_cast<double>(config.voxel_size_m);
    const double truncation_m = static_cast<double>(config.truncation_m);
    const auto block_at = [&](double v) {
      return map::block_of(static_cast<std::int32_t>(std::floor(v / voxel_m)));
    };
    map::BlockStaging staging;
    for (int bz = block_at(low_m.z); bz <= block_at(high_m.z); ++bz)
      for (int by = block_at(low_m.y); by <= block_at(high_m.y); ++by)
        for (int bx = block_at(low_m.x); bx <= block_at(high_m.x); ++bx) {
          const auto place = [&](double x, double y, double z) {
            return Vec3d{(bx * 8 + x) * voxel_m, (by * 8 + y) * voxel_m, (bz * 8 + z) * voxel_m};
          };
          // No voxel is farther from the block's middle than 6.1 voxels.
          if (std::abs(distance(place(3.5, 3.5, 3.5))) > truncation_m + 6.1 * voxel_m) continue;
          bool is_near = false;
          for (int z = 0; z < map::kBlockSide; ++z)
            for (int y = 0; y < map::kBlockSide; ++y)
              for (int x = 0; x < map::kBlockSide; ++x) {
                const double d = distance(place(x, y, z));
                const auto i = static_cast<std::size_t>(map::voxel_index(x, y, z));
                is_near = is_near || std::abs(d) < truncation_m;
                const bool seen = d > -truncation_m;
                const double scaled = std::clamp((d + noise(random)) / truncation_m, -1.0, 1.0) * 32767;
                staging.tsdf[i] = seen ? static_cast<std::int16_t>(std::lround(scaled)) : map::kTsdfUnknown;
                staging.weight[i] = seen ? 50 : 0;
              }
          std::fill(std::begin(staging.color), std::end(staging.color), map::ColorCell{});
          if (!is_near) continue;
          const auto block = map_.find_or_allocate(map::key_of({bx, by, bz}));
          TACTUS_ASSERT(block != map::kNoBlock);
          map_.publish(block, staging);
          map::LabelWord labels[map::kBlockCells] = {};
          for (int c = 0; c < map::kBlockCells; ++c) {
            const Vec3d p = place(2 * (c % 4) + 0.5, 2 * (c / 4 % 4) + 0.5, 2 * (c / 16) + 0.5);
            const MaterialId id = std::abs(distance(p)) < truncation_m ? material(p) : kUnknownMaterial;
            if (id == kUnknownMaterial) continue;
            MaterialDistribution likely;
            likely.fill(0.05F / (kMaterialCount - 1));
            likely[id] = 0.95F;
            labels[c] = label::encode(likely, 3);
          }
          map_.publish_labels(block, std::span<const map::LabelWord, map::kBlockCells>(labels), 1);
        }
  }

  [[nodiscard]] map::Reader reader() const { return map::Reader(map_); }

 private:
  struct Free {
    void operator()(std::byte* p) const { ::operator delete (p, std::align_val_t{64}); }
  };
  std::size_t bytes_ = 0;
  std::unique_ptr<std::byte, Free> memory_;
  map::Map map_;
};

}  // namespace tactus::test
