#include "hal/openni2/oni_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/openni2/oni_records.hpp"

namespace tactus::hal::openni2 {
namespace {

constexpr std::uint64_t kTimeUnknown = ~std::uint64_t{0};
constexpr rt::Duration kSilenceMax{1'000'000'000};

/// A frame's place in the file, as the seek table has it.
struct Place {
  std::uint64_t time_us = 0;
  std::uint32_t configuration = 0;
  std::uint64_t position = 0;
};

/// The bytes of one record, before its payload.
class Record {
 public:
  Record(OniRecord type, std::uint32_t node, std::uint64_t undo_position = 0, std::size_t payload_bytes = 0) {
    put(kRecordMagic).put(type).put(node).put(std::uint32_t{0}).put(static_cast<std::uint32_t>(payload_bytes));
    put(undo_position);
  }
  template <typename Number>
  Record& put(Number number) {
    const auto* bytes = reinterpret_cast<const char*>(&number);
    bytes_.append(bytes, sizeof number);
    return *this;
  }
  Record& put_string(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
    return *this;
  }
  [[nodiscard]] const std::string& bytes() {
    constexpr std::size_t kSizeAt = 12;
    const auto size = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data() + kSizeAt, &size, sizeof size);
    return bytes_;
  }

 private:
  std::string bytes_;
};

struct StreamOut {
  std::uint32_t node = 0;
  const char* name = "";
  OniNode type{};
  std::uint64_t added_at = 0, last_frame_at = 0, last_time_us = 0;
  std::vector<Place> places{Place{}};  // the table's entry 0 is no frame
  [[nodiscard]] std::uint32_t frames_count() const { return static_cast<std::uint32_t>(places.size() - 1); }
};

double field_of_view_rad(int pixels, double focal_px) { return 2 * std::atan(pixels / (2 * focal_px)); }

}  // namespace

struct OniWriter::State {
  State(const std::filesystem::path& file, Sensor& s) : file_name(file.string()), out(file, std::ios::binary), sensor(s) {}

