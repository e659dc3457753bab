#include "tests/guest/usb_camera/payload.hpp"

#include <algorithm>

namespace tactus::guest {
namespace {

// Bits of bmHeaderInfo (UVC 1.0 table 2-5).
constexpr std::uint8_t kFrameId = 1, kEndOfFrame = 2, kHasPresentationTime = 4, kHasSourceClock = 8, kError = 64,
                       kEndOfHeader = 128;

}  // namespace

std::array<std::uint8_t, PayloadHeader::kBytes> to_bytes(const PayloadHeader& header) {
  std::array<std::uint8_t, PayloadHeader::kBytes> bytes{};
  bytes[0] = PayloadHeader::kBytes;
  bytes[1] = static_cast<std::uint8_t>(kHasPresentationTime | kHasSourceClock | kEndOfHeader |
                                       (header.frame_id ? kFrameId : 0) | (header.is_last ? kEndOfFrame : 0) |
                                       (header.has_error ? kError : 0));
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[2 + i] = static_cast<std::uint8_t>(header.presentation_time >> 8 * i);
    bytes[6 + i] = static_cast<std::uint8_t>(header.source_time >> 8 * i);
  }
  const unsigned bus_frame = header.bus_frame & 0x7ffU;
  bytes[10] = static_cast<std::uint8_t>(bus_frame & 255);
  bytes[11] = static_cast<std::uint8_t>(bus_frame >> 8);
  return bytes;
}

void FrameCutter::begin(const Frame& frame) {
  frame_ = frame;
  frame_id_ = !frame_id_;
  is_sending_ = true;
  sent_bytes_ = 0;
}

std::vector<std::uint8_t> FrameCutter::next(std::size_t most_bytes, std::uint32_t source_time,
                                            std::uint16_t bus_frame) {
  const std::size_t room = most_bytes > PayloadHeader::kBytes ? most_bytes - PayloadHeader::kBytes : 0;
  const auto part = frame_.bytes.subspan(sent_bytes_, std::min(room, frame_.bytes.size() - sent_bytes_));
  sent_bytes_ += part.size();
  const bool is_last = sent_bytes_ == frame_.bytes.size();
  const auto header = to_bytes(
      {frame_id_, is_last, is_last && frame_.has_error, frame_.presentation_time, source_time, bus_frame});
  std::vector<std::uint8_t> payload(header.size() + part.size());
  std::copy(part.begin(), part.end(), std::copy(header.begin(), header.end(), payload.begin()));
  is_sending_ = !is_last;
  return payload;
}

}  // namespace tactus::guest
