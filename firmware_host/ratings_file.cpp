#include "firmware_host/ratings_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "pipeline/evaluate/text.hpp"

namespace tactus::firmware {
namespace {

constexpr double kRatingMin = 1, kRatingMax = 10;

struct Record {
  std::vector<std::string> fields;
  std::size_t line = 0;
};

rt::Error at(const std::string& name, std::size_t line, const std::string& what) {
  return {rt::ExitCode::bad_input, name + ":" + std::to_string(line) + ": " + what};
}

rt::Result<std::vector<Record>> split(std::string_view text, const std::string& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<Record> records;
  std::size_t line = 1;
  for (std::size_t i = 0; i < text.size();) {
    Record record{{}, line};
    for (bool has_more = true; has_more;) {
      std::string field;
      if (i < text.size() && text[i] == '"') {
        const std::size_t opened_line = line;
        for (++i;; ++i) {
          if (i >= text.size()) return at(name, opened_line, "a quote is opened and never closed.");
          if (text[i] == '"' && (i + 1 >= text.size() || text[i + 1] != '"')) break;
          if (text[i] == '"') ++i;
          if (text[i] == '\n') ++line;
          field += text[i];
        }
        ++i;
      }
      while (i < text.size() && text[i] != ',' && text[i] != '\n') field += text[i++];
      if (!field.empty() && field.back() == '\r') field.pop_back();
      const std::size_t first = field.find_first_not_of(" \t"), last = field.find_last_not_of(" \t");
      record.fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
      has_more = i < text.size() && text[i] == ',';
      if (i < text.size()) line += text[i++] == '\n' ? 1u : 0u;
    }
    if (record.fields.size() > 1 || !record.fields[0].empty()) records.push_back(std::move(record));
  }
  return records;
}

std::optional<bool> yes_or_no(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (word == "yes" || word == "1" || word == "true") return true;
  if (word == "no" || word == "0" || word == "false") return false;
  return std::nullopt;
}

/// Places of the columns that are read.
struct Columns {
  std::size_t participant = 0, confirmed = 0;
  std::vector<std::size_t> rating, viewed, background;
};

rt::Result<Columns> find_columns(const Record& header, const std::string& name, RatingsFile& file) {
  const auto& titles = header.fields;
  const auto place_of = [&](const std::string& title) -> std::optional<std::size_t> {
    const auto found = std::find(titles.begin(), titles.end(), title);
    if (found == titles.end()) return std::nullopt;
    return static_cast<std::size_t>(found - titles.begin());
  };
  std::set<std::string> seen;
  for (const std::string& title : titles)
    if (!title.empty() && !seen.insert(title).second)
      return at(name, header.line, "the column " + title + " is there twice; keep one.");
  Columns columns;
  for (const auto& [title, place] : {std::pair{"participant", &columns.participant}, {"confirmed", &columns.confirmed}}) {
    const auto found = place_of(title);
    if (!found) return at(name, header.line, "the header has no column " + std::string(title) + "; add it.");
    *place = *found;
  }
  for (std::size_t i = 0; i < titles.size(); ++i) {
    constexpr std::string_view kRating = "rating_", kBackground = "background_";
    if (titles[i].starts_with(kRating)) {
      const std::string condition = titles[i].substr(kRating.size());
      const auto viewed = place_of("viewed_" + condition + "_s");
      if (!viewed)
        return at(name, header.line,
                  "there is " + titles[i] + " but no viewed_" + condition + "_s, which says how long its clip was watched.");
      file.conditions.push_back(condition);
      columns.rating.push_back(i);
      columns.viewed.push_back(*viewed);
    } else if (titles[i].starts_with(kBackground)) {
      file.factors.push_back(titles[i].substr(kBackground.size()));
      columns.background.push_back(i);
    }
  }
  if (file.conditions.size() < 2)
    return at(name, header.line, "the header needs a column rating_CONDITION for two conditions at least.");
  return columns;
}

}  // namespace

rt::Result<RatingsFile> parse_ratings(std::string_view text, const std::string& name) {
  auto records = split(text, name);
  if (!records) return records.error();
  if (records->empty()) return at(name, 1, "the file is empty; the first line names the columns.");
  RatingsFile file;
  const Record& header = records->front();
  const auto columns = find_columns(header, name, file);
  if (!columns) return columns.error();
  std::set<std::string> participants;
  for (std::size_t r = 1; r < records->size(); ++r) {
    const Record& record = (*records)[r];
    if (record.fields.size() != header.fields.size())
      return at(name, record.line,
                "there are " + std::to_string(record.fields.size()) + " fields where the header has " +
                    std::to_string(header.fields.size()) + ".");
    const auto wrong = [&](std::size_t column, const std::string& expected) {
      return at(name, record.line, header.fields[column] + " is '" + record.fields[column] + "', expected " + expected + ".");
    };
    Answer answer;
    answer.participant = record.fields[columns->participant];
    if (answer.participant.empty() || !participants.insert(answer.participant).second)
      return wrong(columns->participant, "a name that no other line has");
    const auto confirmed = yes_or_no(record.fields[columns->confirmed]);
    if (!confirmed) return wrong(columns->confirmed, "yes or no");
    bool is_viewed = true, is_answered = true;
    for (std::size_t c = 0; c < file.conditions.size(); ++c) {
      double viewed_s = 0, rating = std::numeric_limits<double>::quiet_NaN();
      const std::string &viewed = record.fields[columns->viewed[c]], &rated = record.fields[columns->rating[c]];
      if (!viewed.empty() && (!evaluate::parse_number(viewed, viewed_s) || !(viewed_s >= 0) || std::isinf(viewed_s)))
        return wrong(columns->viewed[c], "seconds, 0 or more");
      if (!rated.empty() && (!evaluate::parse_number(rated, rating) || !(rating >= kRatingMin && rating <= kRatingMax)))
        return wrong(columns->rating[c], "a rating from 1 to 10, or nothing");
      is_viewed = is_viewed && viewed_s >= kViewedMinS;
      is_answered = is_answered && !rated.empty();
      answer.ratings.push_back(rating);
    }
    answer.left_out = !*confirmed    ? LeftOut::not_confirmed
                      : !is_viewed   ? LeftOut::viewed_too_briefly
                      : !is_answered ? LeftOut::unanswered
                                     : LeftOut::no;
    for (const std::size_t column : columns->background) answer.backgrounds.push_back(record.fields[column]);
    file.answers.push_back(std::move(answer));
  }
  return file;
}

rt::Result<RatingsFile> read_ratings(const std::filesystem::path& path) {
  auto text = evaluate::read_file(path, std::size_t{64} << 20);
  if (!text) return text.error();
  return parse_ratings(*text, path.string());
}

}  // namespace tactus::firmware
