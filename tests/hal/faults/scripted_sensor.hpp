// A sensor whose frames are known by their numbers, and what a reader of it saw.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hal/camera.hpp"

namespace tactus::hal::faults {

inline constexpr int kWidth = 8, kHeight = 4;
inline constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
inline constexpr std::int64_t kFrameNs = 33'333'333;

constexpr rt::SensorTime time_of(std::uint64_t number) { return {static_cast<std::int64_t>(number) * kFrameNs}; }
constexpr rt::HostTime arrival_of(std::uint64_t number) { return {time_of(number).ns + 1'000'000'007}; }

template <typename Pixel>
Pixel pixel_of(std::uint64_t number, std::size_t i) {
  return static_cast<Pixel>(1 + (number * 131 + i * 7) % 251);
}

struct Script {
  std::uint64_t frames_count = 100;
  std::set<std::uint64_t> corrupt = {};  // numbers
  std::set<std::uint64_t> missing = {};  // numbers that the source leaves out
  bool has_arrivals = false;
};

/// Base is DepthCamera or ColorCamera.
template <typename Base, typename Pixel>
class Scripted : public Base {
 public:
  explicit Scripted(Script script) : script_(std::move(script)) {}

  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration) override {
    const std::uint64_t number = to_next();
    if (number >= script_.frames_count) return rt::Status::end_of_stream;
    ++next_;
    if (script_.corrupt.contains(number)) {
      ++counters_.frames_rejected;
      if (counters_.first_rejection.empty()) counters_.first_rejection = "frame " + std::to_string(number);
      return rt::Status::corrupt;
    }
    ++counters_.frames_delivered;
    header = header_of(number);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = pixel_of<Pixel>(number, i);
    show(number);
    return rt::Status::ok;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return counters_; }

 protected:
  std::uint64_t to_next() {
    while (script_.missing.contains(next_)) ++next_;
    return next_;
  }
  [[nodiscard]] FrameHeader header_of(std::uint64_t number) const {
    return {time_of(number), number, script_.has_arrivals ? arrival_of(number) : rt::HostTime{}};
  }
  void show(std::uint64_t number) {
    if (this->tap_ == nullptr) return;
    RawFrame frame;
    frame.header = header_of(number);
    this->tap_->take(sizeof(Pixel) == 2 ? Stream::depth : Stream::color, frame);
  }

  Script script_;
  std::uint64_t next_ = 0;
  CameraCounters counters_;
};

using ScriptedDepth = Scripted<DepthCamera, std::uint16_t>;

class ScriptedColor final : public Scripted<ColorCamera, std::uint8_t> {
 public:
  using Scripted::Scripted;
  rt::Status peek(FrameHeader& header, rt::Duration) override {
    const std::uint64_t number = to_next();
    if (number >= script_.frames_count) return rt::Status::end_of_stream;
    header = header_of(number);
    return rt::Status::ok;
  }
  void skip() override {
    FrameHeader header;
    (void)read({}, header, {});
  }
};

inline Sensor scripted_sensor(const Script& depth = {}, const std::optional<Script>& color = Script{}) {
  Sensor sensor;
  sensor.description = "scripted";
  sensor.calibration.depth = {kWidth, kHeight, 8, 8, 4, 2};
  sensor.calibration.color = sensor.calibration.depth;
  sensor.calibration.registered = true;
  sensor.depth = std::make_unique<ScriptedDepth>(depth);
  sensor.calibration.has_color = color.has_value();
  if (color) sensor.color = std::make_unique<ScriptedColor>(*color);
  return sensor;
}

/// One answer of a camera; of frames also what came with them.
struct Answer {
  rt::Status status = rt::Status::ok;
  FrameHeader header;
  std::uint64_t pixels_hash = 0;

  friend bool operator==(const Answer& a, const Answer& b) {
    return a.status == b.status && a.header.sequence == b.header.sequence && a.header.time == b.header.time &&
           a.header.arrived == b.header.arrived && a.pixels_hash == b.pixels_hash;
  }
};

template <typename Pixel>
std::uint64_t hash_of(std::span<const Pixel> pixels) {
  std::uint64_t hash = 14695981039346656037U;
  for (const Pixel pixel : pixels) hash = (hash ^ pixel) * 1099511628211U;
  return hash;
}
template <typename Pixel>
std::uint64_t true_hash(std::uint64_t number, std::size_t count) {
  std::vector<Pixel> pixels(count);
  for (std::size_t i = 0; i < count; ++i) pixels[i] = pixel_of<Pixel>(number, i);
  return hash_of<Pixel>(pixels);
}
inline std::uint64_t true_depth_hash(std::uint64_t number) { return true_hash<std::uint16_t>(number, kPixels); }
inline std::uint64_t true_color_hash(std::uint64_t number) { return true_hash<std::uint8_t>(number, kPixels * 3); }

/// Every answer to read() up to the end.
template <typename Pixel, typename Camera>
std::vector<Answer> read_all(Camera& camera, std::size_t values_count) {
  std::vector<Answer> answers;
  std::vector<Pixel> pixels(values_count);
  for (;;) {
    Answer answer;
    answer.status = camera.read(pixels, answer.header, rt::Duration{1'000'000'000});
    if (answer.status == rt::Status::end_of_stream) return answers;
    if (answer.status == rt::Status::ok) answer.pixels_hash = hash_of<Pixel>(pixels);
    answers.push_back(answer);
  }
}
inline std::vector<Answer> read_depth(Sensor& sensor) { return read_all<std::uint16_t>(*sensor.depth, kPixels); }
inline std::vector<Answer> read_color(Sensor& sensor) { return read_all<std::uint8_t>(*sensor.color, kPixels * 3); }

/// Numbers of the frames among them.
inline std::vector<std::uint64_t> numbers_of(const std::vector<Answer>& answers) {
  std::vector<std::uint64_t> numbers;
  for (const Answer& answer : answers)
    if (answer.status == rt::Status::ok) numbers.push_back(answer.header.sequence);
  return numbers;
}
inline std::size_t count_of(const std::vector<Answer>& answers, rt::Status status) {
  return static_cast<std::size_t>(
      std::count_if(answers.begin(), answers.end(), [&](const Answer& a) { return a.status == status; }));
}

}  // namespace tactus::hal::faults
