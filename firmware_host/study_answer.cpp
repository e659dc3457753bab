#include "firmware_host/study_answer.hpp"

#include <nlohmann/json.hpp>

#include "firmware_host/machine.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {

rt::Result<std::string> study_answer(const StudyOptions& options, const StudySets& sets, const std::string& name,
                                     std::string text, const nlohmann::json& json_sets) {
  for (const std::string& remark : sets.remarks) text += remark + "\n";
  const std::string json = to_text({{"command", options.command},
                                    {"sets", json_sets},
                                    {"left_out", sets.remarks},
                                    {"revision", revision()}});
  if (!options.out.empty()) {
    if (auto made = make_study_folder(options.out); !made) return made.error();
    if (auto wrote = write_file(options.out / (name + ".json"), json); !wrote) return wrote.error();
  }
  return options.is_json ? json : text;
}

}  // namespace tactus::firmware
