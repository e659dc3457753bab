// The user study's questionnaire (the paper's section V-B) as one web page that sends nothing anywhere.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "rt/status.hpp"

namespace tactus::firmware {

struct StudyClip {
  std::string name;    // of the condition, as in the CSV's columns
  std::string source;  // where the page finds it: a data URI, or a percent-encoded path beside the page
  std::uintmax_t bytes_count = 0;
};

struct StudyForm {
  std::string title;
  double min_view_s = 10;  // a clip can be rated once it has played for so long
  std::vector<StudyClip> clips;
};

/// The whole page. Its CSV is what ratings_file.hpp reads, with the columns `order` and `comment` beside.
/// Text is made safe here; of a source only the characters that end an attribute.
[[nodiscard]] std::string study_form_html(const StudyForm& form);

/// *.mp4 in `folder`: none, uniform and semantic first, then by name. bad_input when the folder cannot be
/// read or a name cannot be a column's, bad_usage when there are fewer than two.
rt::Result<std::vector<std::filesystem::path>> find_clips(const std::filesystem::path& folder);

/// How a page at `page` refers to `file`: relative, every byte percent-encoded that is not unreserved (RFC
/// 3986).
[[nodiscard]] std::string relative_url(const std::filesystem::path& file, const std::filesystem::path& page);

}  // namespace tactus::firmware
