#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hal/frames/convert.hpp"
#include "hal/frames/decoded_stream.hpp"
#include "hal/replay/file_bytes.hpp"
#include "hal/replay/frame_source.hpp"
#include "hal/replay/gravity_file.hpp"
#include "hal/replay/image_codec.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "hal/replay/recording.hpp"
#include "hal/replay/replay.hpp"
#include "hal/replay/text.hpp"

namespace tactus::hal {
namespace replay {
namespace {

class ReplayDepthCamera final : public DepthCamera {
 public:
  ReplayDepthCamera(FrameSource<std::uint16_t> source, const Intrinsics& k, std::size_t prefetch)
      : stream_(std::move(source), prefetch), width_(k.width), height_(k.height) {}
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = stream_.read(depth, header, timeout);
    if (status == rt::Status::ok && tap_ != nullptr)
      tap_->take(Stream::depth, frames::raw_frame(depth, header, width_, height_));
    return status;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }

 private:
  frames::DecodedStream<FrameSource<std::uint16_t>> stream_;
  int width_, height_;
};

class ReplayColorCamera final : public ColorCamera {
 public:
  ReplayColorCamera(FrameSource<std::uint8_t> source, const Intrinsics& k, std::size_t prefetch)
      : stream_(std::move(source), prefetch), width_(k.width), height_(k.height) {}
  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = stream_.read(rgb, header, timeout);
    if (status == rt::Status::ok) show(rgb, header);
    return status;
  }
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override { return stream_.peek(header, timeout); }
  void skip() override {
    stream_.skip([this](std::span<const std::uint8_t> rgb, const FrameHeader& header) { show(rgb, header); });
  }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }

 private:
  void show(std::span<const std::uint8_t> rgb, const FrameHeader& header) {
    if (tap_ != nullptr) tap_->take(Stream::color, frames::raw_frame(rgb, header, width_, height_));
  }

  frames::DecodedStream<FrameSource<std::uint8_t>> stream_;
  int width_, height_;
};

/// Labels by the depth frame's sequence number. Decodes on the caller's thread and allocates: for evaluation.
class ReplayLabels final : public LabelTruth {
 public:
  struct Item {
    std::uint64_t sequence;
    std::filesystem::path path;
  };
  ReplayLabels(std::vector<Item> items, int width, int height)
      : items_(std::move(items)), width_(width), height_(height) {}

  /// ok | skipped (no label for this frame) | corrupt (the file is missing or no 8-bit PNG of the depth's
  /// size, or holds ids that are neither a material nor 255).
  rt::Status read(std::uint64_t sequence, std::span<std::uint8_t> ids) override {
    const auto item = std::lower_bound(items_.begin(), items_.end(), sequence,
                                       [](const Item& i, std::uint64_t s) { return i.sequence < s; });
    if (item == items_.end() || item->sequence != sequence) return rt::Status::skipped;
    if (!read_file(item->path, kImageBytesMax, bytes_)) return rt::Status::corrupt;
    if (!decode_label(bytes_, width_, height_, ids).empty()) return rt::Status::corrupt;
    constexpr std::uint8_t kIdsCount = 23,
                           kUnknown = 255;  // the frozen MINC ids; hal does not know what they mean
    const bool all_known =
        std::all_of(ids.begin(), ids.end(), [](std::uint8_t id) { return id < kIdsCount || id == kUnknown; });
    return all_known ? rt::Status::ok : rt::Status::corrupt;
  }

 private:
  std::vector<Item> items_;  // by sequence
  int width_, height_;
  std::string bytes_;
};

struct Range {
  std::size_t first = 0, end = 0;
};

/// Entries with sequence numbers in [first, last).
Range range_of(const FrameList& list, std::uint64_t first, std::uint64_t last) {
  const auto begin = list.entries.begin();
  const auto before = [](const ListEntry& e, std::uint64_t s) { return e.sequence < s; };
  return {static_cast<std::size_t>(std::lower_bound(begin, list.entries.end(), first, before) - begin),
          static_cast<std::size_t>(std::lower_bound(begin, list.entries.end(), last, before) - begin)};
}