  void write(const void* bytes, std::size_t count) {
    out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count));
    at += count;
  }
  void write(Record record) { write(record.bytes().data(), record.bytes().size()); }

  void write_header(std::uint64_t time_max_us) {
    std::string header("NI10");
    const auto put = [&](auto number) { header.append(reinterpret_cast<const char*>(&number), sizeof number); };
    put(std::uint8_t{1});
    put(std::uint8_t{0});
    put(std::uint16_t{1});
    put(std::uint32_t{0});
    put(time_max_us);
    put(color.node > 0 ? color.node : depth.node);
    write(header.data(), header.size());
  }

  static Record added(const StreamOut& stream, std::uint32_t frames_count, std::uint64_t time_max_us,
                      std::uint64_t table_at) {
    Record record(OniRecord::node_added, stream.node);
    record.put_string(stream.name).put(stream.type).put(kCodecNone).put(frames_count);
    record.put(std::uint64_t{0}).put(time_max_us).put(table_at);
    return record;
  }

  void write_int(const StreamOut& stream, std::string_view name, std::uint64_t value) {
    Record record(OniRecord::int_property, stream.node);
    write(record.put_string(name).put(std::uint32_t{sizeof value}).put(value));
  }
  template <typename... Numbers>
  void write_general(const StreamOut& stream, std::string_view name, Numbers... numbers) {
    Record record(OniRecord::general_property, stream.node);
    record.put_string(name).put(static_cast<std::uint32_t>((sizeof(Numbers) + ...)));
    (record.put(numbers), ...);
    write(record);
  }

  /// The player takes the mode before the pixel format, and gives no frame of a stream that does not tell its cropping.
  void write_stream(StreamOut& stream, const Intrinsics& k, std::uint64_t pixel_format, std::uint64_t pixel_bytes) {
    stream.added_at = at;
    write(added(stream, kNoNode, kTimeUnknown, 0));
    const auto width = static_cast<std::uint32_t>(k.width), height = static_cast<std::uint32_t>(k.height);
    const auto rate = static_cast<std::uint32_t>(std::lround(sensor.frame_rate_hz));
    write_int(stream, "oniRequiredFrameSize", std::uint64_t{width} * height * pixel_bytes);
    write_int(stream, "xnIsGenerating", 1);
    if (stream.type == OniNode::depth) write_int(stream, "xnDeviceMaxDepth", 65534);
    write_int(stream, "xnSupportedMapOutputModesCount", 1);
    write_general(stream, "xnSupportedMapOutputModes", width, height, rate);
    write_general(stream, "xnMapOutputMode", width, height, rate);
    // OpenNI 1's own numbers: a set with RGB24 alone or 16-bit grey alone, and which of them it is.
    const bool is_color = stream.type == OniNode::image;
    write_general(stream, "xnSupportedPixelFormats", std::uint32_t{is_color ? 1U : 8U});
    write_int(stream, "xnPixelFormat", is_color ? 1 : 4);
    write_int(stream, "oniPixelFormat", pixel_format);
    write_general(stream, "xnFOV", field_of_view_rad(k.width, k.fx), field_of_view_rad(k.height, k.fy));
    write_int(stream, "Cropping", 1);
    write_general(stream, "xnCropping", std::uint32_t{0}, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0},
                  std::uint16_t{0});
    write_int(stream, "Mirror", 1);
    write_int(stream, "xnMirror", 0);
    if (stream.type == OniNode::depth && sensor.calibration.registered) write_int(stream, "AlternativeViewPoint", 1);
  }

  void begin() {
    const RigCalibration& rig = sensor.calibration;
    depth = {1, "Depth1", OniNode::depth};
    if (sensor.color) color = {2, "Image1", OniNode::image};
    write_header(kTimeUnknown);
    write_stream(depth, rig.depth, is_100um ? kOniDepth100um : kOniDepth1mm, 2);
    // The first stream's readiness comes after the second is known: the player looks for streams only until it has frames.
    if (sensor.color) write_stream(color, rig.color, kOniRgb888, 3);
    for (const StreamOut* stream : {&depth, &color}) {
      if (stream->node == 0) continue;
      write(Record(OniRecord::state_ready, stream->node));
      write(Record(OniRecord::data_begin, stream->node).put(kNoNode).put(kTimeUnknown));
    }
  }

  void write_frame(StreamOut& stream, std::uint64_t time_us, const void* bytes, std::size_t count) {
    Record record(OniRecord::new_data, stream.node, stream.last_frame_at, count);
    stream.last_frame_at = at;
    stream.last_time_us = time_us;
    stream.places.push_back({time_us, 0, at});
    write(record.put(time_us).put(stream.frames_count()));
    write(bytes, count);
  }

  /// Where it is; 0: none, as beyond 288,000 frames the player could not read it.
  std::uint64_t write_table(const StreamOut& stream) {
    constexpr std::size_t kPlaceBytes = 20;
    const std::size_t bytes = stream.places.size() * kPlaceBytes;
    if (bytes + kRecordHeadBytes > kOniFrameBytesMax) return 0;
    const std::uint64_t table_at = at;
    write(Record(OniRecord::seek_table, stream.node, 0, bytes));
    for (const Place& place : stream.places) {
      write(&place.time_us, 8);
      write(&place.configuration, 4);
      write(&place.position, 8);
    }
    return table_at;
  }

  void end() {
    std::uint64_t time_max_us = 0;
    for (StreamOut* stream : {&depth, &color}) {
      if (stream->node == 0) continue;
      write(Record(OniRecord::node_removed, stream->node, stream->added_at));
      const std::uint64_t table_at = write_table(*stream);
      time_max_us = std::max(time_max_us, stream->last_time_us);
      const std::uint64_t back = at;
      out.seekp(static_cast<std::streamoff>(stream->added_at));
      write(added(*stream, stream->frames_count(), stream->last_time_us, table_at));
      out.seekp(static_cast<std::streamoff>(back));
      at = back;
    }
    write(Record(OniRecord::end, kNoNode));
    out.seekp(0);
    write_header(time_max_us);
    out.close();
  }

  rt::Error cannot_write() const {
    return {rt::ExitCode::failed, file_name + ": cannot be written to (disk full?)."};
  }

  /// ok | corrupt (left out; the sensor counts it) | end_of_stream, or the sentence that says what went wrong.
  rt::Result<rt::Status> usable(rt::Status status, const char* which) const {
    if (status == rt::Status::ok || status == rt::Status::corrupt || status == rt::Status::end_of_stream) return status;
    return rt::Error{rt::ExitCode::device_unavailable,
                     sensor.description + ": the " + which + " camera gives no frames (" + rt::name(status) + ")."};
  }

  /// Colour frames up to `until`, their own times. Error or nothing.
  rt::Result<void> write_color_until(rt::SensorTime until) {
    while (sensor.color && !has_color_ended) {
      FrameHeader header;
      auto status = usable(sensor.color->peek(header, kSilenceMax), "colour");
      if (!status) return status.error();
      has_color_ended = *status == rt::Status::end_of_stream;
      if (*status != rt::Status::ok) continue;
      if (until < header.time) return {};
      status = usable(sensor.color->read(rgb, header, kSilenceMax), "colour");
      if (!status) return status.error();
      if (*status == rt::Status::ok) write_frame(color, time_us(header), rgb.data(), rgb.size());
    }
    return {};
  }

  static std::uint64_t time_us(const FrameHeader& header) {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, header.time.ns)) / 1000;
  }

  void to_millimetres() {
    for (std::uint16_t& value : raw) {
      const double mm = value * sensor.calibration.depth_m_per_unit * 1000;
      value = mm > 65534 ? std::uint16_t{0} : static_cast<std::uint16_t>(std::lround(mm));
    }
  }

  rt::Result<bool> step() {
    if (has_ended) return false;
    FrameHeader header;
    auto status = usable(sensor.depth->read(raw, header, kSilenceMax), "depth");
    if (!status) return status.error();
    has_ended = *status == rt::Status::end_of_stream;
    if (auto written = write_color_until(has_ended ? rt::SensorTime{INT64_MAX} : header.time); !written)
      return written.error();
    if (has_ended) {
      end();
    } else if (*status == rt::Status::ok) {
      if (!is_exact) to_millimetres();
      write_frame(depth, time_us(header), raw.data(), 2 * raw.size());
    }
    if (!out) return cannot_write();
    return !has_ended;
  }

  std::string file_name;
  std::ofstream out;
  Sensor& sensor;
  std::uint64_t at = 0;
  bool is_100um = false, is_exact = true;
  StreamOut depth, color;
  std::vector<std::uint16_t> raw;
  std::vector<std::uint8_t> rgb;
  bool has_ended = false, has_color_ended = false;
};

