#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <type_traits>

#include "hal/frames/convert.hpp"
#include "hal/frames/decoded_stream.hpp"
#include "hal/openni2/oni_index.hpp"
#include "hal/openni2/openni2.hpp"
#include "hal/openni2/present/assumed_calibration.hpp"
#include "hal/openni2/present/oni_player.hpp"

namespace tactus::hal::openni2 {
namespace {

/// How far apart a colour frame and a depth frame of a pair may lie.
constexpr std::uint64_t kPairDistanceMax_us = 20'000;

struct PlayedFrame {
  OniFrameEntry entry;
  bool is_time_late = true;  // later than the one played before
};

/// The frames [first, end) of one stream, from a player of its own. PixelType is uint16 (depth) or uint8 (colour).
template <typename PixelType>
class OniSource {
 public:
  using Pixel = PixelType;
  struct Config {
    std::filesystem::path file;
    std::vector<PlayedFrame> frames;
    int width = 0, height = 0;
    std::unique_ptr<OniPlayer> player;
  };
  explicit OniSource(Config config) : config_(std::move(config)) {}

  [[nodiscard]] std::size_t pixels_count() const {
    const auto count = static_cast<std::size_t>(config_.width) * static_cast<std::size_t>(config_.height);
    return std::is_same_v<Pixel, std::uint8_t> ? 3 * count : count;
  }

  void peek(frames::FrameOutcome& outcome) { (void)find_next(outcome); }

  void next(std::span<Pixel> pixels, frames::FrameOutcome& outcome) {
    if (!find_next(outcome)) return;
    const OniFrameEntry& entry = config_.frames[next_++].entry;
    outcome.status = rt::Status::corrupt;
    const OniFrame* frame = find_played(entry.number);
    if (frame == nullptr)
      complain(outcome, entry, "OpenNI2 cannot decode it");
    else if (to_pixels(*frame, outcome.header, pixels) != rt::Status::ok)
      complain(outcome, entry, "it is shorter than its size");
    else
      outcome.status = rt::Status::ok;
    // The player is closed as soon as its last frame is here: beyond it, its thread turns round and round.
    if (next_ == config_.frames.size()) config_.player.reset();
  }

 private:
  bool find_next(frames::FrameOutcome& outcome) {
    outcome = {};
    for (; next_ < config_.frames.size() && !config_.frames[next_].is_time_late; ++next_) {
      ++outcome.timestamps_rejected;
      complain(outcome, config_.frames[next_].entry, "its time is not later than the time of the frame before");
    }
    if (next_ == config_.frames.size()) return false;
    const OniFrameEntry& entry = config_.frames[next_].entry;
    outcome.header = {{static_cast<std::int64_t>(entry.time_us) * 1000}, entry.number - std::uint64_t{1}, {}};
    outcome.status = rt::Status::ok;
    return true;
  }

  /// Null: the player passed over it, or is silent.
  const OniFrame* find_played(std::uint32_t number) {
    while (config_.player && (played_ == nullptr || static_cast<std::uint32_t>(played_->frameIndex) < number)) {
      played_ = config_.player->next();
      if (played_ == nullptr) config_.player.reset();
    }
    if (played_ == nullptr || static_cast<std::uint32_t>(played_->frameIndex) != number) return nullptr;
    return played_;
  }

  rt::Status to_pixels(const OniFrame& frame, const FrameHeader& header, std::span<Pixel> pixels) const {
    if (frame.width != config_.width || frame.height != config_.height || frame.stride < 1 || frame.dataSize < 1)
      return rt::Status::corrupt;
    constexpr bool kIsDepth = std::is_same_v<Pixel, std::uint16_t>;
    const RawFrame raw{header,
                       kIsDepth ? PixelFormat::depth16 : PixelFormat::rgb24,
                       frame.width,
                       frame.height,
                       static_cast<std::size_t>(frame.stride),
                       {static_cast<const std::uint8_t*>(frame.data), static_cast<std::size_t>(frame.dataSize)}};
    if constexpr (kIsDepth)
      return frames::to_depth(raw, pixels);
    else
      return frames::to_rgb(raw, pixels);
  }

