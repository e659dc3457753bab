#include "pipeline/segment/segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "pipeline/segment/exponential.hpp"

namespace tactus::segment {
namespace {

// Classes e^-9 = 1/8000 as likely as the best cannot move a byte that rounds at 1/510, even 31 of them
// together.
constexpr float kWeightMin = 1.2e-4F;

std::size_t stage_bytes(const SegmenterConfig& config, int input_width, int input_height) {
  const std::size_t classes = config.class_map->materials.size();
  return ImageResizer::bytes_needed(config.image_width, config.image_height, input_width, input_height) +
         rt::bytes_of<std::uint8_t>(static_cast<std::size_t>(input_width) * 3) +
         rt::bytes_of<std::uint8_t>(3 * 256) + rt::bytes_of<float>(3 * 256) + rt::bytes_of<float>(256) +
         rt::bytes_of<MaterialDistribution>(classes) + rt::bytes_of<float>(classes);
}

rt::Result<void> check(const SegmenterConfig& config) {
  TACTUS_ASSERT(config.model != nullptr && config.class_map != nullptr);
  const auto plan = plan_network(*config.model);
  if (!plan) return plan.error();
  const Tensor& scores = config.model->tensors[static_cast<std::size_t>(plan->scores)];
  const auto classes = static_cast<std::size_t>(scores.shape.channels());
  if (classes != config.class_map->materials.size())
    return rt::Error{rt::ExitCode::bad_usage,
                     config.class_map->file + ": maps " + std::to_string(config.class_map->materials.size()) +
                         " classes, but " + config.model->file + " scores " + std::to_string(classes) +
                         "; give the map that belongs to the network"};
  for (const int length : {config.image_width, config.image_height})
    if (length < 1 || length > 16384)
      return rt::Error{rt::ExitCode::bad_usage, "segment: an image of " + std::to_string(config.image_width) +
                                                    " x " + std::to_string(config.image_height) +
                                                    " pixels is outside 1..16384"};
  const Shape& input = config.model->tensors[static_cast<std::size_t>(plan->input)].shape;
  if (input.width() > 16384 || input.height() > 16384)
    return rt::Error{rt::ExitCode::bad_input, config.model->file + ": its input is larger than 16384 pixels"};
  return {};
}

}  // namespace

rt::Result<std::size_t> Segmenter::bytes_needed(const SegmenterConfig& config) {
  if (auto checked = check(config); !checked) return checked.error();
  auto network = Network::bytes_needed(*config.model);
  if (!network) return network.error();
  const Shape& input = config.model->tensors[static_cast<std::size_t>(config.model->inputs[0])].shape;
  return *network + stage_bytes(config, input.width(), input.height());
}

rt::Result<Segmenter> Segmenter::bind(const SegmenterConfig& config, rt::Slice memory) {
  if (auto checked = check(config); !checked) return checked.error();
  const ClassMap& map = *config.class_map;
  const Shape& input = config.model->tensors[static_cast<std::size_t>(config.model->inputs[0])].shape;
  if (stage_bytes(config, input.width(), input.height()) > memory.bytes_left())
    return rt::Error{rt::ExitCode::bad_usage,
                     "segment: " + std::to_string(memory.bytes_left()) +
                         " bytes are planned, which is too little even without the network"};
  ImageResizer resizer(config.image_width, config.image_height, input.width(), input.height(), memory);
  const auto row = memory.take<std::uint8_t>(static_cast<std::size_t>(input.width()) * 3);
  const auto input_bytes = memory.take<std::uint8_t>(3 * 256);
  const auto input_reals = memory.take<float>(3 * 256);
  const auto exponentials = memory.take<float>(256);
  const auto class_materials = memory.take<MaterialDistribution>(map.materials.size());
  const auto weights = memory.take<float>(map.materials.size());

  auto network = Network::bind(*config.model, memory);  // takes the rest
  if (!network) return network.error();
  Segmenter stage(std::move(*network));
  stage.resizer_ = resizer;
  stage.image_width_ = config.image_width;
  stage.image_height_ = config.image_height;
  stage.is_bgr_ = map.is_bgr;
  stage.inverse_temperature_ = 1.0F / map.temperature;
  stage.row_ = row;
  stage.input_bytes_ = input_bytes;
  stage.input_reals_ = input_reals;
  stage.exponentials_ = exponentials;
  stage.class_materials_ = class_materials;
  stage.weights_ = weights;
  std::copy(map.materials.begin(), map.materials.end(), class_materials.begin());

  const TensorView& in = stage.network_.input();
  const bool is_signed = in.type == ElementType::int8;
  for (std::size_t channel = 0; channel < 3; ++channel)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const double real = (static_cast<double>(byte) - static_cast<double>(map.mean[channel])) /
                          static_cast<double>(map.std[channel]);
      input_reals[channel * 256 + byte] = static_cast<float>(real);
      if (in.type == ElementType::float32) continue;
      const double q =
          std::floor(std::clamp(real / static_cast<double>(in.scale), -1e6, 1e6) + 0.5) + in.zero_point;
      input_bytes[channel * 256 + byte] = static_cast<std::uint8_t>(
          static_cast<std::int32_t>(std::clamp(q, is_signed ? -128.0 : 0.0, is_signed ? 127.0 : 255.0)));
    }
  if (stage.network_.scores().type != ElementType::float32)
    for (std::size_t steps = 0; steps < 256; ++steps)
      exponentials[steps] = exponential(-static_cast<float>(steps) * stage.network_.scores().scale *
                                        stage.inverse_temperature_);
  return stage;
}

