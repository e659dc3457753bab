// Map files: whatever the bytes, an accepted map can be asked everywhere and is written back as it came.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "pipeline/map/map_file.hpp"
#include "pipeline/map/reader.hpp"
#include "rt/assert.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view file(reinterpret_cast<const char*>(data), bytes);
  const auto config = map::read_map_config(file, "fuzz");
  if (!config) {
    TACTUS_ASSERT(config.error().code == rt::ExitCode::bad_input && !config.error().message.empty());
    return 0;
  }
  const std::size_t size = rt::round_up(map::Map::bytes_needed(*config), rt::kCacheLineBytes);
  const std::unique_ptr<std::byte, decltype(&std::free)> memory(
      static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, size)), &std::free);
  map::Map map;
  map.bind(rt::Slice({memory.get(), size}), *config);
  const auto decoded = map::decode_map(file, "fuzz", map);
  if (!decoded)
    TACTUS_ASSERT(decoded.error().code == rt::ExitCode::bad_input && !decoded.error().message.empty());
  // Refused or not, what is in the map by now must be safe to ask.
  const map::Reader reader(map);
  for (std::uint32_t b = 0; b < config->blocks_capacity; ++b) {
    const map::BlockKey key = map.key(static_cast<map::BlockIndex>(b));
    if (key == map::kNoKey) continue;
    const map::BlockCoord c = map::coord_of(key);
    const float side_m = map::kBlockSide * config->voxel_size_m;
    const Vec3f centre =
        Vec3f{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)} * side_m +
        Vec3f{side_m, side_m, side_m} * 0.5F;
    map::SurfacePoint point;
    (void)reader.nearest_surface(centre, point);
    TACTUS_ASSERT(point.material < kMaterialCount || point.material == kUnknownMaterial);
    (void)reader.raycast(centre, {0.3F, -0.5F, 0.8F}, 1, point);
    TACTUS_ASSERT(point.material < kMaterialCount || point.material == kUnknownMaterial);
  }
  if (decoded) TACTUS_ASSERT(map::encode_map(map) == file);
  return 0;
}