  void complain(frames::FrameOutcome& outcome, const OniFrameEntry& entry, const char* what) const {
    char sentence[frames::kSentenceBytes];
    std::snprintf(sentence, sizeof sentence, "%.300s: %s frame %u is left out: %s", config_.file.c_str(),
                  std::is_same_v<Pixel, std::uint16_t> ? "depth" : "colour", entry.number - 1, what);
    frames::say(outcome, sentence);
  }

  Config config_;
  std::size_t next_ = 0;
  const OniFrame* played_ = nullptr;  // the player's
};

template <typename CameraKind, typename Pixel>
class OniCamera : public CameraKind {
 public:
  OniCamera(OniSource<Pixel> source, int width, int height, std::size_t prefetch)
      : stream_(std::move(source), prefetch), width_(width), height_(height) {}
  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = stream_.read(pixels, header, timeout);
    if (status == rt::Status::ok) show(pixels, header);
    return status;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }

 protected:
  void show(std::span<const Pixel> pixels, const FrameHeader& header) {
    constexpr Stream kStream = std::is_same_v<Pixel, std::uint16_t> ? Stream::depth : Stream::color;
    if (this->tap_ != nullptr) this->tap_->take(kStream, frames::raw_frame(pixels, header, width_, height_));
  }

  frames::DecodedStream<OniSource<Pixel>> stream_;
  int width_, height_;
};

using OniDepth = OniCamera<DepthCamera, std::uint16_t>;

class OniColor final : public OniCamera<ColorCamera, std::uint8_t> {
 public:
  using OniCamera::OniCamera;
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override { return stream_.peek(header, timeout); }
  void skip() override {
    stream_.skip([this](std::span<const std::uint8_t> rgb, const FrameHeader& header) { show(rgb, header); });
  }
};

std::vector<PlayedFrame> played(std::vector<OniFrameEntry>::const_iterator begin,
                                std::vector<OniFrameEntry>::const_iterator end) {
  std::vector<PlayedFrame> out;
  std::optional<std::uint64_t> last_us;
  for (; begin != end; ++begin) {
    const bool is_late = !last_us || begin->time_us > *last_us;
    if (is_late) last_us = begin->time_us;
    out.push_back({*begin, is_late});
  }
  return out;
}

/// Colour frames within reach of the depth frames that are played; all when the whole file is.
std::vector<PlayedFrame> color_of(const OniStreamIndex& color, const std::vector<PlayedFrame>& depth, bool is_whole) {
  auto begin = color.frames.begin(), end = color.frames.end();
  if (!is_whole) {
    const std::uint64_t first_us = depth.front().entry.time_us, last_us = depth.back().entry.time_us;
    begin = std::find_if(begin, end, [&](const OniFrameEntry& e) { return e.time_us + kPairDistanceMax_us >= first_us; });
    end = std::find_if(begin, end, [&](const OniFrameEntry& e) { return e.time_us > last_us + kPairDistanceMax_us; });
  }
  return played(begin, end);
}

template <typename Pixel>
rt::Result<OniSource<Pixel>> open_source(const std::filesystem::path& file, const OniStreamIndex& stream,
                                         std::vector<PlayedFrame> frames) {
  constexpr bool kIsDepth = std::is_same_v<Pixel, std::uint16_t>;
  const std::size_t bytes =
      frames::packed_bytes(kIsDepth ? PixelFormat::depth16 : PixelFormat::rgb24, stream.width, stream.height);
  auto player = OniPlayer::open(file, kIsDepth ? ONI_SENSOR_DEPTH : ONI_SENSOR_COLOR, bytes);
  if (!player) return player.error();
  return OniSource<Pixel>({file, std::move(frames), stream.width, stream.height, std::move(*player)});
}

}  // namespace

