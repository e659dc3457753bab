#include "tests/guest/usb_camera/usbip.hpp"

#include <algorithm>

namespace tactus::guest::usbip {
namespace {

// Commands, and the places of what is read or written; all other bytes are zero or of no interest to a device with
// control and bulk endpoints.
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitAnswer = 3, kUnlinkAnswer = 4;
constexpr std::size_t kCommandAt = 0, kNumberAt = 4, kDirectionAt = 12, kEndpointAt = 16;
constexpr std::size_t kSubmitLengthAt = 24, kSetupAt = 40, kUnlinkedNumberAt = 20;
constexpr std::size_t kStatusAt = 20, kActualLengthAt = 24;

std::uint32_t get(std::span<const std::uint8_t, kMessageBytes> message, std::size_t at) {
  return static_cast<std::uint32_t>(message[at]) << 24 | static_cast<std::uint32_t>(message[at + 1]) << 16 |
         static_cast<std::uint32_t>(message[at + 2]) << 8 | message[at + 3];
}

void put(Message& message, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) message[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

Message answer(std::uint32_t command, std::uint32_t number, std::int32_t status) {
  Message message{};
  put(message, kCommandAt, command);
  put(message, kNumberAt, number);
  put(message, kStatusAt, static_cast<std::uint32_t>(status));
  return message;
}

}  // namespace

std::optional<std::variant<Submit, Unlink>> parse(std::span<const std::uint8_t, kMessageBytes> message) {
  const std::uint32_t command = get(message, kCommandAt);
  if (command == kUnlink) return Unlink{get(message, kNumberAt), get(message, kUnlinkedNumberAt)};
  if (command != kSubmit) return std::nullopt;
  Submit submit{get(message, kNumberAt), get(message, kEndpointAt), get(message, kDirectionAt) != 0,
                get(message, kSubmitLengthAt), {}};
  std::copy_n(message.begin() + kSetupAt, submit.setup.size(), submit.setup.begin());
  return submit;
}

Message submit_answer(std::uint32_t number, std::int32_t status, std::uint32_t data_bytes) {
  Message message = answer(kSubmitAnswer, number, status);
  put(message, kActualLengthAt, data_bytes);
  return message;
}

Message unlink_answer(std::uint32_t number, std::int32_t status) { return answer(kUnlinkAnswer, number, status); }

}  // namespace tactus::guest::usbip
