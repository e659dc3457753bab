#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "hal/frames/convert.hpp"
#include "hal/frames/decoded_stream.hpp"
#include "hal/record/tac.hpp"
#include "hal/record/tac_file.hpp"
#include "hal/record/tac_source.hpp"

namespace tactus::hal::record {
namespace {

/// Depth and colour of one moment are taken at most this far apart (half a frame at 30 Hz is 17 ms).
constexpr std::uint64_t kPairDistance_ns = 20'000'000;

/// Of any two times: their difference may be more than an int64 holds.
std::uint64_t distance_ns(std::int64_t a, std::int64_t b) {
  return a < b ? static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a)
               : static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b);
}

class TacDepthCamera final : public DepthCamera {
 public:
  TacDepthCamera(TacSource<std::uint16_t> source, std::size_t prefetch) : stream_(std::move(source), prefetch) {}
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) override {
    return stream_.read(depth, header, timeout, [this](const RawFrame& frame) {
      if (tap_ != nullptr) tap_->take(Stream::depth, frame);
    });
  }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }

 private:
  frames::DecodedStream<TacSource<std::uint16_t>> stream_;
};

class TacColorCamera final : public ColorCamera {
 public:
  TacColorCamera(TacSource<std::uint8_t> source, std::size_t prefetch) : stream_(std::move(source), prefetch) {}
  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) override {
    return stream_.read(rgb, header, timeout, [this](const RawFrame& frame) { show(frame); });
  }
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override { return stream_.peek(header, timeout); }
  void skip() override {
    stream_.skip([this](const RawFrame& frame) { show(frame); });
  }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }

 private:
  void show(const RawFrame& frame) {
    if (tap_ != nullptr) tap_->take(Stream::color, frame);
  }
  frames::DecodedStream<TacSource<std::uint8_t>> stream_;
};

/// Labels by the depth frame's number, on the caller's thread. No heap.
class TacLabels final : public LabelTruth {
 public:
  TacLabels(std::shared_ptr<const TacFile> file, std::vector<IndexEntry> entries, FrameSize size)
      : file_(std::move(file)), entries_(std::move(entries)), unpacker_(size) {
    std::stable_sort(entries_.begin(), entries_.end(), [](const IndexEntry& a, const IndexEntry& b) {
      return a.header.frame.sequence < b.header.frame.sequence;
    });
    std::size_t bytes_max = 0;
    for (const IndexEntry& entry : entries_) bytes_max = std::max(bytes_max, TacFile::chunk_bytes(entry));
    buffer_.resize(std::min<std::size_t>(bytes_max, file_->bytes()));
  }

  /// ok | skipped (no labels for this frame) | corrupt (damaged, or ids that are neither a material nor 255).
  rt::Status read(std::uint64_t sequence, std::span<std::uint8_t> ids) override {
    const auto entry = std::lower_bound(
        entries_.begin(), entries_.end(), sequence,
        [](const IndexEntry& e, std::uint64_t s) { return e.header.frame.sequence < s; });
    if (entry == entries_.end() || entry->header.frame.sequence != sequence) return rt::Status::skipped;
    std::span<const std::uint8_t> payload;
    if (TacFile::chunk_bytes(*entry) > buffer_.size() || file_->read_chunk(*entry, buffer_, payload) != nullptr ||
        !unpacker_.unpack(entry->header.packing, PixelFormat::depth16, payload, ids))
      return rt::Status::corrupt;
    constexpr std::uint8_t kIdsCount = 23, kUnknown = 255;  // the frozen MINC ids; hal does not know what they mean
    const bool all_known =
        std::all_of(ids.begin(), ids.end(), [](std::uint8_t id) { return id < kIdsCount || id == kUnknown; });
    return all_known ? rt::Status::ok : rt::Status::corrupt;
  }

 private:
  std::shared_ptr<const TacFile> file_;
  std::vector<IndexEntry> entries_;
  Unpacker unpacker_;
  std::vector<std::uint8_t> buffer_;
};

FrameSize size_of(const Intrinsics& k) { return {k.width, k.height}; }

std::vector<IndexEntry> of_type(const TacFile& file, ChunkType type) {
  std::vector<IndexEntry> out;
  for (const IndexEntry& entry : file.entries())
    if (entry.header.type == type) out.push_back(entry);
  return out;
}

std::vector<IndexEntry> in_range(const std::vector<IndexEntry>& entries, const TacReadOptions& options) {
  std::vector<IndexEntry> out;
  for (const IndexEntry& entry : entries) {
    const std::uint64_t sequence = entry.header.frame.sequence;
    if (sequence >= options.first && sequence < options.last) out.push_back(entry);
  }
  return out;
}

