#include "firmware_host/eval_label_metrics.hpp"

#include <nlohmann/json.hpp>
#include <string>

namespace tactus::firmware {

nlohmann::json metrics_json(const evaluate::LabelMetrics& m) {
  nlohmann::json left_out = nlohmann::json::array(), classes = nlohmann::json::object();
  for (std::size_t i = 0; i < kMaterialCount; ++i) {
    const std::string name(kMaterialNames[i]);
    if (m.truth_count[i] == 0)
      left_out.push_back(name);
    else
      classes[name] = {{"samples", m.truth_count[i]}, {"accuracy", m.accuracy[i]}, {"iu", m.iu[i]}};
  }
  return {{"pixel_accuracy", m.pixel_accuracy},
          {"mean_accuracy", m.mean_accuracy},
          {"mean_iu", m.mean_iu},
          {"frequency_weighted_iu", m.frequency_weighted_iu},
          {"labelled_share", m.predicted_share},
          {"classes_left_out", left_out},
          {"classes", classes}};
}

}  // namespace tactus::firmware