rt::Status Segmenter::warm_up(MaterialScores& out) noexcept {
  std::memset(network_.input().bytes.data(), 0, network_.input().bytes.size());
  const rt::Status status = network_.invoke();
  if (status == rt::Status::ok) write_scores(out);
  return status;
}

rt::Status Segmenter::step(std::span<const std::uint8_t> rgb, MaterialScores& out) noexcept {
  write_input(rgb);
  const rt::Status status = network_.invoke();
  if (status != rt::Status::ok) return status;
  write_scores(out);
  return rt::Status::ok;
}

void Segmenter::write_input(std::span<const std::uint8_t> rgb) noexcept {
  TACTUS_ASSERT(rgb.size() ==
                static_cast<std::size_t>(image_width_) * static_cast<std::size_t>(image_height_) * 3);
  const TensorView& in = network_.input();
  const std::size_t row_values = row_.size();
  for (int y = 0; y < in.shape.height(); ++y) {
    resizer_.row(rgb, y, row_);
    std::byte* const to =
        in.bytes.data() + static_cast<std::size_t>(y) * row_values * bytes_per_element(in.type);
    for (std::size_t i = 0; i < row_values; i += 3)
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint8_t value = row_[i + (is_bgr_ ? 2 - channel : channel)];
        if (in.type == ElementType::float32)
          std::memcpy(to + (i + channel) * sizeof(float), &input_reals_[channel * 256 + value],
                      sizeof(float));
        else
          to[i + channel] = static_cast<std::byte>(input_bytes_[channel * 256 + value]);
      }
  }
}

void Segmenter::write_scores(MaterialScores& out) const noexcept {
  const TensorView& scores = network_.scores();
  const auto classes = class_materials_.size();
  const std::size_t pixels = scores.shape.elements_count() / classes;
  TACTUS_ASSERT(out.width == scores_width() && out.height == scores_height());
  TACTUS_ASSERT(out.probability.size() == pixels * kMaterialCount);

  // Image pixel -> network input pixel (the resizer's rule) -> score pixel (the rule of the resize that was
  // cut).
  const auto chain = [](const AxisMap& score, int input, int image) {
    const float ratio = static_cast<float>(input) / static_cast<float>(image);
    return AxisMap{score.scale * ratio, score.scale * (0.5F * ratio - 0.5F) + score.offset};
  };
  out.columns = chain(network_.score_columns(), network_.input().shape.width(), image_width_);
  out.rows = chain(network_.score_rows(), network_.input().shape.height(), image_height_);

  for (std::size_t p = 0; p < pixels; ++p) {
    const std::byte* const at = scores.bytes.data() + p * classes * bytes_per_element(scores.type);
    if (scores.type == ElementType::float32) {
      std::memcpy(weights_.data(), at, classes * sizeof(float));
      float best = weights_[0];
      for (std::size_t c = 1; c < classes; ++c) best = std::max(best, weights_[c]);
      for (std::size_t c = 0; c < classes; ++c)
        weights_[c] = exponential((weights_[c] - best) * inverse_temperature_);
    } else {
      // Offset binary orders both types alike: int8 + 128 and uint8.
      const std::uint8_t flip = scores.type == ElementType::int8 ? 0x80 : 0;
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(at);
      std::uint8_t best = 0;
      for (std::size_t c = 0; c < classes; ++c) best = std::max<std::uint8_t>(best, bytes[c] ^ flip);
      for (std::size_t c = 0; c < classes; ++c)
        weights_[c] = exponentials_[static_cast<std::size_t>(best - (bytes[c] ^ flip))];
    }
    MaterialDistribution mix{};
    float sum = 0;
    for (std::size_t c = 0; c < classes; ++c) {
      const float weight = weights_[c];
      if (!(weight > kWeightMin)) continue;
      sum += weight;
      const MaterialDistribution& materials = class_materials_[c];
      for (std::size_t m = 0; m < kMaterialCount; ++m) mix[m] += weight * materials[m];
    }
    const float to_byte = sum > 0 ? 255.0F / sum : 0.0F;
    std::uint8_t* const to = out.probability.data() + p * kMaterialCount;
    for (std::size_t m = 0; m < kMaterialCount; ++m)
      to[m] = static_cast<std::uint8_t>(mix[m] * to_byte + 0.5F);
  }
}

}  // namespace tactus::segment
