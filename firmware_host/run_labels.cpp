#include "firmware_host/run_labels.hpp"

#include "pipeline/segment/builtin_class_maps.hpp"
#include "pipeline/segment/builtin_network.hpp"

namespace tactus::firmware {
namespace {

constexpr const char* kBuiltin = "builtin";

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

rt::Result<segment::LoadedModel> load_network(const std::filesystem::path& model) {
  if (model != kBuiltin) return segment::load_model(model.string());
  auto read = segment::read_tflite(segment::builtin_network(), std::string(segment::kBuiltinNetworkName));
  if (!read) return read.error();
  return segment::LoadedModel{{}, std::move(*read)};
}

}  // namespace

rt::Result<LabelChoice> choose_labels(const std::string& source, const std::filesystem::path& model,
                                      const RunSettings& settings, const hal::Sensor& sensor) {
  LabelChoice choice;
  if (settings.label_source == LabelSource::off || model == "none") {
    if (model == "none") choice.remark = "Nothing is labelled: --model none.";
    return choice;
  }
  if (settings.label_source == LabelSource::truth || (settings.label_source == LabelSource::automatic &&
                                                      model.empty() && source.starts_with("synthetic:"))) {
    if (sensor.labels == nullptr)
      return rt::Error{rt::ExitCode::bad_usage,
                       "labels.source = truth: " + source + " does not know its labels."};
    choice.from_source = true;
    choice.name = "exact labels of the source";
    choice.remark =
        "Labels are the source's own exact ones, not a network's; give --model builtin or FILE.tflite for a "
        "network.";
    return choice;
  }
  if (sensor.color == nullptr) {
    choice.remark = "Nothing is labelled: the source has no colour.";
    return choice;
  }
  const std::filesystem::path network = model.empty() ? std::filesystem::path(kBuiltin) : model;
  auto loaded = load_network(network);
  if (!loaded) return loaded.error();
  const std::filesystem::path file = network == kBuiltin ? segment::kBuiltinNetworkName : network;
  auto map = class_map_for(file, settings);
  if (!map) return map.error();
  choice.model.emplace(std::move(*loaded));
  choice.class_map = std::move(*map);
  choice.name = file.filename().string();
  return choice;
}

}  // namespace tactus::firmware
