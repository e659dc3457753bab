// A map that a session left behind, in memory of its own.
#pragma once

#include <filesystem>
#include <memory>

#include "pipeline/map/map.hpp"
#include "rt/arena.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct StoredMap {
  rt::Arena arena;
  map::Map map;
};

/// `path`: a map file, or a folder of `tactus run --out` with map.tactus. bad_input when there is none or it
/// is damaged.
rt::Result<std::unique_ptr<StoredMap>> load_map(const std::filesystem::path& path);

/// The file that load_map() would read.
[[nodiscard]] std::filesystem::path map_file_of(const std::filesystem::path& path);

/// Replaces the file in one go: a full disk leaves the old one as it is.
rt::Result<void> save_map(const std::filesystem::path& file, const map::Map& map);

}  // namespace tactus::firmware
