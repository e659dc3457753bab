// Text made safe for HTML, and numbers made readable.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace tactus::firmware {

/// & < > " ' become entities, control characters and bytes that are not UTF-8 become U+FFFD: safe in text and
/// in quoted attributes, whatever file names and device strings hold.
std::string escaped(std::string_view text);

/// Base64 of RFC 4648, for data URIs.
std::string base64(std::string_view bytes);

/// printf for one number.
inline std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

/// Three significant digits where they matter: 0.042, 1.23, 12.3, 123.
std::string readable(double value);

/// As few digits as say it, six at most: 30, 0.01, 4.9. For settings, where readable() is for measurements.
std::string shortest(double value);

/// 12 345 with thin no-break spaces.
std::string grouped(std::uint64_t value);

/// "12.3 MiB", "640 KiB", "96 B".
std::string readable_bytes(std::uint64_t bytes);

}  // namespace tactus::firmware
