#include "hal/openni2/oni_index.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace tactus::hal::openni2 {
namespace {

struct RecordHead {
  OniRecord type{};
  std::uint32_t node = 0, fields_bytes = 0, payload_bytes = 0;  // fields without the head
};

/// Reads fields one after the other; a read past the end leaves `is_short` set and gives zero.
class Fields {
 public:
  explicit Fields(std::span<const char> bytes) : bytes_(bytes) {}
  template <typename Number>
  Number number() {
    Number value{};
    if (bytes_.size() < sizeof value) {
      is_short = true;
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  std::span<const char> block(std::size_t bytes) {
    if (bytes_.size() < bytes) {
      is_short = true;
      return {};
    }
    const auto out = bytes_.first(bytes);
    bytes_ = bytes_.subspan(bytes);
    return out;
  }
  /// A name with its terminating zero, on which the library relies; a letter beyond ASCII makes it write before a table.
  std::string_view name() {
    const auto text = block(number<std::uint32_t>());
    const bool is_ascii =
        std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
    if (text.empty() || text.back() != '\0' || !is_ascii) {
      is_short = true;
      return {};
    }
    return {text.data()};
  }
  bool is_short = false;

 private:
  std::span<const char> bytes_;
};

struct Node {
  OniNode type{};
  OniStreamIndex stream;
  std::uint64_t frames_max = 0, seek_table = 0;
  std::uint64_t frame_bytes_needed = 0;
  bool has_mode = false, has_cropping = false, has_depth_max = false, is_ready = false;
  [[nodiscard]] bool is_stream() const {
    return type == OniNode::depth || type == OniNode::image || type == OniNode::infrared;
  }
};

class Walker {
 public:
  explicit Walker(const std::filesystem::path& file) : name_(file.string()), in_(file, std::ios::binary) {}

  rt::Result<OniIndex> walk() {
    std::error_code error;
    file_bytes_ = std::filesystem::file_size(name_, error);
    if (!in_ || error) return bad("there is no such file, or it cannot be read");
    if (auto begun = read_header(); !begun) return begun.error();
    while (!has_ended_) {
      if (at_ == file_bytes_) break;
      auto head = read_head();
      if (!head) return head.error();
      if (is_cut_) break;
      if (auto taken = take(*head); !taken) return taken.error();
    }
    return finish();
  }

 private:
  rt::Error bad(const std::string& what) const { return {rt::ExitCode::bad_input, name_ + ": " + what + "."}; }
  rt::Error bad_here(const std::string& what) const { return bad("at byte " + std::to_string(at_) + " " + what); }
  rt::Error cut() const {
    std::string whole;
    for (const auto& [id, node] : nodes_)
      if (node.is_stream())
        whole += (whole.empty() ? "" : " and ") + std::to_string(node.stream.frames.size()) +
                 (node.type == OniNode::depth ? " depth" : " colour");
    return bad("cut off at byte " + std::to_string(at_) + (whole.empty() ? "" : ", after " + whole + " frames") +
               "; OpenNI2 does not play a file without the tables at its end");
  }

  rt::Result<void> read_header() {
    std::array<char, kFileHeaderBytes> bytes{};
    in_.read(bytes.data(), bytes.size());
    if (static_cast<std::size_t>(in_.gcount()) < bytes.size() || std::memcmp(bytes.data(), "NI10", 4) != 0)
      return bad("not an .oni recording: it does not begin with NI10");
    Fields fields(bytes);
    (void)fields.block(4);
    const auto major = fields.number<std::uint8_t>(), minor = fields.number<std::uint8_t>();
    const auto maintenance = fields.number<std::uint16_t>();
    const auto build = fields.number<std::uint32_t>();
    time_max_us_ = fields.number<std::uint64_t>();
    node_max_ = fields.number<std::uint32_t>();
    const std::uint64_t version =
        std::uint64_t{major} << 56 | std::uint64_t{minor} << 48 | std::uint64_t{maintenance} << 32 | build;
    constexpr std::uint64_t kOldest = std::uint64_t{1} << 56 | 4, kNewest = std::uint64_t{1} << 56 | std::uint64_t{1} << 32;
    if (version < kOldest || version > kNewest)
      return bad("written in version " + std::to_string(major) + "." + std::to_string(minor) + "." +
                 std::to_string(maintenance) + "." + std::to_string(build) +
                 " of the format; OpenNI2 reads 1.0.0.4 to 1.0.1.0");
    // The library makes a table of them; real recordings have three or four.
    if (node_max_ > 63) return bad("damaged: its header speaks of " + std::to_string(node_max_) + " streams");
    head_bytes_ = version < kNewest ? kOldRecordHeadBytes : kRecordHeadBytes;
    at_ = kFileHeaderBytes;
    return {};
  }

  rt::Result<RecordHead> read_head() {
    std::array<char, kRecordHeadBytes> bytes{};
    RecordHead head;
    is_cut_ = at_ + head_bytes_ > file_bytes_;
    if (is_cut_) return head;
    in_.seekg(static_cast<std::streamoff>(at_));
    in_.read(bytes.data(), static_cast<std::streamsize>(head_bytes_));
    if (!in_) return bad("cannot be read");
    Fields fields(bytes);
    if (fields.number<std::uint32_t>() != kRecordMagic) return bad_here("there is no record, so the file is damaged");
    head.type = static_cast<OniRecord>(fields.number<std::uint32_t>());
    head.node = fields.number<std::uint32_t>();
    const auto bytes_with_head = fields.number<std::uint32_t>();
    head.payload_bytes = fields.number<std::uint32_t>();
    if (bytes_with_head < head_bytes_) return bad_here("a record is shorter than its own head, so the file is damaged");
    head.fields_bytes = bytes_with_head - static_cast<std::uint32_t>(head_bytes_);
    if (std::uint64_t{bytes_with_head} + head.payload_bytes > kOniFrameBytesMax)
      return bad_here("a record is larger than any that OpenNI2 reads");
    is_cut_ = at_ + bytes_with_head + head.payload_bytes > file_bytes_;
    if (is_cut_) return head;
    fields_.resize(head.fields_bytes);
    in_.read(fields_.data(), head.fields_bytes);
    if (!in_) return bad("cannot be read");
    return head;
  }

  rt::Result<void> take(const RecordHead& head) {
    const std::uint64_t next = at_ + head_bytes_ + head.fields_bytes + head.payload_bytes;
    if (head.type == OniRecord::end) {
      has_ended_ = true;
      at_ = next;
      return {};
    }
    if (head.node > node_max_)
      return bad_here("a stream begins that the header does not know; the recording was never finished");
    Fields fields(fields_);
    rt::Result<void> taken;
    switch (head.type) {
      case OniRecord::node_added_1_0_0_4:
      case OniRecord::node_added_1_0_0_5:
      case OniRecord::node_added:
        taken = add_node(head, fields);
        break;
      case OniRecord::int_property:
      case OniRecord::real_property:
      case OniRecord::string_property:
      case OniRecord::general_property:
        taken = take_property(head, fields);
        break;
      case OniRecord::state_ready:
        taken = make_ready(head);
        break;
      case OniRecord::data_begin:
        taken = begin_data(head, fields);
        break;
      case OniRecord::new_data:
        taken = take_frame(head, fields);
        break;
      case OniRecord::node_removed:
      case OniRecord::seek_table:
        break;
      default:
        return bad_here("there is a record of an unknown kind, so the file is damaged");
    }
    if (!taken) return taken.error();
    if (fields.is_short) return bad_here("a record does not hold the fields it must, so the file is damaged");
    at_ = next;
    return {};
  }

  rt::Result<void> add_node(const RecordHead& head, Fields& fields) {
    if (nodes_.contains(head.node)) return bad_here("a stream begins twice, so the file is damaged");
    Node& node = nodes_[head.node];
    // The library copies the name into 80 bytes.
    if (fields.name().size() > 79) return bad_here("a stream's name is too long, so the file is damaged");
    node.type = static_cast<OniNode>(fields.number<std::uint32_t>());
    node.stream.node = head.node;
    node.stream.codec = fields.number<std::uint32_t>();
    if (head.type == OniRecord::node_added_1_0_0_4) {
      node.frames_max = kNoNode;
      return {};
    }
    node.frames_max = fields.number<std::uint32_t>();
    (void)fields.number<std::uint64_t>();
    (void)fields.number<std::uint64_t>();
    if (head.type != OniRecord::node_added) return {};
    node.seek_table = fields.number<std::uint64_t>();
    if (node.frames_max > 0 && node.seek_table != 0 && node.seek_table + head_bytes_ > file_bytes_) is_table_missing_ = true;
    return {};
  }

  rt::Result<void> take_property(const RecordHead& head, Fields& fields) {
    const auto node = nodes_.find(head.node);
    if (node == nodes_.end()) return bad_here("a property belongs to no stream, so the file is damaged");
    const std::string_view name = fields.name();
    const auto bytes = fields.number<std::uint32_t>();
    Fields value(fields.block(bytes));
    if (fields.is_short) return {};
    Node& n = node->second;
    const bool is_int = head.type == OniRecord::int_property;
    if (is_int && bytes != 8) return bad_here("a number has not 8 bytes, so the file is damaged");
    if (head.type == OniRecord::string_property) {
      const auto text = value.block(bytes);
      if (text.empty() || text.back() != '\0') return bad_here("a text has no end, so the file is damaged");
    }
    if (is_int) {
      const auto number = value.number<std::uint64_t>();
      if (name == "oniPixelFormat") n.stream.pixel_format = number;
      if (name == "xnPixelFormat" && n.type == OniNode::image && n.stream.pixel_format == 0)
        n.stream.pixel_format = number == 1 ? kOniRgb888 : 0;
      if (name == "xnMirror") n.stream.is_mirrored = number != 0;
      if (name == "AlternativeViewPoint") n.stream.sees_from_color = number != 0;
      if (name == "xnDeviceMaxDepth") n.has_depth_max = true;
      if (name == "oniRequiredFrameSize" || name == "RequiredDataSize") n.frame_bytes_needed = number;
      return {};
    }
    if (head.type != OniRecord::general_property) return {};
    if (name == "xnMapOutputMode") {
      if (bytes != 12) return bad_here("a stream's mode has not 12 bytes, so the file is damaged");
      if (n.has_mode) return bad_here("a stream changes its mode, which is not supported");
      const auto width = value.number<std::uint32_t>(), height = value.number<std::uint32_t>(),
                 rate = value.number<std::uint32_t>();
      if (width < 1 || height < 1 || width > 4096 || height > 4096 || rate > 1000)
        return bad_here("a stream has an impossible mode, so the file is damaged");
      n.stream.width = static_cast<int>(width);
      n.stream.height = static_cast<int>(height);
      n.stream.frame_rate_hz = static_cast<int>(rate);
      n.has_mode = true;
    }
    if (name == "xnCropping") {
      if (bytes != 12) return bad_here("a stream's cropping has not 12 bytes, so the file is damaged");
      if (value.number<std::uint32_t>() != 0) return bad_here("a stream is cropped, which is not supported");
      n.has_cropping = true;
    }
    if (name == "xnFOV") {
      if (bytes != 16) return bad_here("a field of view has not 16 bytes, so the file is damaged");
      n.stream.fov_x_rad = value.number<double>();
      n.stream.fov_y_rad = value.number<double>();
    }
    return {};
  }

  rt::Result<void> make_ready(const RecordHead& head) {
    const auto node = nodes_.find(head.node);
    if (node == nodes_.end()) return bad_here("a stream starts that is not there, so the file is damaged");
    Node& n = node->second;
    n.is_ready = true;
    if (!n.is_stream()) return {};
    if (n.type == OniNode::depth && n.stream.pixel_format == 0) n.stream.pixel_format = kOniDepth1mm;
    if (n.type == OniNode::image && n.stream.pixel_format == 0) n.stream.pixel_format = kOniRgb888;
    const std::uint32_t codec = n.stream.codec;
    if (codec != kCodecNone && codec != kCodecJpeg && codec != kCodec16z && codec != kCodec16zTables)
      return bad_here("a stream starts in a compression that OpenNI2's player does not know");
    if (!n.has_mode) return bad_here("a stream starts without a mode, so the file is damaged");
    if (codec == kCodec16zTables && !n.has_depth_max) return bad_here("a depth stream does not say its largest value");
    const std::uint64_t pixel_bytes = n.type == OniNode::image ? 3 : 2;
    if (static_cast<std::uint64_t>(n.stream.width) * static_cast<std::uint64_t>(n.stream.height) * pixel_bytes >
            kOniFrameBytesMax ||
        n.frame_bytes_needed > kOniFrameBytesMax)
      return bad_here("a stream's frames are larger than any that OpenNI2 reads");
    return {};
  }

  rt::Result<void> begin_data(const RecordHead& head, Fields& fields) {
    const auto node = nodes_.find(head.node);
    if (node == nodes_.end() || !node->second.is_stream() || !node->second.is_ready)
      return bad_here("frames begin of what is no stream, so the file is damaged");
    (void)fields.number<std::uint32_t>();
    (void)fields.number<std::uint64_t>();
    return {};
  }

  rt::Result<void> take_frame(const RecordHead& head, Fields& fields) {
    const auto node = nodes_.find(head.node);
    if (node == nodes_.end() || !node->second.is_stream() || !node->second.is_ready)
      return bad_here("a frame belongs to no stream, so the file is damaged");
    Node& n = node->second;
    OniFrameEntry entry;
    entry.time_us = fields.number<std::uint64_t>();
    entry.number = fields.number<std::uint32_t>();
    if (fields.is_short) return {};
    if (entry.time_us > time_max_us_)
      return bad_here("a frame is later than the header's last time, so the file is damaged");
    if (entry.number > n.frames_max)
      return bad_here("a frame's number is beyond the stream's last, so the file is damaged");
    if (head.payload_bytes < 4) return bad_here("a frame is empty, so the file is damaged");
    if (!n.stream.frames.empty() && entry.number <= n.stream.frames.back().number)
      return bad_here("a frame's number does not rise, so the file is damaged");
    n.stream.frames.push_back(entry);
    return {};
  }

  rt::Result<OniIndex> finish() {
    if (is_table_missing_) return cut();
    OniIndex index;
    if (is_cut_ || !has_ended_) index.cut_at = at_;
    for (auto& [id, node] : nodes_) {
      if (node.type == OniNode::depth && !index.depth) index.depth = std::move(node.stream);
      if (node.type == OniNode::image && !index.color) index.color = std::move(node.stream);
      if ((node.type == OniNode::depth || node.type == OniNode::image) && node.is_ready && !node.has_cropping)
        return bad("a stream does not say whether it is cropped, and OpenNI2's player then gives no frame of it");
    }
    if (index.color && index.color->frames.empty()) index.color.reset();
    if (!index.depth || index.depth->frames.empty())
      return bad(index.color ? "holds colour frames alone, and no depth frame" : "holds no frames");
    return index;
  }

  std::string name_;
  std::ifstream in_;
  std::uint64_t file_bytes_ = 0, at_ = 0, time_max_us_ = 0;
  std::uint32_t node_max_ = 0;
  std::size_t head_bytes_ = kRecordHeadBytes;
  std::vector<char> fields_;
  std::map<std::uint32_t, Node> nodes_;
  bool has_ended_ = false, is_cut_ = false, is_table_missing_ = false;
};

}  // namespace

rt::Result<OniIndex> read_oni_index(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return rt::Error{rt::ExitCode::bad_input, file.string() + ": there is no such file."};
  return Walker(file).walk();
}

}  // namespace tactus::hal::openni2
