#include "hal/replay/frame_source.hpp"

#include <algorithm>
#include <type_traits>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/image_codec.hpp"
#include "hal/replay/text.hpp"

namespace tactus::hal::replay {
namespace {

std::string decode(std::string_view bytes, int width, int height, std::span<std::uint16_t> depth) {
  std::string fault = decode_depth(bytes, width, height, depth);
  // 65535 is 7-Scenes' "no measurement", and a saturated sensor's in any unit.
  if (fault.empty()) std::replace(depth.begin(), depth.end(), std::uint16_t{65535}, std::uint16_t{0});
  return fault;
}

std::string decode(std::string_view bytes, int width, int height, std::span<std::uint8_t> rgb) {
  return decode_color(bytes, width, height, rgb);
}

}  // namespace

template <typename Pixel>
std::size_t FrameSource<Pixel>::pixels_count() const {
  const auto count = static_cast<std::size_t>(config_.width) * static_cast<std::size_t>(config_.height);
  return std::is_same_v<Pixel, std::uint8_t> ? count * 3 : count;
}

/// Passes over entries whose time does not fit. False at the end.
template <typename Pixel>
bool FrameSource<Pixel>::find_next(FrameOutcome& outcome) {
  outcome = {};
  const std::string list_file = (config_.directory / config_.list.file).string();
  for (; next_ < config_.end; ++next_) {
    const ListEntry& entry = config_.list.entries[next_];
    if (entry.fault != ListEntry::Fault::time_not_later) break;
    ++outcome.timestamps_rejected;
    say(outcome, bad_input(list_file, entry.line,
                           "the time of " + quote(entry.path) + " does not fit between its neighbours'")
                     .message);
  }
  if (next_ == config_.end) return false;
  const ListEntry& entry = config_.list.entries[next_];
  outcome.header = {entry.time, entry.sequence, {}};
  outcome.status = rt::Status::ok;
  if (entry.fault != ListEntry::Fault::unreadable) return true;
  ++next_;
  outcome.status = rt::Status::corrupt;
  say(outcome, bad_input(list_file, entry.line, "the line is not \"timestamp path\"").message);
  return true;
}

template <typename Pixel>
void FrameSource<Pixel>::peek(FrameOutcome& outcome) {
  (void)find_next(outcome);
}

template <typename Pixel>
void FrameSource<Pixel>::next(std::span<Pixel> pixels, FrameOutcome& outcome) {
  TACTUS_ASSERT(pixels.size() == pixels_count());
  if (!find_next(outcome) || outcome.status == rt::Status::corrupt) return;
  outcome.status = rt::Status::corrupt;
  const std::filesystem::path path = config_.directory / config_.list.entries[next_++].path;
  if (const auto read = read_file(path, kImageBytesMax, bytes_); !read)
    return say(outcome, read.error().message);
  if (const std::string fault = decode(bytes_, config_.width, config_.height, pixels); !fault.empty())
    return say(outcome, bad_input(path.string(), 0, fault).message);
  outcome.status = rt::Status::ok;
}

template class FrameSource<std::uint16_t>;
template class FrameSource<std::uint8_t>;

}  // namespace tactus::hal::replay