/// The first entry in the range whose file claims to be a usable image, with what it claims. A size of 0 x 0
/// accepts any. Error: no entry does; says what is wrong with the first.
struct FirstImage {
  std::size_t index = 0;
  int width = 0, height = 0;
};
rt::Result<FirstImage> find_first_image(const std::filesystem::path& directory, const FrameList& list,
                                        Range range, ImageUse use, int width, int height) {
  constexpr std::size_t kHeadBytes = 1 << 20;  // a JPEG may carry a thumbnail and a profile before its size
  std::string head;
  std::optional<rt::Error> first_fault;
  std::size_t tried_count = 0;
  for (std::size_t i = range.first; i < range.end; ++i) {
    if (list.entries[i].fault != ListEntry::Fault::none) continue;
    ++tried_count;
    const auto path = directory / list.entries[i].path;
    std::optional<rt::Error> fault;
    if (auto read = read_file(path, kHeadBytes, head, true); !read) {
      fault = read.error();
    } else if (auto header = parse_image_header(head); !header) {
      fault = bad_input(path.string(), 0, header.error().message);
    } else if (auto what = fault_of(*header, use, width, height); !what.empty()) {
      fault = bad_input(path.string(), 0, what);
    } else {
      return FirstImage{i, static_cast<int>(header->width), static_cast<int>(header->height)};
    }
    if (!first_fault) first_fault = fault;
  }
  if (!first_fault)
    return bad_input((directory / list.file).string(), 0, "no frame in the range has a usable time");
  if (tried_count > 1)
    first_fault->message +=
        "; none of the other " + std::to_string(tried_count - 1) + " frames is usable either";
  return *first_fault;
}

std::optional<T_WorldDepth> truth_at(const std::vector<TruthPose>& truth, rt::SensorTime time) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), time,
                                      [](const TruthPose& pose, rt::SensorTime t) { return pose.time < t; });
  const TruthPose* best = nullptr;
  std::int64_t best_distance = kPairDistanceMax.ns + 1;
  if (after != truth.begin()) {
    best_distance = time.ns - (after - 1)->time.ns;
    best = &*(after - 1);
  }
  if (after != truth.end() && after->time.ns - time.ns < best_distance) {
    best_distance = after->time.ns - time.ns;
    best = &*after;
  }
  if (best == nullptr || best_distance > kPairDistanceMax.ns) return std::nullopt;
  return best->T_world_depth;
}

/// Gravity in the depth frame of the first frame played, by the best source that can say it.
std::optional<Vec3d> resolve_gravity(const Recording& recording, std::size_t played_index,
                                     std::vector<std::string>& notes) {
  const auto& entries = recording.depth.entries;
  const rt::SensorTime played_time = entries[played_index].time;
  const auto played_pose = truth_at(recording.truth, played_time);
  if (recording.gravity_first_depth) {
    std::size_t first = 0;
    while (entries[first].fault != ListEntry::Fault::none) ++first;
    if (first == played_index) return recording.gravity_first_depth;
    const auto first_pose = truth_at(recording.truth, entries[first].time);
    if (played_pose && first_pose)
      return (played_pose->rotation.transposed() * (first_pose->rotation * *recording.gravity_first_depth))
          .normalized();
    notes.push_back(
        "gravity.txt holds for the recording's first frame, which is not played, and no true pose leads "
        "from it to the first that is; gravity is unknown");
  }
  if (recording.gravity_truth_world) {
    if (played_pose)
      return (played_pose->rotation.transposed() * *recording.gravity_truth_world).normalized();
    notes.push_back(
        "gravity-direction.txt is in the world of the poses, and the first frame has none; gravity is "
        "unknown");
  }
  if (!recording.accelerometer_text.empty()) {
    if (auto gravity = gravity_from_accelerometer(recording.accelerometer_text, played_time)) return gravity;
    notes.push_back("accelerometer.txt has no quiet samples near the first frame; gravity is unknown");
  }
  return std::nullopt;
}

