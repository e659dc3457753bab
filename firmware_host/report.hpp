// report.html: the run for a person, in one file that needs nothing else.
#pragma once

#include <filesystem>
#include <string>

#include "firmware_host/run_result.hpp"

namespace tactus::firmware {

/// The whole page. Nothing is fetched (no address, no script), everything from outside is escaped, pictures
/// are PNG inside the file. Sections without data are left out.
rt::Result<std::string> report_html(const RunResult& result);

rt::Result<void> write_report(const std::filesystem::path& file, const RunResult& result);

/// PNG of an 8-bit RGB image. failed when size and bytes disagree or the encoder refuses.
rt::Result<std::string> encode_png(const Picture& picture);

}  // namespace tactus::firmware
