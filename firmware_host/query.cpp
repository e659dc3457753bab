#include "firmware_host/query.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "firmware_host/stored_map.hpp"
#include "firmware_host/summary.hpp"
#include "pipeline/evaluate/text.hpp"
#include "pipeline/map/cell_list.hpp"
#include "pipeline/map/pin_surface.hpp"
#include "pipeline/map/reader.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  std::array<char, 256> line{};
  std::va_list values;
  va_start(values, pattern);
  std::vsnprintf(line.data(), line.size(), pattern, values);
  va_end(values);
  return line.data();
}

rt::Result<std::vector<double>> numbers(const char* option, std::string text, std::size_t count) {
  std::vector<double> values(count);
  const std::string given = text;
  const auto commas = std::count(text.begin(), text.end(), ',');
  std::replace(text.begin(), text.end(), ',', ' ');
  if (static_cast<std::size_t>(commas) + 1 != count || !evaluate::parse_numbers(text, values))
    return rt::Error{rt::ExitCode::bad_usage, std::string(option) + " " + given + ": it reads " +
                                                  std::to_string(count) + " numbers, separated by commas."};
  return values;
}

Vec3f vector_of(const std::vector<double>& values, std::size_t first) {
  return Vec3d{values[first], values[first + 1], values[first + 2]}.cast<float>();
}

const char* name_of(MaterialId id) { return id < kMaterialCount ? kMaterialNames[id].data() : "unknown"; }

json array_of(const Vec3f& v) { return {v.x, v.y, v.z}; }

/// Materials by what `values` says of them, the largest first.
template <typename Value>
std::vector<MaterialId> ranked(std::span<const Value, kMaterialCount> values) {
  std::vector<MaterialId> order(kMaterialCount);
  std::iota(order.begin(), order.end(), MaterialId{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](MaterialId a, MaterialId b) { return values[a] > values[b]; });
  return order;
}

std::string text_of(const map::SurfacePoint& s) {
  const Vec3f &p = s.position_world_m, &n = s.normal_world;
  std::string text = format("surface at %.3f, %.3f, %.3f m, normal %.2f, %.2f, %.2f, colour #%02x%02x%02x\n",
                            static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z),
                            static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z),
                            unsigned{s.color.r}, unsigned{s.color.g}, unsigned{s.color.b});
  if (s.material == kUnknownMaterial) return text + "  never labelled\n";
  text += " ";
  for (const MaterialId id : ranked<float>(s.materials))
    if (s.materials[id] >= 0.005f)
      text += format(" %s %.2f", name_of(id), static_cast<double>(s.materials[id]));
  return text + (s.is_pinned ? " (pinned by hand)" : "") +
         format("; %u keyframes, the last label %u frames before the end\n", unsigned{s.label_observations},
                s.label_age_frames);
}

json json_of(const map::SurfacePoint& s) {
  json materials = json::object();
  for (MaterialId id = 0; id < kMaterialCount; ++id) materials[name_of(id)] = s.materials[id];
  return {{"position_m", array_of(s.position_world_m)},
          {"normal", array_of(s.normal_world)},
          {"color", {s.color.r, s.color.g, s.color.b}},
          {"material", name_of(s.material)},
          {"materials", materials},
          {"is_pinned", s.is_pinned},
          {"observations", s.label_observations},
          {"label_age_frames", s.label_age_frames}};
}

/// The map as a whole: what its surface is made of, as readers see it.
json describe(const map::Map& map) {
  std::array<std::size_t, kMaterialCount + 1> count{};
  std::size_t pinned = 0;
  std::vector<map::SurfaceCell> cells(map::count_surface_cells(map));
  (void)map::gather_surface_cells(map, cells);
  for (const map::SurfaceCell& cell : cells) {
    const MaterialId seen = label::seen_material(cell.word, cell.refined);
    ++count[std::min<std::size_t>(seen, kMaterialCount)];
    pinned += label::is_pinned(cell.refined);
  }
  json materials = json::array();
  for (const MaterialId id : ranked<std::size_t>(std::span(count).first<kMaterialCount>()))
    if (count[id] > 0) materials.push_back({{"material", name_of(id)}, {"cells", count[id]}});
  return {{"voxel_size_m", map.config().voxel_size_m},
          {"blocks", map.blocks_used()},
          {"frame", map.frame_concurrent()},
          {"surface_cells", cells.size()},
          {"unlabelled_cells", count[kMaterialCount]},
          {"pinned_cells", pinned},
          {"materials", materials}};
}

