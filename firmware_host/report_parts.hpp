// What every section of report.html is made of, as HTML text.
#pragma once

#include <cstdint>
#include <string>

namespace tactus::firmware {

std::string section(const char* id, const std::string& title, const std::string& about, const std::string& body);

/// A cell of a table with a number in it.
std::string cell(const std::string& text);

/// A bar, full at 1; grey when nothing is known.
std::string meter(double share, bool is_known = true);

/// "1 keyframe", "1,234 keyframes".
std::string plural(std::uint64_t count, const std::string& one, const std::string& many);

}  // namespace tactus::firmware
