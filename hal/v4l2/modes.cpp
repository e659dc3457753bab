#include "hal/v4l2/modes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "hal/v4l2/fourcc.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr int kWidthDefault = 640, kHeightDefault = 480;  // what the pipeline's plan is made for
constexpr double kRateDefaultHz = 30;
constexpr double kRateTolerance = 0.01;  // 29.97 Hz is 30 Hz, 25 Hz is not

constexpr std::string_view name_of(Stream stream) { return stream == Stream::depth ? "depth" : "colour"; }

/// A size that can be set, of one offer.
struct Candidate {
  std::uint32_t fourcc = 0;
  PixelFormat format = PixelFormat::depth16;
  const SizeOffer* offer = nullptr;
  int width = 0, height = 0;
};

std::string hz_text(double hz) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", hz);
  return text;
}

std::string joined(const std::vector<std::string>& items) {
  std::string out;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) out += i + 1 == items.size() ? " and " : ", ";
    out += items[i];
  }
  return out;
}

void add_once(std::vector<std::string>& items, std::string item) {
  if (std::find(items.begin(), items.end(), item) == items.end()) items.push_back(std::move(item));
}

std::string extent_text(const Extent& extent) {
  if (extent.min == extent.max) return std::to_string(extent.min);
  return std::to_string(extent.min) + ".." + std::to_string(extent.max);
}

std::string size_text(const SizeOffer& offer) { return extent_text(offer.width) + "x" + extent_text(offer.height); }

std::string rates_text(const SizeOffer& offer) {
  if (offer.intervals.empty()) return "";
  if (offer.is_interval_range)
    return hz_text(offer.intervals.back().hz()) + ".." + hz_text(offer.intervals.front().hz()) + " Hz";
  std::string text;
  for (const Interval& interval : offer.intervals) text += (text.empty() ? "" : ", ") + hz_text(interval.hz());
  return text + " Hz";
}

std::string formats_text(std::span<const FormatOffer> offers) {
  std::vector<std::string> names;
  for (const FormatOffer& offer : offers) add_once(names, fourcc_text(offer.fourcc));
  return names.empty() ? "no format at all" : joined(names);
}

/// What there is of the sizes of `candidates`, each with its formats: "Y16 and Y12 at 320x180".
std::string sizes_text(const std::vector<Candidate>& candidates) {
  std::vector<std::string> formats;
  for (const Candidate& c : candidates) add_once(formats, fourcc_text(c.fourcc));
  std::vector<std::string> texts;
  for (const std::string& format : formats) {
    std::vector<std::string> sizes;
    for (const Candidate& c : candidates)
      if (fourcc_text(c.fourcc) == format) add_once(sizes, size_text(*c.offer));
    texts.push_back(format + " at " + joined(sizes));
  }
  return joined(texts);
}

std::string rates_text(const std::vector<Candidate>& candidates) {
  std::vector<std::string> texts;
  for (const Candidate& c : candidates) {
    const std::string rates = rates_text(*c.offer);
    add_once(texts, fourcc_text(c.fourcc) + " " + std::to_string(c.width) + "x" + std::to_string(c.height) +
                        (rates.empty() ? " at a rate that its driver does not tell" : " at " + rates));
  }
  return joined(texts);
}

bool is_near(double hz, double wanted_hz) { return std::fabs(hz - wanted_hz) <= kRateTolerance * wanted_hz; }

/// The offered interval nearest to a rate; within a range, the rate itself in thousandths of a hertz.
std::optional<Interval> nearest_interval(const SizeOffer& offer, double wanted_hz) {
  if (offer.intervals.empty()) return std::nullopt;
  if (offer.is_interval_range) {
    const Interval& shortest = offer.intervals.front();
    const Interval& longest = offer.intervals.back();
    if (wanted_hz >= shortest.hz()) return shortest;
    if (wanted_hz <= longest.hz()) return longest;
    return Interval{1000, static_cast<std::uint32_t>(std::lround(wanted_hz * 1000))};
  }
  return *std::min_element(offer.intervals.begin(), offer.intervals.end(), [&](const Interval& a, const Interval& b) {
    return std::fabs(a.hz() - wanted_hz) < std::fabs(b.hz() - wanted_hz);
  });
}

std::vector<Candidate> candidates_of(std::span<const FormatOffer> offers, const ModeWish& wish,
                                     std::optional<std::uint32_t> fourcc) {
  const int width = wish.mode.width > 0 ? wish.mode.width : kWidthDefault;
  const int height = wish.mode.height > 0 ? wish.mode.height : kHeightDefault;
  std::vector<Candidate> out;
  for (const ReadableFormat& readable : readable_formats(wish.stream))
    for (const FormatOffer& offer : offers) {
      if (offer.fourcc != readable.fourcc || (fourcc && offer.fourcc != *fourcc)) continue;
      for (const SizeOffer& size : offer.sizes)
        out.push_back({offer.fourcc, readable.format, &size, size.width.nearest(width), size.height.nearest(height)});
    }
  return out;
}

/// Keeps those with the smallest `distance`.
template <typename Distance>
void keep_nearest(std::vector<Candidate>& candidates, const Distance& distance) {
  double smallest = distance(candidates.front());
  for (const Candidate& c : candidates) smallest = std::min(smallest, distance(c));
  std::erase_if(candidates, [&](const Candidate& c) { return distance(c) > smallest; });
}

double rate_distance(const Candidate& candidate, double wanted_hz) {
  const auto interval = nearest_interval(*candidate.offer, wanted_hz);
  if (!interval) return 0;  // the driver does not say: it may well be the wanted one
  return is_near(interval->hz(), wanted_hz) ? 0 : std::fabs(interval->hz() - wanted_hz);
}

