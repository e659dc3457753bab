// How right a network is on labelled pictures, through the program's own int8 path: the tool behind
// `tactus_model.py evaluate`.
//
//   network_accuracy MODEL.tflite|builtin CLASS_MAP.toml|builtin PAIRS.txt [--predictions DIR]
//
// PAIRS.txt: one "IMAGE<tab>LABEL" a line; labels are 8-bit PNGs of material ids, 255 unknown. Prints one
// JSON object: the four metrics of the paper (classes that the truth does not hold are left out of the
// means), accuracy and IU per class, the expected calibration error, and processor time per picture.
// --predictions writes the likeliest material of every pixel, one PNG per picture. Exit codes as the
// program's: 2 bad usage, 3 bad data.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/evaluate/labels.hpp"
#include "pipeline/segment/builtin_class_maps.hpp"
#include "pipeline/segment/builtin_network.hpp"
#include "pipeline/segment/segmenter.hpp"

namespace {

using tactus::kMaterialCount;
using tactus::kMaterialNames;
using tactus::rt::Error;
using tactus::rt::ExitCode;
using tactus::rt::Result;
namespace segment = tactus::segment;

struct Pair {
  std::string image, label;
};

Result<std::vector<Pair>> read_pairs(const std::string& path) {
  std::ifstream in(path);
  if (!in) return Error{ExitCode::bad_input, path + ": cannot be read."};
  std::vector<Pair> pairs;
  for (std::string line; std::getline(in, line);) {
    if (line.empty()) continue;
    const auto tab = line.find('\t');
    if (tab == std::string::npos)
      return Error{ExitCode::bad_input,
                   path + ":" + std::to_string(pairs.size() + 1) + ": needs IMAGE<tab>LABEL."};
    pairs.push_back({line.substr(0, tab), line.substr(tab + 1)});
  }
  if (pairs.empty()) return Error{ExitCode::bad_input, path + ": names no pictures."};
  return pairs;
}

double processor_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// The segment stage for pictures of one size, with the memory that it runs in.
struct Bound {
  std::vector<std::byte> memory, out_memory;
  std::optional<segment::Segmenter> stage;
  segment::MaterialScores scores;
};

/// A vector's memory as a slice that starts at a cache line.
tactus::rt::Slice aligned(std::vector<std::byte>& memory, std::size_t bytes) {
  memory.resize(bytes + tactus::rt::kCacheLineBytes);
  void* at = memory.data();
  std::size_t space = memory.size();
  std::align(tactus::rt::kCacheLineBytes, bytes, at, space);
  return tactus::rt::Slice({static_cast<std::byte*>(at), bytes});
}

Result<void> bind(Bound& bound, const segment::SegmenterConfig& config) {
  const auto bytes = segment::Segmenter::bytes_needed(config);
  if (!bytes) return bytes.error();
  auto stage = segment::Segmenter::bind(config, aligned(bound.memory, *bytes));
  if (!stage) return stage.error();
  bound.stage.emplace(std::move(*stage));
  const int width = bound.stage->scores_width(), height = bound.stage->scores_height();
  auto slice = aligned(bound.out_memory, segment::MaterialScores::bytes_needed(width, height));
  bound.scores = segment::MaterialScores::take(slice, width, height);
  return {};
}

/// How sure the winner is and how often it is right, in 15 equal bins (Guo et al. 2017).
struct Calibration {
  static constexpr int kBins = 15;
  std::array<double, kBins> confidence{}, right{};
  std::array<std::uint64_t, kBins> count{};

  void add(float p, bool is_right) {
    const auto bin = static_cast<std::size_t>(std::min(static_cast<int>(p * kBins), kBins - 1));
    confidence[bin] += static_cast<double>(p);
    right[bin] += is_right ? 1 : 0;
    ++count[bin];
  }
  [[nodiscard]] double expected_error() const {
    double error = 0, total = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      error += std::abs(confidence[i] - right[i]);
      total += static_cast<double>(count[i]);
    }
    return total > 0 ? error / total : 0;
  }
};

struct Tally {
  tactus::evaluate::ConfusionMatrix confusion;
  Calibration calibration;
  std::vector<double> ms;
};

