// Messages of USB/IP as vhci_hcd speaks them: 48 bytes, big-endian, then the data of what was asked for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

namespace tactus::guest::usbip {

inline constexpr std::size_t kMessageBytes = 48;
using Message = std::array<std::uint8_t, kMessageBytes>;

/// The host asks for a transfer; without is_in, data_bytes of data follow the message.
struct Submit {
  std::uint32_t number = 0;  // its name in the answer
  std::uint32_t endpoint = 0;
  bool is_in = false;  // from device to host
  std::uint32_t data_bytes = 0;
  std::array<std::uint8_t, 8> setup{};  // of control transfers
};

/// The host no longer wants an earlier transfer.
struct Unlink {
  std::uint32_t number = 0;
  std::uint32_t submit_number = 0;
};

/// Nothing: neither of the two.
std::optional<std::variant<Submit, Unlink>> parse(std::span<const std::uint8_t, kMessageBytes> message);

/// Of what the kernel calls -EPIPE and -ECONNRESET on every architecture that USB/IP runs on.
inline constexpr std::int32_t kStalled = -32;
inline constexpr std::int32_t kUnlinked = -104;

/// Answers a Submit; with status 0 and is_in, data_bytes of data follow.
Message submit_answer(std::uint32_t number, std::int32_t status, std::uint32_t data_bytes);
/// kUnlinked: it was still waiting and will not be answered; 0: it has been answered already.
Message unlink_answer(std::uint32_t number, std::int32_t status);

}  // namespace tactus::guest::usbip
