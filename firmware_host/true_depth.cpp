#include "firmware_host/true_depth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/image_codec.hpp"
#include "hal/replay/lists.hpp"
#include "hal/replay/recording.hpp"

namespace tactus::firmware {
namespace {

class TrueDepthCamera final : public hal::DepthCamera {
 public:
  TrueDepthCamera(std::unique_ptr<hal::DepthCamera> real, TrueDepth& exact, double unit_m)
      : real_(std::move(real)), exact_(&exact), unit_m_(unit_m) {}

  rt::Status read(std::span<std::uint16_t> depth, hal::FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = real_->read(depth, header, timeout);
    if (status != rt::Status::ok) return status;
    depth_m_.resize(depth.size());
    const auto known = exact_->read(header.sequence, header.time, depth_m_);
    if (!known) return rt::Status::device_lost;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const double raw = *known ? static_cast<double>(depth_m_[i]) / unit_m_ + 0.5 : 0;
      depth[i] = raw < 65535 ? static_cast<std::uint16_t>(raw) : std::uint16_t{0};
    }
    return status;
  }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return real_->counters(); }

 private:
  std::unique_ptr<hal::DepthCamera> real_;
  TrueDepth* exact_;
  double unit_m_;
  std::vector<float> depth_m_;
};

}  // namespace

rt::Result<TrueDepth> TrueDepth::of(const std::string& source, const hal::RigCalibration& rig) {
  TrueDepth exact;
  exact.rig_ = rig;
  if (source.starts_with("synthetic:")) {
    auto options = hal::parse_synthetic_name(source);
    if (!options) return options.error();
    auto scene = std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options->scene));
    exact.renderer_ = std::make_unique<hal::synthetic::FrameRenderer>(std::move(scene), *options);
    return exact;
  }
  const auto list_file = std::filesystem::path(source) / "depth_gt.txt";
  std::error_code error;
  if (!std::filesystem::exists(list_file, error))
    return rt::Error{rt::ExitCode::bad_usage, source + " does not know its exact depth (depth_gt.txt)."};
  std::string text;
  if (auto read = hal::replay::read_file(list_file, hal::replay::kTextBytesMax, text); !read)
    return read.error();
  const auto list = hal::replay::parse_frame_list(text, list_file.string());
  if (!list) return list.error();
  for (const hal::replay::ListEntry& entry : list->entries)
    if (entry.fault == hal::replay::ListEntry::Fault::none)
      exact.files_[entry.time.ns] = std::filesystem::path(source) / entry.path;
  return exact;
}

rt::Result<bool> TrueDepth::read(std::uint64_t depth_sequence, rt::SensorTime time,
                                 std::span<float> depth_m) {
  if (renderer_) {
    renderer_->exact_depth(static_cast<int>(depth_sequence), depth_m);
    for (float& z : depth_m) z = std::isfinite(z) ? z : 0.0f;
    return true;
  }
  const auto found = files_.lower_bound(time.ns - hal::replay::kLabelDistanceMax.ns);
  if (found == files_.end() || found->first > time.ns + hal::replay::kLabelDistanceMax.ns) return false;
  std::string bytes;
  if (auto read = hal::replay::read_file(found->second, hal::replay::kImageBytesMax, bytes); !read)
    return read.error();
  std::vector<std::uint16_t> raw(depth_m.size());
  if (const std::string fault = hal::replay::decode_depth(bytes, rig_.depth.width, rig_.depth.height, raw);
      !fault.empty())
    return rt::Error{rt::ExitCode::bad_input, found->second.string() + ": " + fault};
  for (std::size_t i = 0; i < raw.size(); ++i)
    depth_m[i] = raw[i] == 65535 ? 0.0f : static_cast<float>(raw[i] * rig_.depth_m_per_unit);
  return true;
}

std::unique_ptr<hal::DepthCamera> TrueDepth::camera(std::unique_ptr<hal::DepthCamera> real, TrueDepth& exact,
                                                    const hal::RigCalibration& rig) {
  return std::make_unique<TrueDepthCamera>(std::move(real), exact, rig.depth_m_per_unit);
}

}  // namespace tactus::firmware
