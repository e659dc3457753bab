#include "firmware_host/report.hpp"

#include "firmware_host/html.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/report_sections.hpp"
#include "firmware_host/report_style.hpp"

namespace tactus::firmware {

rt::Result<std::string> report_html(const RunResult& r) {
  auto pictures = pictures_section(r);
  if (!pictures) return pictures.error();
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<title>tactus · " +
      escaped(r.source) + "</title><style>";
  html += kReportStyle;
  html += "</style></head>\n<body><main>\n";
  html += headline_section(r);
  html += notes_section(r);
  html += game_section(r);
  html += *pictures;
  html += trajectory_section(r);
  html += latency_section(r);
  html += sensor_section(r);
  html += memory_section(r);
  html += labels_section(r);
  html += events_section(r);
  html += provenance_section(r);
  html += "</main></body></html>\n";
  return html;
}

rt::Result<void> write_report(const std::filesystem::path& file, const RunResult& result) {
  auto html = report_html(result);
  if (!html) return html.error();
  return write_file(file, *html);
}

}  // namespace tactus::firmware
