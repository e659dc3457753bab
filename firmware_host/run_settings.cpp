#include "firmware_host/run_settings.hpp"

#include <array>
#include <charconv>

#include "firmware_host/first_pose.hpp"
#include "firmware_host/live_source.hpp"
#include "hal/toml/toml_text.hpp"

namespace tactus::firmware {
namespace {

rt::Error wrong(const std::string& where, const std::string& what) {
  return {rt::ExitCode::bad_usage, where + ": " + what};
}

std::optional<Profile> built_in(std::string_view name) {
  for (const Profile& profile : {x86_profile(), headset_profile(), paper_profile()})
    if (profile.name == name) return profile;
  return std::nullopt;
}

// One key: how a text becomes a value of the settings.
struct Key {
  const char* name;
  double min, max;
  void (*set)(RunSettings&, double);
};

constexpr std::array kKeys = {
    Key{"map.blocks_capacity", 256, 65535,
        [](RunSettings& s, double v) {
          s.profile.spine.map.blocks_capacity = static_cast<std::uint32_t>(v);
        }},
    Key{"map.voxel_size_m", 0.004, 0.05,
        [](RunSettings& s, double v) { s.profile.spine.map.voxel_size_m = static_cast<float>(v); }},
    Key{"map.truncation_m", 0.012, 0.2,
        [](RunSettings& s, double v) { s.profile.spine.map.truncation_m = static_cast<float>(v); }},
    Key{"map.free_blocks_min", 0, 8192,
        [](RunSettings& s, double v) { s.profile.spine.evict_free_min = static_cast<std::uint32_t>(v); }},
    Key{"depth.max_m", 0.5, 8.19,
        [](RunSettings& s, double v) { s.profile.spine.depth_m_max = static_cast<float>(v); }},
    Key{"depth.close_panes", 0, 1,
        [](RunSettings& s, double v) { s.profile.spine.closes_panes = v != 0; }},
    Key{"relocalize.keyframes", 2, 1024,
        [](RunSettings& s, double v) {
          s.profile.spine.relocalizer.keyframes_capacity = static_cast<std::uint32_t>(v);
        }},
    Key{"keyframe.every_frames", 1, 1000,
        [](RunSettings& s, double v) { s.profile.keyframes.every_frames = static_cast<std::uint32_t>(v); }},
    Key{"keyframe.gap_min_frames", 1, 1000,
        [](RunSettings& s, double v) { s.profile.keyframes.gap_min_frames = static_cast<std::uint32_t>(v); }},
    Key{"keyframe.wait_max_frames", 0, 1000,
        [](RunSettings& s, double v) {
          s.profile.keyframes.wait_max_frames = static_cast<std::uint32_t>(v);
        }},
    Key{"keyframe.new_share", 0.01, 1,
        [](RunSettings& s, double v) { s.profile.keyframes.new_share = static_cast<float>(v); }},
    Key{"keyframe.weak_share", 0.01, 1,
        [](RunSettings& s, double v) { s.profile.keyframes.weak_share = static_cast<float>(v); }},
    Key{"keyframe.old_share", 0.01, 1,
        [](RunSettings& s, double v) { s.profile.keyframes.old_share = static_cast<float>(v); }},
    Key{"keyframe.weak_observations", 1, 127,
        [](RunSettings& s, double v) {
          s.profile.keyframes.weak_observations = static_cast<std::uint32_t>(v);
        }},
    Key{"keyframe.old_frames", 1, 100000,
        [](RunSettings& s, double v) { s.profile.keyframes.old_frames = static_cast<std::uint32_t>(v); }},
    Key{"keyframe.view_change_share", 0.01, 1,
        [](RunSettings& s, double v) { s.profile.keyframes.view_change_share = static_cast<float>(v); }},
    Key{"keyframe.blur_max_px", 0.1, 100,
        [](RunSettings& s, double v) { s.profile.keyframes.blur_max_px = static_cast<float>(v); }},
    Key{"keyframe.exposure_share", 0, 1,
        [](RunSettings& s, double v) { s.profile.keyframes.exposure_share = static_cast<float>(v); }},
    Key{"threads", 1, 4, [](RunSettings& s, double v) { s.profile.threads_count = static_cast<int>(v); }},
    Key{"bodies", 1, 256,
        [](RunSettings& s, double v) { s.profile.bodies_capacity = static_cast<std::size_t>(v); }},
    Key{"memory.max_mib", 8, 65536,
        [](RunSettings& s, double v) { s.profile.memory_bytes_max = static_cast<std::size_t>(v) << 20; }},
    Key{"trace.records", 64, 1 << 20,
        [](RunSettings& s, double v) { s.profile.trace_records_count = static_cast<std::size_t>(v); }},
};

std::string known_keys() {
  std::string names;
  for (const Key& key : kKeys) names += std::string(names.empty() ? "" : ", ") + key.name;
  return names + ", labels.source, labels.class_map, labels.crf, labels.keyframes, light.toward, sensor.mode";
}

rt::Result<void> apply(RunSettings& settings, const std::string& key, const std::string& text,
                       const std::string& where) {
  if (key == "labels.class_map") {
    settings.class_map = text;
    return {};
  }
  if (key == "light.toward") {
    const auto toward = parse_direction(text);
    if (!toward)
      return wrong(where, "light.toward is three numbers X,Y,Z (world, y up) that are not all zero, not '" + text + "'.");
    settings.light = render::Light{};
    settings.light->toward_world = toward->cast<float>();
    return {};
  }
  if (key == "sensor.mode") {
    const auto mode = parse_mode(text);
    if (!mode) return wrong(where, "sensor.mode is WIDTHxHEIGHT, WIDTHxHEIGHT@HZ or @HZ, not '" + text + "'.");
    settings.profile.sensor_mode = *mode;
    return {};
  }
  if (key == "labels.crf") {
    if (text != "on" && text != "off") return wrong(where, "labels.crf is on or off, not '" + text + "'.");
    settings.profile.refines_labels = text == "on";
    return {};
  }
  if (key == "labels.keyframes") {
    if (text != "every" && text != "adaptive")
      return wrong(where, "labels.keyframes is every or adaptive, not '" + text + "'.");
    settings.profile.keyframes.policy =
        text == "every" ? segment::KeyframePolicy::every : segment::KeyframePolicy::adaptive;
    return {};
  }
  if (key == "labels.source") {
    constexpr std::array<std::pair<std::string_view, LabelSource>, 4> kSources = {
        {{"auto", LabelSource::automatic},
         {"network", LabelSource::network},
         {"truth", LabelSource::truth},
         {"off", LabelSource::off}}};
    for (const auto& [name, source] : kSources)
      if (text == name) {
        settings.label_source = source;
        return {};
      }
    return wrong(where, "labels.source is auto, network, truth or off, not '" + text + "'.");
  }
  for (const Key& known : kKeys) {
    if (key != known.name) continue;
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() ||
        !(value >= known.min && value <= known.max)) {
      std::array<char, 96> range{};
      std::snprintf(range.data(), range.size(), " takes a number from %g to %g, not '", known.min, known.max);
      return wrong(where, key + range.data() + text + "'.");
    }
    known.set(settings, value);
    return {};
  }
  return wrong(where, "there is no key '" + key + "'; known are " + known_keys() + ".");
}

rt::Result<void> apply_file(RunSettings& settings, const std::string& file) {
  const auto content = hal::read_settings_file(file, "settings");
  if (!content) return content.error();
  const auto table = hal::parse_toml(*content, file, rt::ExitCode::bad_usage);
  if (!table) return table.error();
  for (const auto& [group, node] : *table) {
    const auto one = [&](const std::string& key, const toml::node& value) -> rt::Result<void> {
      const std::string where = file + ":" + std::to_string(value.source().begin.line);
      if (const auto number = value.value<double>()) {
        std::array<char, 40> text{};
        std::snprintf(text.data(), text.size(), "%.17g", *number);
        return apply(settings, key, text.data(), where);
      }
      if (const auto text = value.value<std::string>()) return apply(settings, key, *text, where);
      return wrong(where, key + " is neither a number nor a text.");
    };
    if (group.str() == "base") {
      const auto profile = built_in(node.value_or<std::string>(""));
      if (!profile)
        return wrong(file + ":" + std::to_string(node.source().begin.line),
                     "base is \"x86\", \"headset\" or \"paper\".");
      settings.profile = *profile;
    } else if (const toml::table* group_table = node.as_table()) {
      for (const auto& [key, value] : *group_table)
        if (auto set = one(std::string(group.str()) + "." + std::string(key.str()), value); !set)
          return set.error();
    } else if (auto set = one(std::string(group.str()), node); !set) {
      return set.error();
    }
  }
  return {};
}

}  // namespace

