// The fixed parts of the page that `study form` writes: how it looks and what it does.
#pragma once

#include <string_view>

namespace tactus::firmware {

extern const std::string_view kStudyFormStyle;   // CSS
extern const std::string_view kStudyFormScript;  // JavaScript, reads the JSON in #settings

}  // namespace tactus::firmware
