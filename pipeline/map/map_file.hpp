// A map as bytes, to look at it after the session that made it: `tactus run --out` writes it, `tactus query`
// reads it.
//
//   header 48   "tactusMP", version, voxel_size_m, truncation_m, blocks, frame, 0; both hashes of the content
//   block 2504  key, label frame; 512 tsdf int16, 512 weights, 64 colours, 64 label words, 64 refined words
//   of 24 bits
//
// Little-endian; blocks in the order of their keys, so that equal maps are equal files.
#pragma once

#include <string>
#include <string_view>

#include "pipeline/map/map.hpp"
#include "rt/status.hpp"

namespace tactus::map {

/// Phase: exit, when the map rests.
[[nodiscard]] std::string encode_map(const Map& map);

/// What a map must be bound with to hold the file: as many blocks as are in it, at least one. bad_input when
/// the bytes are no map, of another version, or fewer or more than they claim. `name`: of the file, for the
/// sentence. Phase: boot.
rt::Result<MapConfig> read_map_config(std::string_view bytes, const std::string& name);

/// Fills a fresh map that was bound with read_map_config()'s answer. bad_input when a block is not what a map
/// can hold or the hashes differ; the map is then good for nothing. Phase: boot.
rt::Result<void> decode_map(std::string_view bytes, const std::string& name, Map& map);

}  // namespace tactus::map