/// Mean distance of the times as a rate, without the distances that hide lost frames (beyond 1.5 times the
/// median); whole when within 1 % of it.
double frame_rate_of(const FrameList& list) {
  std::vector<std::int64_t> gaps;
  std::optional<std::int64_t> before;
  for (const ListEntry& entry : list.entries) {
    if (entry.fault != ListEntry::Fault::none) continue;
    if (before) gaps.push_back(entry.time.ns - *before);
    before = entry.time.ns;
  }
  constexpr double kAssumedHz = 30;
  if (gaps.empty()) return kAssumedHz;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  const std::int64_t longest_ns = *middle + *middle / 2;
  double sum_ns = 0;
  double count = 0;
  for (const std::int64_t gap : gaps)
    if (gap <= longest_ns) {
      sum_ns += static_cast<double>(gap);
      count += 1;
    }
  const double rate_hz = 1e9 * count / sum_ns;
  const double whole_hz = std::round(rate_hz);
  return std::fabs(rate_hz - whole_hz) <= 0.01 * rate_hz ? whole_hz : rate_hz;
}

/// Colour entries to play with depth entries `played`: all, or those within kPairDistanceMax of the cut ends.
Range color_range(const FrameList& depth, Range played, const FrameList& color) {
  const auto good = [](const ListEntry& e) { return e.fault == ListEntry::Fault::none; };
  std::int64_t begin_ns = std::numeric_limits<std::int64_t>::min(),
               end_ns = std::numeric_limits<std::int64_t>::max();
  if (played.first > 0)
    for (std::size_t i = played.first; i < played.end; ++i)
      if (good(depth.entries[i])) {
        begin_ns = depth.entries[i].time.ns - kPairDistanceMax.ns;
        break;
      }
  if (played.end < depth.entries.size())
    for (std::size_t i = played.end; i-- > played.first;)
      if (good(depth.entries[i])) {
        end_ns = depth.entries[i].time.ns + kPairDistanceMax.ns;
        break;
      }
  Range out{0, 0};
  bool found = false;
  for (std::size_t i = 0; i < color.entries.size(); ++i) {
    const ListEntry& entry = color.entries[i];
    if (!good(entry) || entry.time.ns < begin_ns || entry.time.ns > end_ns) continue;
    if (!found) out.first = i;
    found = true;
    out.end = i + 1;
  }
  // Faulty entries at the very ends of an uncut list are played too, so that they are counted.
  if (found && played.first == 0) out.first = 0;
  if (found && played.end == depth.entries.size()) out.end = color.entries.size();
  return out;
}

void note_jumps(const Recording& recording, const FrameList& list, std::vector<std::string>& notes) {
  if (list.jumps.empty()) return;
  const TimeJump& jump = list.jumps.front();
  const std::string file = (recording.directory / list.file).string();
  notes.push_back(file + ": time jumps forward " + std::to_string(list.jumps.size()) +
                  " times by a second or more, first by " + std::to_string(jump.gap.seconds()) +
                  " s before frame " + std::to_string(jump.sequence));
}

