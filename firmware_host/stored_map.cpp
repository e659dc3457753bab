#include "firmware_host/stored_map.hpp"

#include <string>
#include <system_error>
#include <utility>

#include "firmware_host/output_file.hpp"
#include "pipeline/evaluate/text.hpp"
#include "pipeline/map/map_file.hpp"

namespace tactus::firmware {

std::filesystem::path map_file_of(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) ? path / "map.tactus" : path;
}

rt::Result<std::unique_ptr<StoredMap>> load_map(const std::filesystem::path& path) {
  const std::filesystem::path file = map_file_of(path);
  const auto bytes = evaluate::read_file(file);
  if (!bytes) return bytes.error();
  const auto config = map::read_map_config(*bytes, file.string());
  if (!config) return config.error();
  auto arena = rt::Arena::reserve(map::Map::bytes_needed(*config));
  if (!arena) return arena.error();
  std::unique_ptr<StoredMap> stored(new StoredMap{std::move(*arena), {}});
  stored->map.bind(stored->arena.carve(map::Map::bytes_needed(*config)), *config);
  if (auto decoded = map::decode_map(*bytes, file.string(), stored->map); !decoded) return decoded.error();
  return stored;
}

rt::Result<void> save_map(const std::filesystem::path& file, const map::Map& map) {
  std::filesystem::path temporary = file;
  temporary += ".part";
  if (auto written = write_file(temporary, map::encode_map(map)); !written) return written.error();
  std::error_code error;
  std::filesystem::rename(temporary, file, error);
  if (error)
    return rt::Error{rt::ExitCode::failed, file.string() + " cannot be replaced: " + error.message() + "."};
  return {};
}

}  // namespace tactus::firmware