/// Colour frames to play with depth frames `played` out of `depth`: all, or those within 20 ms of the cut ends, on the
/// clock that both have. Without one (arrivals unknown): all.
std::vector<IndexEntry> colour_of(const std::vector<IndexEntry>& color, const std::vector<IndexEntry>& depth,
                                  const std::vector<IndexEntry>& played, bool has_two_clocks) {
  const auto time = [&](const IndexEntry& entry) {
    return has_two_clocks ? entry.header.frame.arrived.ns : entry.header.frame.time.ns;
  };
  const auto is_unknown = [](const IndexEntry& entry) { return entry.header.frame.arrived.ns == 0; };
  if (has_two_clocks && (std::any_of(color.begin(), color.end(), is_unknown) ||
                         std::any_of(played.begin(), played.end(), is_unknown)))
    return color;
  const bool is_cut_in_front = played.front().offset != depth.front().offset;
  const bool is_cut_behind = played.back().offset != depth.back().offset;
  std::vector<IndexEntry> out;
  for (const IndexEntry& entry : color) {
    const std::int64_t at = time(entry), front = time(played.front()), back = time(played.back());
    const bool is_early = is_cut_in_front && at < front && distance_ns(at, front) > kPairDistance_ns;
    const bool is_late = is_cut_behind && at > back && distance_ns(at, back) > kPairDistance_ns;
    if (!is_early && !is_late) out.push_back(entry);
  }
  return out;
}

std::optional<T_WorldDepth> truth_at(const std::vector<TruthPose>& truth, rt::SensorTime time) {
  const TruthPose* best = nullptr;
  std::uint64_t best_distance = kPairDistance_ns + 1;
  for (const TruthPose& pose : truth) {
    const std::uint64_t distance = distance_ns(pose.time.ns, time.ns);
    if (distance >= best_distance) continue;
    best = &pose;
    best_distance = distance;
  }
  if (best == nullptr) return std::nullopt;
  return best->T_world_depth;
}

/// Gravity in the first frame that is played: the recording has it for its own first frame.
std::optional<Vec3d> gravity_of(const TacFile& file, const IndexEntry& first, const IndexEntry& played,
                                std::vector<std::string>& notes) {
  const auto& gravity = file.header().gravity_depth;
  if (!gravity || first.offset == played.offset) return gravity;
  const auto first_pose = truth_at(file.truth(), first.header.frame.time);
  const auto played_pose = truth_at(file.truth(), played.header.frame.time);
  if (first_pose && played_pose)
    return (played_pose->rotation.transposed() * (first_pose->rotation * *gravity)).normalized();
  notes.push_back(file.path().string() +
                  ": gravity is known for the first frame, which is not played, and no true pose leads from it to the "
                  "first that is; gravity is unknown");
  return std::nullopt;
}

void note_dropped(const TacFile& file, std::vector<std::string>& notes) {
  if (!file.end()) return;
  const auto& streams = file.end()->streams;
  const std::uint64_t lost[2] = {streams[0].dropped + streams[0].refused, streams[1].dropped + streams[1].refused};
  if (lost[0] + lost[1] > 0)
    notes.push_back(file.path().string() + ": the recorder itself left out " + std::to_string(lost[0]) +
                    " depth and " + std::to_string(lost[1]) + " colour frames");
}

std::string describe(const TacFile& file, const Sensor& sensor) {
  const RigCalibration& rig = sensor.calibration;
  return file.path().string() + " (recording, " + std::to_string(sensor.frames_count) + " frames, " +
         std::to_string(rig.depth.width) + "x" + std::to_string(rig.depth.height) +
         (rig.has_color ? rig.registered ? ", colour registered" : ", colour with its own camera" : ", depth only") +
         ", of " + file.header().description + ")";
}

rt::Error empty_range(const TacFile& file, const std::vector<IndexEntry>& depth) {
  if (depth.empty())
    return {rt::ExitCode::bad_input, file.path().string() + ": the recording holds no depth frame"};
  return {rt::ExitCode::bad_usage, file.path().string() + ": no frame in this range; the recording has numbers " +
                                       std::to_string(depth.front().header.frame.sequence) + " to " +
                                       std::to_string(depth.back().header.frame.sequence)};
}

}  // namespace

