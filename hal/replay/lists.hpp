// Lists of frames: TUM's `timestamp path` text, and what is wrong with its times.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::hal::replay {

/// One frame that a list promises.
struct ListEntry {
  enum class Fault : std::uint8_t {
    none,
    unreadable,      // the line is no "timestamp path"
    time_not_later,  // the time does not fit between its neighbours'; the frame is left out
  };
  std::uint64_t sequence = 0;  // place in the list, faulty entries counted
  rt::SensorTime time;
  std::string path;  // as written in the list
  int line = 0;      // 0: not from a text
  Fault fault = Fault::none;
};

/// A pause in the recording: not an error, but told.
struct TimeJump {
  std::uint64_t sequence = 0;  // the frame after the pause
  rt::Duration gap;
};
inline constexpr rt::Duration kJumpMin{1'000'000'000};

struct FrameList {
  std::string file;  // for messages
  std::vector<ListEntry> entries;
  std::vector<TimeJump> jumps;
};

/// Parses "timestamp path" lines; '#' starts a comment line. Faulty lines become faulty entries (counted when
/// the reader comes to them). Error: the text holds no good entry at all. Boot phase.
rt::Result<FrameList> parse_frame_list(std::string_view text, std::string_view file);

/// Marks entries whose time is not later than the frame before, so that the fewest frames are lost: what
/// remains is a longest strictly increasing subsequence (Fredman 1975, n log n), of equal times the first. A
/// single time far in the future therefore costs one frame, not all that follow. Fills `jumps`.
void check_times(FrameList& list);

/// Which of `times` belong to a longest strictly increasing subsequence, as one flag per element.
std::vector<bool> longest_increasing(std::span<const std::int64_t> times);

/// Finds entries by time. Built from a list that has been through check_times(); does not keep the list.
class TimeIndex {
 public:
  explicit TimeIndex(const FrameList& list);
  /// Place in `list.entries` of the good entry nearest in time (of two as near the earlier), when one is
  /// within `distance_max`.
  [[nodiscard]] std::optional<std::size_t> nearest(rt::SensorTime time, rt::Duration distance_max) const;

 private:
  struct Item {
    std::int64_t time_ns;
    std::size_t index;
  };
  std::vector<Item> items_;  // times strictly increase
};

}  // namespace tactus::hal::replay
