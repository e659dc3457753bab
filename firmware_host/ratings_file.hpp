// The answers to the user study's questions, as `study form` and any spreadsheet write them: CSV with a header (RFC 4180:
// quotes, doubled quotes and line ends inside them; CR LF or LF; a byte order mark may lead).
//
//   participant          a name or number, each once
//   confirmed            yes | no (1 | 0): the participant says that the clips were watched and compared
//   rating_CONDITION     1 to 10, halves and decimals allowed; empty: no answer. Two conditions or more
//   viewed_CONDITION_s   seconds for which the clip was watched
//   background_FACTOR    any word or number: splits the participants into groups (background_fps, background_vr_ar)
//   anything else        is left alone (free text)
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "rt/status.hpp"

namespace tactus::firmware {

/// The paper left out who had not confirmed and who had watched a clip for less than this.
inline constexpr double kViewedMinS = 10;

enum class LeftOut : unsigned char { no, not_confirmed, viewed_too_briefly, unanswered };

struct Answer {
  std::string participant;
  LeftOut left_out = LeftOut::no;
  std::vector<double> ratings;           // per condition; NaN where there is none
  std::vector<std::string> backgrounds;  // per factor
};

struct RatingsFile {
  std::vector<std::string> conditions, factors;  // in the file's order
  std::vector<Answer> answers;
};

/// bad_input with line and column when the file is not as above. `name` is for messages.
rt::Result<RatingsFile> parse_ratings(std::string_view text, const std::string& name);
rt::Result<RatingsFile> read_ratings(const std::filesystem::path& path);

}  // namespace tactus::firmware