rt::Result<Sensor> open_oni(const std::filesystem::path& file, const OniOptions& options) {
  auto index = read_oni_index(file);
  if (!index) return index.error();
  const OniStreamIndex& depth = *index->depth;
  const auto bad = [&](const std::string& what) {
    return rt::Error{rt::ExitCode::bad_input, file.string() + ": " + what + "."};
  };
  if (depth.pixel_format != kOniDepth1mm && depth.pixel_format != kOniDepth100um)
    return bad("its depth stream is in a format (" + std::to_string(depth.pixel_format) + ") that is not metric");
  Sensor sensor;
  if (index->color && index->color->pixel_format != kOniRgb888) {
    sensor.notes.push_back(file.string() + ": its colour stream is in a format (" +
                           std::to_string(index->color->pixel_format) + ") that is not RGB; depth only");
    index->color.reset();
  }
  const std::uint64_t count = depth.frames.size();
  if (options.first >= std::min(options.last, count))
    return rt::Error{rt::ExitCode::bad_usage,
                     file.string() + ": no frame is in the range asked for; the recording has frames 0 to " +
                         std::to_string(count - 1) + "."};
  const std::uint64_t last = std::min(options.last, count);
  const auto at = [&](std::uint64_t i) { return depth.frames.begin() + static_cast<std::ptrdiff_t>(i); };
  auto depth_frames = played(at(options.first), at(last));
  std::vector<PlayedFrame> color_frames;
  if (index->color) color_frames = color_of(*index->color, depth_frames, options.first == 0 && last == count);
  const bool has_color = !color_frames.empty();
  if (index->color && !has_color)
    sensor.notes.push_back(file.string() + ": no colour frame lies in the time of the depth frames; depth only");

  RigCalibration& rig = sensor.calibration;
  rig.depth_m_per_unit = depth.pixel_format == kOniDepth100um ? 0.0001 : 0.001;
  const SeenFrom depth_seen{depth.width, depth.height, depth.fov_x_rad, depth.fov_y_rad};
  std::optional<SeenFrom> color_seen;
  if (has_color)
    color_seen = SeenFrom{index->color->width, index->color->height, index->color->fov_x_rad, index->color->fov_y_rad};
  assume_calibration(depth_seen, color_seen, depth.sees_from_color, file.string(), rig, sensor.notes);
  if (depth.is_mirrored)
    sensor.notes.push_back(file.string() +
                           ": the images were recorded mirrored, so left and right of the room are exchanged");

  if (index->cut_at)
    sensor.notes.push_back(file.string() + ": cut off at byte " + std::to_string(*index->cut_at) +
                           "; what is whole before that is played");
  sensor.frames_count = depth_frames.size();
  sensor.frame_rate_hz = depth.frame_rate_hz > 0 ? depth.frame_rate_hz : 30;
  sensor.description = file.string() + " (OpenNI2, " + std::to_string(sensor.frames_count) + " frames, " +
                       std::to_string(depth.width) + "x" + std::to_string(depth.height) +
                       (!has_color       ? ", depth only)"
                        : rig.registered ? ", colour registered)"
                                         : ", colour with its own camera)");
  auto depth_source = open_source<std::uint16_t>(file, depth, std::move(depth_frames));
  if (!depth_source) return depth_source.error();
  sensor.depth = std::make_unique<OniDepth>(std::move(*depth_source), depth.width, depth.height, options.prefetch);
  sensor.buffers_bytes = options.prefetch * frames::packed_bytes(PixelFormat::depth16, depth.width, depth.height);
  if (has_color) {
    const int width = index->color->width, height = index->color->height;
    auto color_source = open_source<std::uint8_t>(file, *index->color, std::move(color_frames));
    if (!color_source) return color_source.error();
    sensor.color = std::make_unique<OniColor>(std::move(*color_source), width, height, options.prefetch);
    sensor.buffers_bytes += options.prefetch * frames::packed_bytes(PixelFormat::rgb24, width, height);
  }
  sensor.allocates_in_read = options.prefetch == 0;
  return sensor;
}

}  // namespace tactus::hal::openni2
