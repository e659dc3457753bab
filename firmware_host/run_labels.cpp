#include "firmware_host/run_labels.hpp"

#include <algorithm>
#include <vector>

#include "pipeline/segment/builtin_class_maps.hpp"

namespace tactus::firmware {
namespace {

std::filesystem::path model_beside(const std::string& source) {
  std::error_code error;
  const auto folder = std::filesystem::weakly_canonical(source, error).parent_path() / "models";
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".tflite") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  // An int8 network before a float one: that is what the time budget is made for.
  const auto int8 = std::find_if(found.begin(), found.end(), [](const std::filesystem::path& path) {
    return path.filename().string().find("int8") != std::string::npos;
  });
  if (int8 != found.end()) return *int8;
  return found.empty() ? std::filesystem::path{} : found.front();
}

rt::Result<segment::ClassMap> class_map_for(const std::filesystem::path& model, const RunSettings& settings) {
  if (!settings.class_map.empty()) return segment::load_class_map(settings.class_map);
  auto beside = model;
  beside.replace_extension(".toml");
  if (std::filesystem::exists(beside)) return segment::load_class_map(beside.string());
  const std::string name = model.filename().string();
  for (const auto& builtin : segment::kBuiltinClassMaps)
    if (name.find(builtin.model_name_part) != std::string::npos)
      return segment::parse_class_map(builtin.toml, std::string("built-in ") + builtin.file);
  return rt::Error{rt::ExitCode::bad_usage, "No class map is known for " + name + ": put one beside it as " +
                                                beside.filename().string() +
                                                " or name it with --set labels.class_map=FILE."};
}

}  // namespace

rt::Result<LabelChoice> choose_labels(const std::string& source, const std::filesystem::path& model,
                                      const RunSettings& settings, const hal::Sensor& sensor) {
  LabelChoice choice;
  if (settings.label_source == LabelSource::off) return choice;
  const bool is_synthetic = source.starts_with("synthetic:");
  if (settings.label_source == LabelSource::truth ||
      (settings.label_source == LabelSource::automatic && model.empty() && is_synthetic)) {
    if (sensor.labels == nullptr)
      return rt::Error{rt::ExitCode::bad_usage,
                       "labels.source = truth: " + source + " does not know its labels."};
    choice.from_source = true;
    choice.name = "exact labels of the source";
    choice.remark =
        "Labels are the source's own exact ones, not a network's; give --model FILE.tflite for a network.";
    return choice;
  }
  const std::filesystem::path file = model.empty() ? model_beside(source) : model;
  if (file.empty()) {
    if (settings.label_source == LabelSource::network)
      return rt::Error{rt::ExitCode::bad_usage, "labels.source = network needs --model FILE.tflite."};
    choice.remark =
        "Nothing is labelled: no network was given (--model FILE.tflite) or found in models/ beside the "
        "source.";
    return choice;
  }
  if (sensor.color == nullptr) {
    choice.remark = "Nothing is labelled: the source has no colour.";
    return choice;
  }
  auto loaded = segment::load_model(file.string());
  if (!loaded) return loaded.error();
  auto map = class_map_for(file, settings);
  if (!map) return map.error();
  choice.model.emplace(std::move(*loaded));
  choice.class_map = std::move(*map);
  choice.name = file.filename().string();
  return choice;
}

}  // namespace tactus::firmware