const char* settings_help() {
  return "Keys of --set and of a profile file (TOML; base = \"x86\" | \"headset\" | \"paper\" first):\n"
         "  map.blocks_capacity map.voxel_size_m map.truncation_m map.free_blocks_min depth.max_m\n"
         "  relocalize.keyframes threads bodies memory.max_mib trace.records\n"
         "  sensor.mode = WIDTHxHEIGHT@HZ (of a live source that names none)\n"
         "  labels.source = auto | network | truth | off      labels.class_map = FILE.toml\n"
         "  light.toward = X,Y,Z (world, y up; else the light is estimated from the video)\n"
         "  labels.crf = on | off      labels.keyframes = every | adaptive\n"
         "  keyframe.every_frames; of adaptive: keyframe.gap_min_frames .wait_max_frames .new_share "
         ".weak_share\n"
         "  .weak_observations .old_share .old_frames .view_change_share .blur_max_px .exposure_share\n";
}

rt::Result<RunSettings> read_settings(const std::string& profile, std::span<const std::string> settings) {
  RunSettings result;
  result.profile_name = profile;
  if (const auto known = built_in(profile)) {
    result.profile = *known;
  } else if (auto read = apply_file(result, profile); !read) {
    return read.error();
  }
  for (const std::string& setting : settings) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos) return wrong("--set " + setting, "it reads key=value.");
    if (auto set = apply(result, setting.substr(0, equals), setting.substr(equals + 1), "--set"); !set)
      return set.error();
  }
  const map::MapConfig& map = result.profile.spine.map;
  if (!(map.truncation_m >= 3 * map.voxel_size_m))
    return wrong("map.truncation_m", "it must be at least three voxels, or surfaces have holes.");
  return result;
}

}  // namespace tactus::firmware
