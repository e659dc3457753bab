// The one style sheet of report.html.
#pragma once

#include <string_view>

namespace tactus::firmware {

extern const std::string_view kReportStyle;

}  // namespace tactus::firmware