std::string text_of(const json& map) {
  const double cells = std::max<double>(1, map["surface_cells"].get<double>());
  std::string text = format("%.1f cm voxels, %u blocks, %.0f cells of surface after frame %u\n",
                            100 * map["voxel_size_m"].get<double>(), map["blocks"].get<unsigned>(),
                            map["surface_cells"].get<double>(), map["frame"].get<unsigned>());
  for (const json& one : map["materials"])
    text += format("  %5.1f %%  %s\n", 100 * one["cells"].get<double>() / cells,
                   one["material"].get<std::string>().c_str());
  text += format("  %5.1f %%  never labelled\n", 100 * map["unlabelled_cells"].get<double>() / cells);
  if (map["pinned_cells"].get<std::size_t>() > 0)
    text += format("%zu cells are pinned by hand\n", map["pinned_cells"].get<std::size_t>());
  return text;
}

rt::Result<std::size_t> correct(map::Map& map, const map::SurfacePin& pin) {
  const std::size_t bytes = map::SurfacePinner::bytes_needed(map.config());
  auto arena = rt::Arena::reserve(bytes);
  if (!arena) return arena.error();
  rt::Slice memory = arena->carve(bytes);
  map::SurfacePinner pinner;
  pinner.bind(memory, map);
  if (pinner.begin(pin) != rt::Status::ok)
    return rt::Error{rt::ExitCode::bad_usage, "--unset: nothing is pinned at that place."};
  while (pinner.step(100'000) == rt::Status::ok) {
  }
  return pinner.counters().cells;
}

}  // namespace

rt::Result<std::string> query(const QueryOptions& options) {
  const bool has_change = !options.set.empty() || options.is_unset;
  if (options.at && options.ray)
    return rt::Error{rt::ExitCode::bad_usage, "--at and --ray: only one of them can be asked."};
  if (has_change && !options.at && !options.ray)
    return rt::Error{rt::ExitCode::bad_usage, "--set and --unset need --at or --ray, to say which surface."};
  if (!options.set.empty() && options.is_unset)
    return rt::Error{rt::ExitCode::bad_usage, "--set and --unset: only one of them can be done."};
  const MaterialId material = options.set.empty() ? kUnknownMaterial : material_from_name(options.set);
  if (!options.set.empty() && material == kUnknownMaterial)
    return rt::Error{
        rt::ExitCode::bad_usage,
        "--set " + options.set + ": there is no such material; the 23 are those of `tactus query --help`."};
  auto stored = load_map(options.map);
  if (!stored) return stored.error();
  map::Map& map = (*stored)->map;
  if (!options.at && !options.ray) {
    const json whole = describe(map);
    return options.is_json ? to_text(whole) : text_of(whole);
  }

  const map::Reader reader(map);
  map::SurfacePoint point;
  bool is_found = false;
  Vec3f asked;
  if (options.at) {
    const auto at = numbers("--at", *options.at, 3);
    if (!at) return at.error();
    asked = vector_of(*at, 0);
    is_found = reader.nearest_surface(asked, point);
  } else {
    const auto ray = numbers("--ray", *options.ray, 6);
    if (!ray) return ray.error();
    asked = vector_of(*ray, 0);
    if (!(vector_of(*ray, 3).norm() > 0))
      return rt::Error{rt::ExitCode::bad_usage,
                       "--ray " + *options.ray + ": the direction, its last three, is zero."};
    is_found = reader.raycast(asked, vector_of(*ray, 3), options.range_m, point);
  }
  if (!is_found) {
    const std::string nothing =
        !options.at ? format("no surface within %.1f m along that ray", static_cast<double>(options.range_m))
                    : format("no surface within %.0f cm of that place",
                             100.0 * static_cast<double>(reader.truncation_m()));
    if (has_change) return rt::Error{rt::ExitCode::bad_usage, nothing + "."};
    return options.is_json ? to_text(json{{"surface", nullptr}}) : nothing + "\n";
  }
  const float distance_m = (point.position_world_m - asked).norm();
  json answer = {{"surface", json_of(point)}, {"distance_m", distance_m}};
  std::string text = format("%.3f m away: ", static_cast<double>(distance_m)) + text_of(point);
  if (has_change) {
    const auto cells = correct(map, {point.position_world_m, material, options.within_m});
    if (!cells) return cells.error();
    const std::filesystem::path file = options.out.empty() ? map_file_of(options.map) : options.out;
    if (auto saved = save_map(file, map); !saved) return saved.error();
    answer["changed_cells"] = *cells;
    answer["file"] = file.string();
    text += format("%zu cells are %s%s now; ", *cells, options.is_unset ? "as observed" : "pinned to ",
                   options.set.c_str()) +
            file.string() + " is written\n";
  }
  return options.is_json ? to_text(answer) : text;
}

}  // namespace tactus::firmware
