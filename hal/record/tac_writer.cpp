#include "hal/record/tac_writer.hpp"

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/frames/convert.hpp"
#include "hal/frames/jpeg_codec.hpp"
#include "hal/record/file_header.hpp"
#include "hal/record/little_endian.hpp"
#include "rt/assert.hpp"
#include "rt/clock.hpp"

namespace tactus::hal::record {
namespace {

constexpr rt::Duration kSyncInterval{1'000'000'000};

std::size_t pixels_of(FrameSize size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}

std::size_t index_of(Stream stream) { return static_cast<std::size_t>(stream); }

FrameSize depth_size(const Sensor& sensor) { return {sensor.calibration.depth.width, sensor.calibration.depth.height}; }
FrameSize color_size(const Sensor& sensor) {
  if (!sensor.calibration.has_color) return {};
  return {sensor.calibration.color.width, sensor.calibration.color.height};
}

/// A record's head, rounded up, and the word of its size.
constexpr std::size_t kRecordOverheadBytes = 64;

/// Frames of both streams, colour as large as it can come, and twice the largest, which the ring needs to turn round.
std::size_t ring_bytes(const Sensor& sensor, const TacOptions& options) {
  const std::size_t depth = 2 * pixels_of(depth_size(sensor)) + kRecordOverheadBytes;
  const std::size_t color = 3 * pixels_of(color_size(sensor)) + kRecordOverheadBytes;
  return std::max<std::size_t>(options.frames_waiting, 1) * (depth + color) + 2 * std::max(depth, color);
}

timespec after(rt::HostTime from, rt::Duration wait) {
  const std::int64_t ns = from.ns + wait.ns;
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

}  // namespace

struct TacWriter::Record {
  ChunkType type;
  PixelFormat format;
  FrameHeader frame;
};

TacWriter::TacWriter(std::unique_ptr<ChunkFile> file, const Sensor& sensor, const TacOptions& options)
    : file_(std::move(file)),
      options_(options),
      sizes_{depth_size(sensor), color_size(sensor)},
      ring_(ring_bytes(sensor, options)),
      depth_packer_(sizes_[0]) {
  static_assert(sizeof(Record) + 8 <= kRecordOverheadBytes);
  if (sensor.calibration.has_color) color_packer_ = std::make_unique<Packer>(sizes_[1]);
  if (options.color == TacColor::jpeg) {
    rgb_.resize(3 * pixels_of(sizes_[1]));
    jpeg_.reserve(rgb_.size());
  }
  buffers_bytes_ = ring_.memory_bytes() + depth_packer_.memory_bytes() + file_->memory_bytes() + rgb_.size() +
                   jpeg_.capacity() + (color_packer_ ? color_packer_->memory_bytes() : 0);
  sem_init(&filled_, 0, 0);
  sem_init(&freed_, 0, 0);
}

rt::Result<std::unique_ptr<TacWriter>> TacWriter::create(const std::filesystem::path& path, const Sensor& sensor,
                                                         const TacInfo& info, const TacOptions& options) {
  TACTUS_ASSERT(options.jpeg_quality >= 1 && options.jpeg_quality <= 100);
  auto file = ChunkFile::create(path);
  if (!file) return file.error();
  std::unique_ptr<TacWriter> writer(new TacWriter(std::move(*file), sensor, options));
  auto started = writer->start(sensor, info);
  if (started) return writer;
  std::error_code error;
  std::filesystem::remove(path, error);  // without its first chunk it says nothing
  return started.error();
}

rt::Result<void> TacWriter::start(const Sensor& sensor, const TacInfo& info) {
  const std::string text =
      format_file_header({.description = sensor.description, .calibration = sensor.calibration,
                          .frame_rate_hz = sensor.frame_rate_hz, .was_live = sensor.is_live,
                          .has_two_clocks = sensor.has_two_clocks, .gravity_depth = sensor.gravity_depth, .info = info});
  const std::span header(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  bool is_good = file_->append({.type = ChunkType::header, .raw_bytes = header.size()}, header);
  constexpr std::size_t kPosesInChunk = 4096;
  std::vector<std::uint8_t> poses;
  for (std::size_t first = 0; first < sensor.truth.size() && is_good; first += kPosesInChunk) {
    const auto some = std::span(sensor.truth).subspan(first);
    poses.resize(kPoseBytes * std::min(kPosesInChunk, some.size()));
    std::uint8_t* at = poses.data();
    for (const TruthPose& pose : some.first(poses.size() / kPoseBytes)) {
      at = put(at, pose.time.ns);
      for (const double value : pose.T_world_depth.rotation.m) at = put(at, value);
      const Vec3d& t = pose.T_world_depth.translation;
      for (const double value : {t.x, t.y, t.z}) at = put(at, value);
    }
    is_good = file_->append({.type = ChunkType::truth, .raw_bytes = poses.size()}, poses);
  }
  if (!is_good || !file_->sync()) return rt::Error{rt::ExitCode::failed, file_->failure()};
  // Relaxed: a number for reports.
  file_bytes_.store(file_->bytes(), std::memory_order_relaxed);
  synced_ = rt::Clock::monotonic().now();
  constexpr rt::ThreadSpec kSpec{.name = "tac_writer"};
  auto thread = rt::RtThread::start(
      kSpec, [](void* self) { static_cast<TacWriter*>(self)->write_until_closed(); }, this);
  if (!thread) return thread.error();
  thread_ = std::move(*thread);
  return {};
}

TacWriter::~TacWriter() {
  (void)close();
  sem_destroy(&filled_);
  sem_destroy(&freed_);
}

std::span<std::uint8_t> TacWriter::room_for(std::size_t bytes) noexcept {
  for (;;) {
    const std::span<std::uint8_t> room = ring_.reserve(bytes);
    if (!room.empty() || !options_.waits_when_full) return room;
    // The writer takes records out whatever becomes of the file, so that a token comes; an old one only costs a turn.
    while (sem_wait(&freed_) != 0 && errno == EINTR) {
    }
  }
}

void TacWriter::hand_over() noexcept {
  ring_.commit();
  sem_post(&filled_);
}

void TacWriter::take(Stream stream, const RawFrame& frame) noexcept {
  Tally& tally = tallies_[index_of(stream)];
  const FrameSize size = sizes_[index_of(stream)];
  const bool is_depth = stream == Stream::depth;
  const bool fits = frame.width == size.width && frame.height == size.height && frames::is_whole(frame) &&
                    (frame.format == PixelFormat::depth16) == is_depth;
  const std::size_t packed_bytes = fits ? frames::packed_bytes(frame.format, size.width, size.height) : 0;
  const std::size_t bytes = packed_bytes == 0 ? frame.bytes.size() : packed_bytes;
  if (!fits || bytes > kPayloadBytesMax || sizeof(Record) + bytes > ring_.record_bytes_max()) {
    tally.refused.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const std::span<std::uint8_t> room = has_stopped() ? std::span<std::uint8_t>{} : room_for(sizeof(Record) + bytes);
  if (room.empty()) {
    tally.dropped.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const Record record{is_depth ? ChunkType::depth : ChunkType::color, frame.format, frame.header};
  std::memcpy(room.data(), &record, sizeof record);
  std::uint8_t* at = room.data() + sizeof record;
  const std::size_t row = frame.format == PixelFormat::nv12 ? static_cast<std::size_t>(size.width)
                          : packed_bytes == 0               ? bytes
                                                            : bytes / static_cast<std::size_t>(size.height);
  for (std::size_t y = 0; y < bytes / row; ++y)
    std::memcpy(at + y * row, frame.bytes.data() + y * frame.row_bytes, row);
  hand_over();
}

bool TacWriter::add_labels(std::uint64_t sequence, std::span<const std::uint8_t> material_ids) noexcept {
  TACTUS_ASSERT(material_ids.size() == pixels_of(sizes_[0]));
  const std::span<std::uint8_t> room =
      has_stopped() ? std::span<std::uint8_t>{} : room_for(sizeof(Record) + material_ids.size());
  if (room.empty()) return false;
  const Record record{ChunkType::labels, PixelFormat::depth16, {{}, sequence, {}}};
  std::memcpy(room.data(), &record, sizeof record);
  std::memcpy(room.data() + sizeof record, material_ids.data(), material_ids.size());
  hand_over();
  return true;
}

bool TacWriter::has_stopped() const noexcept {
  // Relaxed: says that it is of no use to go on; nothing is read because of it.
  return has_stopped_.load(std::memory_order_relaxed);
}

TacWriter::Counts TacWriter::was() const noexcept {
  Counts out;
  for (std::size_t i = 0; i < 2; ++i)
    out.streams[i] = {tallies_[i].written.load(std::memory_order_relaxed),
                      tallies_[i].dropped.load(std::memory_order_relaxed),
                      tallies_[i].refused.load(std::memory_order_relaxed)};
  out.file_bytes = file_bytes_.load(std::memory_order_relaxed);
  return out;
}

void TacWriter::write_until_closed() {
  for (;;) {
    const timespec deadline = after(synced_, kSyncInterval);
    const bool is_woken = sem_clockwait(&filled_, CLOCK_MONOTONIC, &deadline) == 0;
    const std::span<const std::uint8_t> record = is_woken ? ring_.front() : std::span<const std::uint8_t>{};
    if (!record.empty()) {
      write_record(record);
      ring_.pop();
      if (options_.waits_when_full) sem_post(&freed_);
    } else if (is_woken && is_closing_.load(std::memory_order_acquire)) {
      return;  // Pairs with the release in close(): its token is behind those of all records.
    }
    const rt::HostTime now = rt::Clock::monotonic().now();
    if (now - synced_ < kSyncInterval) continue;
    if (!has_stopped() && !file_->sync()) has_stopped_.store(true, std::memory_order_relaxed);
    synced_ = rt::Clock::monotonic().now();
  }
}

void TacWriter::write_record(std::span<const std::uint8_t> record) {
  Record head{};
  std::memcpy(&head, record.data(), sizeof head);
  const auto bytes = record.subspan(sizeof head);
  if (head.type != ChunkType::labels) return write_frame(head, bytes);
  if (has_stopped()) return;
  const Packed packed = depth_packer_.pack(bytes);
  if (!file_->append({.type = head.type, .packing = packed.packing, .raw_bytes = bytes.size(), .frame = head.frame},
                     packed.payload))
    has_stopped_.store(true, std::memory_order_relaxed);
}

/// Into jpeg_.
bool TacWriter::to_jpeg(const Record& record, std::span<const std::uint8_t> bytes) {
  const FrameSize size = sizes_[1];
  const std::size_t row = record.format == PixelFormat::nv12 ? static_cast<std::size_t>(size.width)
                                                             : bytes.size() / static_cast<std::size_t>(size.height);
  return frames::to_rgb({record.frame, record.format, size.width, size.height, row, bytes}, rgb_) == rt::Status::ok &&
         frames::encode_jpeg(rgb_, size.width, size.height, options_.jpeg_quality, jpeg_);
}

void TacWriter::write_frame(const Record& record, std::span<const std::uint8_t> bytes) {
  const bool is_depth = record.type == ChunkType::depth;
  Tally& tally = tallies_[is_depth ? 0 : 1];
  if (has_stopped()) {
    tally.dropped.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  ChunkHeader header{.type = record.type, .format = record.format, .raw_bytes = bytes.size(), .frame = record.frame};
  if (!is_depth && options_.color == TacColor::jpeg && record.format != PixelFormat::mjpeg) {
    if (!to_jpeg(record, bytes)) {
      tally.refused.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    bytes = jpeg_;
    header.format = PixelFormat::mjpeg;
    header.raw_bytes = bytes.size();
  }
  const Packed packed = (is_depth ? depth_packer_ : *color_packer_).pack(header.format, bytes);
  header.packing = packed.packing;
  if (!file_->append(header, packed.payload)) {
    tally.dropped.fetch_add(1, std::memory_order_relaxed);
    has_stopped_.store(true, std::memory_order_relaxed);
    return;
  }
  tally.written.fetch_add(1, std::memory_order_relaxed);
  file_bytes_.store(file_->bytes(), std::memory_order_relaxed);
}

rt::Result<void> TacWriter::close() {
  if (is_closed_) return closed_;
  is_closed_ = true;
  if (!thread_.is_joinable()) return closed_;
  // Pairs with the acquire in write_until_closed().
  is_closing_.store(true, std::memory_order_release);
  sem_post(&filled_);
  thread_.join();
  has_stopped_.store(true, std::memory_order_relaxed);
  const bool is_finished = file_->finish(was().streams);
  file_bytes_.store(file_->bytes(), std::memory_order_relaxed);
  if (!is_finished || !file_->failure().empty()) closed_ = rt::Error{rt::ExitCode::failed, file_->failure()};
  return closed_;
}

}  // namespace tactus::hal::record
