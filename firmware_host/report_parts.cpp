#include "firmware_host/report_parts.hpp"

#include <algorithm>

#include "firmware_host/html.hpp"

namespace tactus::firmware {

std::string section(const char* id, const std::string& title, const std::string& about, const std::string& body) {
  return "<section id=\"" + std::string(id) + "\"><h2>" + title + "</h2>" +
         (about.empty() ? "" : "<p class=\"about\">" + about + "</p>") + body + "</section>\n";
}

std::string cell(const std::string& text) { return "<td class=\"n\">" + text + "</td>"; }

std::string meter(double share, bool is_known) {
  return "<div class=\"meter" + std::string(is_known ? "" : " none") +
         "\"><i style=\"width:" + fixed(std::clamp(share, 0.0, 1.0) * 100, 1) + "%\"></i></div>";
}

std::string plural(std::uint64_t count, const std::string& one, const std::string& many) {
  return grouped(count) + " " + (count == 1 ? one : many);
}

}  // namespace tactus::firmware
