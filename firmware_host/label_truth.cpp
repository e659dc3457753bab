#include "firmware_host/label_truth.hpp"

#include <algorithm>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/image_codec.hpp"

namespace tactus::firmware {

rt::Result<LabelTruthImages> LabelTruthImages::in_folder(const std::filesystem::path& folder) {
  LabelTruthImages truth;
  truth.folder_ = folder;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".png") ++truth.images_count_;
  if (error)
    return rt::Error{
        rt::ExitCode::bad_input,
        folder.string() + ": the folder of true labels cannot be read: " + error.message() + "."};
  if (truth.images_count_ == 0)
    return rt::Error{rt::ExitCode::bad_input,
                     folder.string() + ": there is no PNG file of true labels in it."};
  return truth;
}

rt::Result<LabelTruthImages> LabelTruthImages::of_sensor(const std::string& source, hal::Sensor& sensor) {
  if (sensor.labels == nullptr)
    return rt::Error{rt::ExitCode::bad_usage,
                     source + " does not know its labels: name a folder of label images with --truth DIR."};
  if (sensor.calibration.has_color && !sensor.calibration.registered)
    return rt::Error{
        rt::ExitCode::bad_usage,
        source +
            " knows its labels in the depth camera's pixels and colour comes from another camera: "
            "name a folder of label images with --truth DIR."};
  LabelTruthImages truth;
  truth.sensor_labels_ = sensor.labels.get();
  return truth;
}

bool LabelTruthImages::has(const std::string& name) const {
  std::error_code error;
  return sensor_labels_ != nullptr || std::filesystem::exists(folder_ / (name + ".png"), error);
}

rt::Result<void> LabelTruthImages::read(const std::string& name, std::uint64_t depth_sequence, int width,
                                        int height, std::span<MaterialId> ids) const {
  if (sensor_labels_ != nullptr) {
    if (sensor_labels_->read(depth_sequence, ids) != rt::Status::ok)
      return rt::Error{rt::ExitCode::bad_input, "The source's own labels of frame " +
                                                    std::to_string(depth_sequence) + " cannot be read."};
  } else {
    const auto path = folder_ / (name + ".png");
    std::string bytes;
    if (auto read = hal::replay::read_file(path, hal::replay::kImageBytesMax, bytes); !read)
      return read.error();
    if (const std::string fault = hal::replay::decode_label(bytes, width, height, ids); !fault.empty())
      return rt::Error{rt::ExitCode::bad_input, path.string() + ": " + fault};
  }
  const auto wrong = std::find_if(
      ids.begin(), ids.end(), [](MaterialId id) { return id >= kMaterialCount && id != kUnknownMaterial; });
  if (wrong != ids.end())
    return rt::Error{rt::ExitCode::bad_input,
                     (sensor_labels_ != nullptr ? "frame " + name : (folder_ / (name + ".png")).string()) +
                         ": holds the id " + std::to_string(*wrong) +
                         ", and materials have the ids 0 to 22 and 255 for unlabelled."};
  return {};
}

}  // namespace tactus::firmware
