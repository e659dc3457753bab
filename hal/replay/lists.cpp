#include "hal/replay/lists.hpp"

#include <algorithm>
#include <optional>

#include "hal/replay/text.hpp"

namespace tactus::hal::replay {

rt::Result<FrameList> parse_frame_list(std::string_view text, std::string_view file) {
  FrameList list;
  list.file = file;
  std::optional<int> first_bad_line;
  std::string first_bad_text;
  LineReader lines(text);
  std::string_view line;
  std::uint64_t good_count = 0;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    ListEntry entry;
    entry.sequence = list.entries.size();
    entry.line = lines.line_number();
    std::string_view rest = line;
    const auto ns = parse_seconds_as_ns(next_word(rest));
    // The rest of the line is the path, blanks inside included.
    const std::size_t begin = rest.find_first_not_of(" \t");
    const std::size_t end = rest.find_last_not_of(" \t");
    if (ns && begin != std::string_view::npos && rest.find('\0') == std::string_view::npos) {
      entry.time = {*ns};
      entry.path = rest.substr(begin, end - begin + 1);
      ++good_count;
    } else {
      entry.fault = ListEntry::Fault::unreadable;
      if (!first_bad_line) {
        first_bad_line = entry.line;
        first_bad_text = quote(line);
      }
    }
    list.entries.push_back(std::move(entry));
  }
  if (good_count == 0) {
    if (first_bad_line)
      return bad_input(file, *first_bad_line,
                       first_bad_text + " is not \"timestamp path\", and no other line is either");
    return bad_input(file, 0, "the list is empty; it must have one \"timestamp path\" line per frame");
  }
  check_times(list);
  return list;
}

std::vector<bool> longest_increasing(std::span<const std::int64_t> times) {
  // tails[k]: index of the smallest last time of an increasing run of k + 1 elements.
  std::vector<std::size_t> tails;
  std::vector<std::ptrdiff_t> previous(times.size(), -1);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto place =
        std::lower_bound(tails.begin(), tails.end(), times[i],
                         [&](std::size_t index, std::int64_t time) { return times[index] < time; });
    if (place != tails.begin()) previous[i] = static_cast<std::ptrdiff_t>(*(place - 1));
    if (place == tails.end())
      tails.push_back(i);
    else if (times[*place] != times[i])
      *place = i;
  }
  std::vector<bool> kept(times.size(), false);
  for (std::ptrdiff_t i = tails.empty() ? -1 : static_cast<std::ptrdiff_t>(tails.back()); i >= 0;
       i = previous[static_cast<std::size_t>(i)])
    kept[static_cast<std::size_t>(i)] = true;
  return kept;
}

void check_times(FrameList& list) {
  std::vector<std::int64_t> times;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < list.entries.size(); ++i)
    if (list.entries[i].fault == ListEntry::Fault::none) {
      times.push_back(list.entries[i].time.ns);
      indices.push_back(i);
    }
  const std::vector<bool> kept = longest_increasing(times);
  std::optional<std::int64_t> before;
  for (std::size_t k = 0; k < indices.size(); ++k) {
    ListEntry& entry = list.entries[indices[k]];
    if (!kept[k]) {
      entry.fault = ListEntry::Fault::time_not_later;
      continue;
    }
    if (before && times[k] - *before >= kJumpMin.ns)
      list.jumps.push_back({entry.sequence, {times[k] - *before}});
    before = times[k];
  }
}

TimeIndex::TimeIndex(const FrameList& list) {
  for (std::size_t i = 0; i < list.entries.size(); ++i)
    if (list.entries[i].fault == ListEntry::Fault::none) items_.push_back({list.entries[i].time.ns, i});
}

std::optional<std::size_t> TimeIndex::nearest(rt::SensorTime time, rt::Duration distance_max) const {
  const auto after = std::lower_bound(items_.begin(), items_.end(), time.ns,
                                      [](const Item& item, std::int64_t ns) { return item.time_ns < ns; });
  std::optional<std::size_t> best;
  std::int64_t best_distance = distance_max.ns;
  if (after != items_.begin() && time.ns - (after - 1)->time_ns <= best_distance) {
    best = (after - 1)->index;
    best_distance = time.ns - (after - 1)->time_ns;
  }
  if (after != items_.end() && after->time_ns - time.ns <= best_distance &&
      (!best || after->time_ns - time.ns < best_distance))
    best = after->index;
  return best;
}

}  // namespace tactus::hal::replay
