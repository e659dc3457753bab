#include "firmware_host/color_names.hpp"

#include <cstdio>
#include <filesystem>

#include "hal/replay/recording.hpp"

namespace tactus::firmware {

rt::Result<ColorNames> ColorNames::of(const std::string& source) {
  ColorNames names;
  if (source.starts_with("synthetic:")) return names;
  auto recording = hal::replay::has_seven_scenes_frames(source)
                       ? hal::replay::read_seven_scenes_folder(source)
                       : hal::replay::read_tum_folder(source);
  if (!recording) return recording.error();
  if (!recording->color) return names;
  for (const hal::replay::ListEntry& entry : recording->color->entries)
    names.names_[entry.sequence] = std::filesystem::path(entry.path).stem().string();
  return names;
}

std::string ColorNames::name(std::uint64_t sequence) const {
  if (const auto found = names_.find(sequence); found != names_.end()) return found->second;
  char text[32];
  std::snprintf(text, sizeof(text), "%06llu", static_cast<unsigned long long>(sequence));
  return text;
}

}  // namespace tactus::firmware