rt::Error no_format(std::span<const FormatOffer> offers, const ModeWish& wish, std::string_view device) {
  std::vector<std::string> readable;
  for (const ReadableFormat& format : readable_formats(wish.stream)) readable.push_back(fourcc_text(format.fourcc));
  const std::string what = std::string(name_of(wish.stream));
  if (wish.format.empty())
    return {rt::ExitCode::device_unavailable,
            std::string(device) + " has no " + what + " format that can be read (" + joined(readable) + "); it has " +
                formats_text(offers) + ", so choose another device (tactus devices lists them)"};
  const auto known = parse_fourcc(wish.format);
  const bool is_readable = known && std::any_of(readable_formats(wish.stream).begin(), readable_formats(wish.stream).end(),
                                                [&](const ReadableFormat& r) { return r.fourcc == *known; });
  if (!is_readable)
    return {rt::ExitCode::bad_usage, "the format " + wish.format + " cannot be read as " + what + "; use " +
                                         joined(readable) + ", or leave it to the device"};
  const auto any = candidates_of(offers, wish, std::nullopt);
  std::vector<std::string> offered;
  for (const Candidate& c : any) add_once(offered, fourcc_text(c.fourcc));
  return {rt::ExitCode::device_unavailable,
          std::string(device) + " does not offer " + fourcc_text(*known) + "; " +
              (offered.empty() ? "of what can be read as " + what + " it has nothing, only " + formats_text(offers)
                               : "as " + what + " it has " + joined(offered))};
}

}  // namespace

int Extent::nearest(int wanted) const {
  const int clamped = std::clamp(wanted, min, max);
  if (step <= 1 || min == max) return clamped;
  const int steps = std::min((clamped - min + step / 2) / step, (max - min) / step);
  return min + steps * step;
}

rt::Result<ModeChoice> choose_mode(std::span<const FormatOffer> offers, const ModeWish& wish, std::string_view device) {
  const auto fourcc = wish.format.empty() ? std::nullopt : parse_fourcc(wish.format);
  if (!wish.format.empty() && !fourcc) return no_format(offers, wish, device);
  std::vector<Candidate> candidates = candidates_of(offers, wish, fourcc);
  if (candidates.empty()) return no_format(offers, wish, device);

  const std::vector<Candidate> all = candidates;
  const ModeRequest& mode = wish.mode;
  std::erase_if(candidates, [&](const Candidate& c) {
    return (mode.width > 0 && c.width != mode.width) || (mode.height > 0 && c.height != mode.height);
  });
  if (candidates.empty()) {
    const std::string size = mode.width > 0 && mode.height > 0
                                 ? std::to_string(mode.width) + "x" + std::to_string(mode.height)
                             : mode.width > 0 ? "a width of " + std::to_string(mode.width)
                                              : "a height of " + std::to_string(mode.height);
    return rt::Error{rt::ExitCode::device_unavailable, std::string(device) + " does not offer " +
                                                           std::string(name_of(wish.stream)) + " at " + size + "; it has " +
                                                           sizes_text(all)};
  }

  if (mode.frame_rate_hz > 0) {
    const std::vector<Candidate> sized = candidates;
    std::erase_if(candidates, [&](const Candidate& c) { return rate_distance(c, mode.frame_rate_hz) > 0; });
    if (candidates.empty())
      return rt::Error{rt::ExitCode::device_unavailable,
                       std::string(device) + " does not offer " + std::string(name_of(wish.stream)) + " at " +
                           hz_text(mode.frame_rate_hz) + " Hz; it has " + rates_text(sized)};
  }

  const double wanted_hz = mode.frame_rate_hz > 0 ? mode.frame_rate_hz : kRateDefaultHz;
  keep_nearest(candidates, [&](const Candidate& c) {
    const double wanted_pixels = static_cast<double>(mode.width > 0 ? mode.width : kWidthDefault) *
                                 (mode.height > 0 ? mode.height : kHeightDefault);
    return std::fabs(static_cast<double>(c.width) * c.height - wanted_pixels);
  });
  keep_nearest(candidates, [&](const Candidate& c) { return rate_distance(c, wanted_hz); });
  const Candidate& best = candidates.front();
  const auto interval = nearest_interval(*best.offer, wanted_hz);
  ModeChoice choice{best.fourcc, best.format, best.width, best.height, interval.value_or(Interval{})};
  if (!interval && mode.frame_rate_hz > 0)
    choice.interval = {1000, static_cast<std::uint32_t>(std::lround(mode.frame_rate_hz * 1000))};
  return choice;
}

std::vector<std::string> mode_lines(std::span<const FormatOffer> offers) {
  std::vector<std::string> lines;
  std::vector<std::string> unreadable;
  for (const FormatOffer& offer : offers) {
    bool is_readable = false;
    for (const Stream stream : {Stream::depth, Stream::color})
      for (const ReadableFormat& readable : readable_formats(stream)) {
        if (readable.fourcc != offer.fourcc) continue;
        is_readable = true;
        for (const SizeOffer& size : offer.sizes) {
          const std::string rates = rates_text(size);
          lines.push_back(std::string(name_of(stream)) + " " + fourcc_text(offer.fourcc) + " " + size_text(size) +
                          (rates.empty() ? "" : " " + rates));
        }
      }
    if (!is_readable) add_once(unreadable, fourcc_text(offer.fourcc));
  }
  if (!unreadable.empty()) lines.push_back("not readable: " + joined(unreadable));
  return lines;
}

}  // namespace tactus::hal::v4l2