rt::Result<Sensor> build(Recording recording, const ReplayOptions& options) {
  Sensor out;
  out.notes = std::move(recording.notes);
  RigCalibration& rig = recording.calibration;
  const auto& directory = recording.directory;
  const Range played = range_of(recording.depth, options.first, options.last);
  if (played.first >= played.end) {
    const auto& entries = recording.depth.entries;
    return rt::Error{rt::ExitCode::bad_usage,
                     directory.string() + ": no frame is in the range asked for; the recording has frames " +
                         std::to_string(entries.front().sequence) + " to " +
                         std::to_string(entries.back().sequence)};
  }

  auto first = find_first_image(directory, recording.depth, played, ImageUse::depth, rig.depth.width,
                                rig.depth.height);
  if (!first) return first.error();
  if (rig.depth.width == 0) {
    rig.depth.width = first->width;
    rig.depth.height = first->height;
    if (const std::string fault = fault_of(rig.depth); !fault.empty())
      return bad_input((directory / "camera-intrinsics.txt").string(), 0, fault);
  }
  if (rig.registered) rig.color = rig.depth;

  out.frames_count = played.end - played.first;
  out.frame_rate_hz = frame_rate_of(recording.depth);
  out.gravity_depth = resolve_gravity(recording, first->index, out.notes);
  out.truth = std::move(recording.truth);
  note_jumps(recording, recording.depth, out.notes);

  std::optional<FrameSource<std::uint8_t>> color_source;
  if (recording.color) {
    if (!rig.registered && !rig.has_color)
      return bad_input(directory.string(), 0,
                       "holds colour images, but its calibration says nothing of the colour camera; add it "
                       "or set registered");
    const Range range = color_range(recording.depth, played, *recording.color);
    if (range.first == range.end) {
      out.notes.push_back(directory.string() +
                          ": no colour frame lies in the time of the depth frames; depth only");
    } else {
      auto image = find_first_image(directory, *recording.color, range, ImageUse::color, rig.color.width,
                                    rig.color.height);
      if (!image) return image.error();
      note_jumps(recording, *recording.color, out.notes);
      const TimeIndex index(*recording.color);
      std::uint64_t alone_count = 0;
      for (std::size_t i = played.first; i < played.end; ++i) {
        const ListEntry& entry = recording.depth.entries[i];
        if (entry.fault == ListEntry::Fault::none && !index.nearest(entry.time, kPairDistanceMax))
          ++alone_count;
      }
      if (alone_count > 0)
        out.notes.push_back(std::to_string(alone_count) + " depth frames have no colour frame within 20 ms");
      color_source.emplace(FrameSource<std::uint8_t>::Config{
          directory, std::move(*recording.color), range.first, range.end, rig.color.width, rig.color.height});
    }
  }
  rig.has_color = color_source.has_value();

  if (recording.labels) {
    const TimeIndex index(*recording.labels);
    std::vector<ReplayLabels::Item> items;
    for (std::size_t i = played.first; i < played.end; ++i) {
      const ListEntry& entry = recording.depth.entries[i];
      if (entry.fault != ListEntry::Fault::none) continue;
      if (const auto label = index.nearest(entry.time, kLabelDistanceMax))
        items.push_back({entry.sequence, directory / recording.labels->entries[*label].path});
    }
    out.labels = std::make_unique<ReplayLabels>(std::move(items), rig.depth.width, rig.depth.height);
  }

  out.calibration = rig;
  out.description = directory.string() + " (" + recording.layout + ", " + std::to_string(out.frames_count) +
                    " frames, " + std::to_string(rig.depth.width) + "x" + std::to_string(rig.depth.height) +
                    (rig.has_color ? rig.registered ? ", colour registered" : ", colour with its own camera"
                                   : ", depth only") +
                    ")";
  out.depth = std::make_unique<ReplayDepthCamera>(
      FrameSource<std::uint16_t>({directory, std::move(recording.depth), played.first, played.end,
                                  rig.depth.width, rig.depth.height}),
      rig.depth, options.prefetch);
  if (color_source)
    out.color = std::make_unique<ReplayColorCamera>(std::move(*color_source), rig.color, options.prefetch);
  out.allocates_in_read = options.prefetch == 0;
  out.buffers_bytes = options.prefetch * (frames::packed_bytes(PixelFormat::depth16, rig.depth.width, rig.depth.height) +
                                          (rig.has_color ? frames::packed_bytes(PixelFormat::rgb24, rig.color.width,
                                                                                rig.color.height)
                                                         : 0));
  return out;
}

}  // namespace
}  // namespace replay

bool is_recording(const std::filesystem::path& directory) {
  std::error_code error;
  return std::filesystem::exists(directory / "depth.txt", error) ||
         replay::has_seven_scenes_frames(directory);
}

rt::Result<Sensor> open_replay(const std::filesystem::path& directory, const ReplayOptions& options) {
  std::error_code error;
  if (!std::filesystem::is_directory(directory, error))
    return replay::bad_input(
        directory.string(), 0,
        std::filesystem::exists(directory, error) ? "not a folder" : "there is no such folder");
  const bool is_tum = std::filesystem::exists(directory / "depth.txt", error);
  if (!is_tum && !replay::has_seven_scenes_frames(directory))
    return replay::bad_input(
        directory.string(), 0,
        "holds neither depth.txt (TUM RGB-D layout) nor frame-NNNNNN.depth.png (7-Scenes layout)");
  auto recording = is_tum ? replay::read_tum_folder(directory) : replay::read_seven_scenes_folder(directory);
  if (!recording) return recording.error();
  return replay::build(std::move(*recording), options);
}

}  // namespace tactus::hal