Result<void> score(const Pair& pair, const segment::Model& model, const segment::ClassMap& map,
                   std::map<std::pair<int, int>, Bound>& stages, const std::string& predictions,
                   Tally& tally) {
  const cv::Mat image = cv::imread(pair.image, cv::IMREAD_COLOR);
  if (image.empty()) return Error{ExitCode::bad_input, pair.image + ": cannot be read as a picture."};
  const cv::Mat label = cv::imread(pair.label, cv::IMREAD_GRAYSCALE);
  if (label.empty()) return Error{ExitCode::bad_input, pair.label + ": cannot be read as a picture."};
  if (image.size() != label.size())
    return Error{ExitCode::bad_input, pair.label + ": is " + std::to_string(label.cols) + "x" +
                                          std::to_string(label.rows) + ", but its picture is " +
                                          std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                                          "."};
  Bound& bound = stages[{image.cols, image.rows}];
  if (!bound.stage) {
    if (auto made = bind(bound, {&model, &map, image.cols, image.rows}); !made) return made.error();
    if (bound.stage->warm_up(bound.scores) != tactus::rt::Status::ok)
      return Error{ExitCode::failed, "The network cannot be run."};
  }
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.total() * 3);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const auto& bgr = image.at<cv::Vec3b>(y, x);
      rgb.insert(rgb.end(), {bgr[2], bgr[1], bgr[0]});
    }
  const double start_ms = processor_ms();
  if (bound.stage->step(rgb, bound.scores) != tactus::rt::Status::ok)
    return Error{ExitCode::failed, pair.image + ": the network failed."};
  tally.ms.push_back(processor_ms() - start_ms);

  cv::Mat best(image.rows, image.cols, CV_8U);
  tactus::MaterialDistribution p;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      bound.scores.sample(static_cast<float>(x), static_cast<float>(y), p);
      const auto winner = static_cast<std::uint8_t>(std::max_element(p.begin(), p.end()) - p.begin());
      best.at<std::uint8_t>(y, x) = winner;
      const std::uint8_t truth = label.at<std::uint8_t>(y, x);
      tally.confusion.add(truth, winner);
      if (truth < kMaterialCount) tally.calibration.add(p[winner], winner == truth);
    }
  if (!predictions.empty()) {
    const auto file =
        std::filesystem::path(predictions) / std::filesystem::path(pair.image).stem().concat(".png");
    if (!cv::imwrite(file.string(), best))
      return Error{ExitCode::bad_usage, file.string() + ": cannot be written."};
  }
  return {};
}

std::string json_of(Tally& tally) {
  const auto m = tactus::evaluate::label_metrics(tally.confusion);
  std::sort(tally.ms.begin(), tally.ms.end());
  nlohmann::json classes = nlohmann::json::object();
  for (std::size_t i = 0; i < kMaterialCount; ++i)
    if (m.truth_count[i] > 0)
      classes[std::string(kMaterialNames[i])] = {
          {"share", static_cast<double>(m.truth_count[i]) / static_cast<double>(m.pixels_count)},
          {"accuracy", m.accuracy[i]},
          {"iu", m.iu[i]}};
  return nlohmann::json{{"pictures", tally.ms.size()},
                        {"pixels", m.pixels_count},
                        {"pixel_accuracy", m.pixel_accuracy},
                        {"mean_accuracy", m.mean_accuracy},
                        {"mean_iu", m.mean_iu},
                        {"frequency_weighted_iu", m.frequency_weighted_iu},
                        {"expected_calibration_error", tally.calibration.expected_error()},
                        {"processor_ms_p50", tally.ms[tally.ms.size() / 2]},
                        {"processor_ms_min", tally.ms.front()},
                        {"classes", classes}}
      .dump(1);
}

Result<std::string> evaluate(const std::string& model_file, const std::string& map_file,
                             const std::string& pairs_file, const std::string& predictions) {
  auto pairs = read_pairs(pairs_file);
  if (!pairs) return pairs.error();
  std::optional<segment::LoadedModel> loaded;
  if (model_file == "builtin") {
    auto model = segment::read_tflite(segment::builtin_network(), std::string(segment::kBuiltinNetworkName));
    if (!model) return model.error();
    loaded.emplace(segment::LoadedModel{{}, std::move(*model)});
  } else {
    auto model = segment::load_model(model_file);
    if (!model) return model.error();
    loaded.emplace(std::move(*model));
  }
  const auto map = map_file == "builtin"
                       ? segment::parse_class_map(segment::kBuiltinClassMaps[0].toml, "built-in map")
                       : segment::load_class_map(map_file);
  if (!map) return map.error();
  if (!predictions.empty()) {
    std::error_code error;
    std::filesystem::create_directories(predictions, error);
    if (error) return Error{ExitCode::bad_usage, predictions + ": " + error.message() + "."};
  }
  Tally tally;
  std::map<std::pair<int, int>, Bound> stages;
  for (const Pair& pair : *pairs)
    if (auto scored = score(pair, loaded->model, *map, stages, predictions, tally); !scored)
      return scored.error();
  return json_of(tally);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool has_predictions = arguments.size() == 5 && arguments[3] == "--predictions";
  if (arguments.size() != 3 && !has_predictions) {
    std::fputs(
        "usage: network_accuracy MODEL.tflite|builtin CLASS_MAP.toml|builtin PAIRS.txt [--predictions DIR]\n",
        stderr);
    return static_cast<int>(ExitCode::bad_usage);
  }
  const auto result = evaluate(arguments[0], arguments[1], arguments[2], has_predictions ? arguments[4] : "");
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return static_cast<int>(result.error().code);
  }
  std::printf("%s\n", result->c_str());
  return 0;
}