OniWriter::OniWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
OniWriter::OniWriter(OniWriter&&) noexcept = default;
OniWriter& OniWriter::operator=(OniWriter&&) noexcept = default;
OniWriter::~OniWriter() = default;

rt::Result<OniWriter> OniWriter::open(const std::filesystem::path& file, Sensor& sensor) {
  const RigCalibration& rig = sensor.calibration;
  const auto pixels = [](const Intrinsics& k) {
    return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
  };
  const std::size_t depth_pixels = pixels(rig.depth), color_pixels = sensor.color ? pixels(rig.color) : 0;
  constexpr std::size_t kRecordBytesMax = 200;
  if (std::max(2 * depth_pixels, 3 * color_pixels) + kRecordBytesMax > kOniFrameBytesMax)
    return rt::Error{rt::ExitCode::bad_usage, file.string() + ": OpenNI2 reads frames of up to 1600 x 1200 pixels, and the "
                                                              "sensor's are larger; write another kind of recording."};
  std::error_code error;
  if (std::filesystem::exists(file, error))
    return rt::Error{rt::ExitCode::bad_usage, file.string() + ": exists already; give another name or remove it."};
  auto state = std::make_unique<State>(file, sensor);
  if (!state->out) return rt::Error{rt::ExitCode::failed, file.string() + ": cannot be created."};
  const double unit_mm = rig.depth_m_per_unit * 1000;
  state->is_100um = std::fabs(unit_mm - 0.1) < 1e-9;
  state->is_exact = state->is_100um || std::fabs(unit_mm - 1) < 1e-9;
  state->raw.resize(depth_pixels);
  state->rgb.resize(3 * color_pixels);
  state->begin();
  return OniWriter(std::move(state));
}

rt::Result<bool> OniWriter::step() { return state_->step(); }
std::uint64_t OniWriter::depth_frames_count() const { return state_->depth.frames_count(); }
std::uint64_t OniWriter::color_frames_count() const { return state_->color.frames_count(); }

rt::Result<OniCounts> write_oni(const std::filesystem::path& file, Sensor& sensor) {
  auto writer = OniWriter::open(file, sensor);
  if (!writer) return writer.error();
  for (;;) {
    auto has_written = writer->step();
    if (!has_written) return has_written.error();
    if (!*has_written) return OniCounts{writer->depth_frames_count(), writer->color_frames_count()};
  }
}

}  // namespace tactus::hal::openni2
