// A spine on a synthetic room: what the program does with a frame, without the rest of the program.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "pipeline/spine.hpp"
#include "rt/worker_pool.hpp"

namespace tactus::test {

class Session {
 public:
  /// The first pose is the true one, so that poses compare without alignment.
  explicit Session(const std::string& source, int threads_count = 1, SpineConfig config = SpineConfig{}) {
    auto options = hal::parse_synthetic_name(source);
    auto opened = hal::open_synthetic(*options);
    sensor_ = std::move(*opened);
    if (threads_count > 1)
      is_started_ = pool_.start(threads_count, rt::ThreadSpec{.name = "lane"}).has_value();
    const auto pixels = static_cast<std::size_t>(sensor_.calibration.depth.width) *
                        static_cast<std::size_t>(sensor_.calibration.depth.height);
    raw_.resize(pixels);
    rgb_.resize(static_cast<std::size_t>(sensor_.calibration.color.width) *
                static_cast<std::size_t>(sensor_.calibration.color.height) * 3);
    const rt::Slice map_memory = allocate(map_memory_, map::Map::bytes_needed(config.map));
    const rt::Slice memory = allocate(memory_, Spine::bytes_needed(sensor_.calibration, config));
    spine.bind(map_memory, memory, sensor_.calibration, config, sensor_.truth.front().T_world_depth, pool_);
  }

  /// One frame through all stages, after so many that are lost on the way; false when the recording is over.
  bool step(int missing_count = 0) {
    hal::FrameHeader header;
    for (int i = 0; i < missing_count; ++i) {
      if (sensor_.depth->read(raw_, header, {}) != rt::Status::ok) return false;
      if (sensor_.color->read(rgb_, header, {}) != rt::Status::ok) return false;
    }
    missing_count_ += missing_count;
    if (sensor_.depth->read(raw_, header, {}) != rt::Status::ok) return false;
    if (sensor_.color->read(rgb_, header, {}) != rt::Status::ok) return false;
    status_registered = spine.register_frame(raw_, rgb_);
    status = spine.track(1 + missing_count);
    static_cast<void>(spine.integrate());
    static_cast<void>(spine.predict());
    poses.push_back(spine.result().T_world_depth);
    return true;
  }

  [[nodiscard]] int frame() const { return static_cast<int>(poses.size()) - 1 + missing_count_; }
  [[nodiscard]] const T_WorldDepth& truth(int i) const {
    return sensor_.truth[static_cast<std::size_t>(i)].T_world_depth;
  }
  /// Of the newest pose from the true one.
  [[nodiscard]] double error_m() const {
    return (poses.back().translation - truth(frame()).translation).norm();
  }
  [[nodiscard]] bool is_started() const { return is_started_; }

  Spine spine;
  rt::Status status_registered = rt::Status::ok, status = rt::Status::ok;
  std::vector<T_WorldDepth> poses;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  static rt::Slice allocate(std::unique_ptr<std::byte, Free>& memory, std::size_t bytes) {
    bytes = rt::round_up(bytes, 64);
    memory.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes)));
    return rt::Slice({memory.get(), bytes});
  }
  hal::Sensor sensor_;
  rt::WorkerPool pool_;
  bool is_started_ = true;
  int missing_count_ = 0;
  std::unique_ptr<std::byte, Free> map_memory_, memory_;
  std::vector<std::uint16_t> raw_;
  std::vector<std::uint8_t> rgb_;
};

/// FNV-1a over the poses' bits.
inline std::uint64_t hash_of(const std::vector<T_WorldDepth>& poses) {
  std::uint64_t hash = 14695981039346656037ULL;
  const auto mix = [&](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int byte = 0; byte < 8; ++byte) hash = (hash ^ (bits >> (8 * byte) & 255)) * 1099511628211ULL;
  };
  for (const auto& pose : poses) {
    for (const double m : pose.rotation.m) mix(m);
    mix(pose.translation.x);
    mix(pose.translation.y);
    mix(pose.translation.z);
  }
  return hash;
}

}  // namespace tactus::test
