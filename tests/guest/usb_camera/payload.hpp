// A frame cut into UVC payloads, each with its header.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tactus::guest {

struct PayloadHeader {
  static constexpr std::size_t kBytes = 12;
  bool frame_id = false;  // turns with every frame
  bool is_last = false;   // of its frame
  bool has_error = false;
  std::uint32_t presentation_time = 0;  // when the frame was taken, on the device's clock
  std::uint32_t source_time = 0;        // that clock when this header was made
  std::uint16_t bus_frame = 0;          // the bus's count of milliseconds then, 11 bits
};

std::array<std::uint8_t, PayloadHeader::kBytes> to_bytes(const PayloadHeader& header);

/// Sends one frame at a time. The frame's bytes must stay where they are meanwhile.
class FrameCutter {
 public:
  struct Frame {
    std::span<const std::uint8_t> bytes;
    std::uint32_t presentation_time = 0;
    bool has_error = false;  // marked so in its last payload
  };
  void begin(const Frame& frame);
  [[nodiscard]] bool is_sending() const { return is_sending_; }
  [[nodiscard]] bool is_past_half() const { return 2 * sent_bytes_ >= frame_.bytes.size(); }
  void drop() { is_sending_ = false; }

  /// The next payload of at most `most_bytes` with its header.
  std::vector<std::uint8_t> next(std::size_t most_bytes, std::uint32_t source_time, std::uint16_t bus_frame);

 private:
  Frame frame_;
  bool frame_id_ = false, is_sending_ = false;
  std::size_t sent_bytes_ = 0;
};

}  // namespace tactus::guest