bool is_tac(const std::filesystem::path& path) {
  std::array<char, kVersionAt> bytes{};
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return false;
  const bool is_read = std::fread(bytes.data(), 1, bytes.size(), file) == bytes.size();
  std::fclose(file);
  return is_read && std::equal(bytes.begin(), bytes.end(), kMagic.begin(),
                               [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

rt::Result<Sensor> open_tac(const std::filesystem::path& path, const TacReadOptions& options) {
  auto opened = TacFile::open(path);
  if (!opened) return opened.error();
  const std::shared_ptr<const TacFile> file = std::move(*opened);
  const FileHeader& header = file->header();
  const auto depth = of_type(*file, ChunkType::depth);
  const auto played = in_range(depth, options);
  if (played.empty()) return empty_range(*file, depth);

  Sensor out;
  out.notes = file->notes();
  note_dropped(*file, out.notes);
  out.calibration = header.calibration;
  out.has_two_clocks = header.has_two_clocks;
  out.frame_rate_hz = header.frame_rate_hz;
  out.frames_count = played.size();
  out.truth = file->truth();
  out.gravity_depth = gravity_of(*file, depth.front(), played.front(), out.notes);
  RigCalibration& rig = out.calibration;

  TacSource<std::uint16_t> depth_source(file, played, size_of(rig.depth));
  const auto buffers_of = [&](const auto& source, std::size_t pixel_bytes) {
    const std::size_t slots = std::max<std::size_t>(options.prefetch, 1);
    return source.memory_bytes() + slots * (source.raw_bytes_max() + pixel_bytes * source.pixels_count());
  };
  out.buffers_bytes = buffers_of(depth_source, 2);
  out.depth = std::make_unique<TacDepthCamera>(std::move(depth_source), options.prefetch);

  if (rig.has_color) {
    auto color = colour_of(of_type(*file, ChunkType::color), depth, played, header.has_two_clocks);
    rig.has_color = !color.empty();
    if (color.empty()) {
      out.notes.push_back(path.string() + ": no colour frame lies in the time of the depth frames; depth only");
    } else {
      const bool has_jpeg = std::any_of(color.begin(), color.end(), [](const IndexEntry& entry) {
        return entry.header.format == PixelFormat::mjpeg;
      });
      out.allocates_in_read = has_jpeg && options.prefetch == 0;
      TacSource<std::uint8_t> color_source(file, std::move(color), size_of(rig.color));
      out.buffers_bytes += buffers_of(color_source, 1);
      out.color = std::make_unique<TacColorCamera>(std::move(color_source), options.prefetch);
    }
  }
  if (auto labels = in_range(of_type(*file, ChunkType::labels), options); !labels.empty())
    out.labels = std::make_unique<TacLabels>(file, std::move(labels), size_of(rig.depth));
  out.description = describe(*file, out);
  return out;
}

rt::Result<TacFacts> tac_facts(const std::filesystem::path& path) {
  auto opened = TacFile::open(path);
  if (!opened) return opened.error();
  const TacFile& file = **opened;
  const FileHeader& header = file.header();
  TacFacts out;
  out.description = header.description;
  out.calibration = header.calibration;
  out.frame_rate_hz = header.frame_rate_hz;
  out.was_live = header.was_live;
  out.has_two_clocks = header.has_two_clocks;
  out.gravity_depth = header.gravity_depth;
  out.info = header.info;
  out.file_bytes = file.bytes();
  out.chunks_count = file.chunks_count();
  out.is_cut_off = !file.end();
  out.damaged_bytes = file.damaged_bytes();
  out.poses_count = file.truth().size();
  out.notes = file.notes();
  std::array<std::uint64_t, 2> sequences{};
  for (const IndexEntry& entry : file.entries()) {
    const ChunkHeader& chunk = entry.header;
    out.labels_count += chunk.type == ChunkType::labels ? 1 : 0;
    if (chunk.type != ChunkType::depth && chunk.type != ChunkType::color) continue;
    const std::size_t i = chunk.type == ChunkType::depth ? 0 : 1;
    TacFacts::OfStream& stream = out.streams[i];
    if (stream.frames == 0) stream.first_time = chunk.frame.time;
    if (stream.frames > 0 && chunk.frame.sequence > sequences[i])
      stream.missing += chunk.frame.sequence - sequences[i] - 1;
    if (!stream.format) stream.format = chunk.format;
    stream.last_time = chunk.frame.time;
    sequences[i] = chunk.frame.sequence;
    ++stream.frames;
    stream.raw_bytes += chunk.raw_bytes;
    stream.stored_bytes += chunk.payload_bytes;
  }
  for (std::size_t i = 0; i < 2 && file.end(); ++i) {
    out.streams[i].dropped = file.end()->streams[i].dropped;
    out.streams[i].refused = file.end()->streams[i].refused;
  }
  return out;
}

}  // namespace tactus::hal::record
