// One camera's stream with faults in it.
//
//   source --peek--> decide() --> vanishes: its answer in its place
//                             --> goes on: straight from the source, or out of one of two slots
//
// A frame waits in `swapped_` while its successor goes first, and in `again_` for its second delivery.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hal/faults/fault_draw.hpp"
#include "hal/faults/faults.hpp"

namespace tactus::hal::faults {

struct StreamSetup {
  FaultPlan plan;
  Stream stream = Stream::depth;
  bool is_live = false;
  std::size_t values_count = 0;  // of one image
  std::optional<rt::Clock> clock;
  std::shared_ptr<FaultCounts> counts;
};

/// Source has peek, read, skip and counters as ColorCamera has. Thread-bound; no heap after the constructor.
template <typename Source, typename Pixel>
class FaultyStream {
 public:
  FaultyStream(std::unique_ptr<Source> source, StreamSetup setup)
      : source_(std::move(source)), setup_(std::move(setup)) {
    if (may_hit(FaultKind::out_of_order)) swapped_.pixels.resize(setup_.values_count);
    if (may_hit(FaultKind::duplicate)) again_.pixels.resize(setup_.values_count);
    counters_.first_rejection.reserve(kSentenceBytes);
    merge_counters();
  }

  rt::Status peek(FrameHeader& header, rt::Duration timeout) {
    const rt::Status status = look(deadline_of(timeout));
    if (status == rt::Status::ok) header = next_.header;
    merge_counters();
    return status;
  }

  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration timeout) {
    const rt::HostTime deadline = deadline_of(timeout);
    rt::Status status = look(deadline);
    if (status == rt::Status::ok) {
      const FrameHeader found = next_.header;
      status = take(pixels, deadline);
      if (status == rt::Status::ok) header = found;
    }
    merge_counters();
    return status;
  }

  void skip() {
    if (next_.from != From::nowhere) (void)take({}, deadline_of({}));
    merge_counters();
  }

  [[nodiscard]] const CameraCounters& counters() const { return counters_; }
  [[nodiscard]] Source& source() { return *source_; }
  [[nodiscard]] std::size_t slots_bytes() const {
    return (swapped_.pixels.size() + again_.pixels.size()) * sizeof(Pixel);
  }

 private:
  static constexpr std::size_t kSentenceBytes = 512;  // as the backends

  enum class From : std::uint8_t { nowhere, source, swapped, again };
  enum class Fate : std::uint8_t { goes_on, vanishes, withheld, half, away };

  /// A frame and what was decided of it.
  struct Frame {
    FrameHeader header;
    std::uint64_t sequence = 0;
    rt::HostTime due{};    // not before
    rt::Duration pause{};  // of the reader, after it
    bool doubles = false, swaps = false;
    double spoilt_share = 0;
    std::uint64_t spoiler_index = 0;  // of the fault
    From from = From::nowhere;
  };
  struct Slot {
    Frame frame;
    std::vector<Pixel> pixels;
    int deliveries_left = 0;
  };

  [[nodiscard]] bool may_hit(FaultKind kind) const {
    return std::any_of(setup_.plan.faults.begin(), setup_.plan.faults.end(),
                       [&](const Fault& f) { return f.kind == kind && is_of(f, setup_.stream); });
  }
  void note(FaultKind kind) {
    ++setup_.counts->injected[static_cast<std::size_t>(setup_.stream)][static_cast<std::size_t>(kind)];
  }

  [[nodiscard]] rt::HostTime now() const { return setup_.clock.value_or(rt::Clock::monotonic()).now(); }
  [[nodiscard]] rt::HostTime deadline_of(rt::Duration timeout) const { return now() + timeout; }
  [[nodiscard]] rt::Duration left(rt::HostTime deadline) const { return std::max(rt::Duration{}, deadline - now()); }

  /// False: the deadline has come, and it is not `when` yet.
  [[nodiscard]] bool wait_for(rt::HostTime when, rt::HostTime deadline) const {
    if (!setup_.clock || when <= setup_.clock->now()) return true;
    setup_.clock->sleep_until(std::min(when, deadline));
    return when <= deadline;
  }

  /// Finds the frame that comes next and leaves it where it is.
  rt::Status look(rt::HostTime deadline) {
    if (!wait_for(pause_end_, deadline)) return rt::Status::timeout;
    if (next_.from == From::nowhere)
      if (const rt::Status found = find_next(deadline); found != rt::Status::ok) return found;
    return wait_for(next_.due, deadline) ? rt::Status::ok : rt::Status::timeout;
  }

  rt::Status find_next(rt::HostTime deadline) {
    if (again_.deliveries_left > 0) return announce(again_.frame, From::again);
    if (swapped_.deliveries_left > 0 && successor_has_passed_) return announce(swapped_.frame, From::swapped);
    for (;;) {
      FrameHeader seen;
      const rt::Status status = source_->peek(seen, left(deadline));
      if (status == rt::Status::end_of_stream && swapped_.deliveries_left > 0)
        return announce(swapped_.frame, From::swapped);
      if (status != rt::Status::ok) return status;
      Frame frame;
      const Fate fate = decide(seen, frame);
      if (fate == Fate::goes_on && !frame.swaps) return announce(frame, From::source);
      if (fate == Fate::goes_on) {
        if (const rt::Status held = hold_back(frame, deadline); held != rt::Status::ok) return held;
        continue;
      }
      pass_over();
      if (fate != Fate::half) ++missing_count_;
      if (fate == Fate::withheld) return rt::Status::timeout;
      if (fate == Fate::half) return rt::Status::corrupt;
      if (fate == Fate::away) {
        if (passes_over_absence_) pass_over_absence(deadline);
        return rt::Status::device_lost;
      }
    }
  }

  rt::Status announce(const Frame& frame, From from) {
    next_ = frame;
    next_.from = from;
    return rt::Status::ok;
  }

  rt::Status hold_back(const Frame& frame, rt::HostTime deadline) {
    FrameHeader header;
    const rt::Status status = source_->read(swapped_.pixels, header, left(deadline));
    if (status != rt::Status::ok) return status;
    spoil(swapped_.pixels, frame);
    swapped_.frame = frame;
    swapped_.deliveries_left = frame.doubles ? 2 : 1;
    successor_has_passed_ = false;
    return status;
  }

  /// So that colour is back together with depth, which answered device_lost once a frame before anybody asked for colour.
  void pass_over_absence(rt::HostTime deadline) {
    for (;;) {
      FrameHeader seen;
      const rt::Status status = source_->peek(seen, left(deadline));
      if (status == rt::Status::corrupt) continue;
      if (status != rt::Status::ok || !is_away(seen)) return;
      Frame frame;
      (void)decide(seen, frame);
      pass_over();
      ++missing_count_;
    }
  }

  /// A frame that vanishes. That the source finds it corrupt on the way does not count: it has its answer.
  void pass_over() {
    const std::uint64_t before = source_->counters().frames_rejected;
    source_->skip();
    hidden_rejections_count_ += source_->counters().frames_rejected - before;
  }

  [[nodiscard]] bool is_away(const FrameHeader& seen) const {
    return seen.sequence < away_until_sequence_ || (away_until_time_ && seen.time < *away_until_time_);
  }

  /// Once per frame of the source, in its order: here is all that depends on frames before.
  Fate decide(const FrameHeader& seen, Frame& frame) {
    std::array<const Fault*, kFaultKinds> hit{};
    for (std::size_t i = 0; i < setup_.plan.faults.size(); ++i) {
      const Fault& fault = setup_.plan.faults[i];
      if (!is_hit(fault, setup_.plan.seed, i, setup_.stream, seen.sequence)) continue;
      hit[static_cast<std::size_t>(fault.kind)] = &fault;
      if (fault.kind == FaultKind::corrupt_bytes) frame.spoiler_index = i;
    }
    const auto fault = [&](FaultKind kind) {
      const Fault* found = hit[static_cast<std::size_t>(kind)];
      return found;
    };
    const auto noted = [&](FaultKind kind) {
      if (fault(kind) == nullptr) return false;
      note(kind);
      return true;
    };
    frame.header = seen;
    frame.sequence = seen.sequence;
    if (noted(FaultKind::clock_jump)) jumped_ = jumped_ + fault(FaultKind::clock_jump)->jump;
    frame.header.time = seen.time + jumped_;
    if (is_away(seen)) return Fate::away;
    if (noted(FaultKind::unplug)) {
      unplug(*fault(FaultKind::unplug), seen);
      return Fate::away;
    }
    if (noted(FaultKind::color_without_depth)) return Fate::withheld;
    if (noted(FaultKind::drop)) return Fate::vanishes;
    if (noted(FaultKind::half_frame)) {
      reject_half(seen);
      return Fate::half;
    }
    if (last_time_ && noted(FaultKind::stuck_clock))
      frame.header.time = *last_time_;
    else
      last_time_ = frame.header.time;
    if (noted(FaultKind::late)) {
      const rt::Duration delay = fault(FaultKind::late)->delay;
      if (seen.arrived.ns != 0) frame.header.arrived = seen.arrived + delay;
      if (setup_.clock) frame.due = setup_.clock->now() + delay;
    }
    if (noted(FaultKind::corrupt_bytes)) frame.spoilt_share = fault(FaultKind::corrupt_bytes)->share;
    if (noted(FaultKind::slow_consumer)) frame.pause = fault(FaultKind::slow_consumer)->delay;
    frame.doubles = fault(FaultKind::duplicate) != nullptr;
    // The one that passes another is not held back itself.
    frame.swaps = fault(FaultKind::out_of_order) != nullptr && swapped_.deliveries_left == 0;
    return Fate::goes_on;
  }

  void unplug(const Fault& fault, const FrameHeader& seen) {
    ++losses_count_;
    if (fault.away_frames > 0)
      away_until_sequence_ = seen.sequence + fault.away_frames;
    else
      away_until_time_ = seen.time + fault.away;
    passes_over_absence_ = !setup_.is_live && setup_.stream == Stream::color && fault.hits_depth;
  }

  void reject_half(const FrameHeader& seen) {
    ++halves_count_;
    if (!counters_.first_rejection.empty()) return;
    std::array<char, 128> sentence{};
    const int length = std::snprintf(sentence.data(), sentence.size(), "Half of %s frame %llu was missing (--faults).",
                                     setup_.stream == Stream::depth ? "depth" : "colour",
                                     static_cast<unsigned long long>(seen.sequence));
    counters_.first_rejection.assign(sentence.data(), static_cast<std::size_t>(length));
  }

  void spoil(std::span<Pixel> pixels, const Frame& frame) const {
    if (frame.spoilt_share <= 0 || pixels.empty()) return;
    FrameRandom random(setup_.plan.seed, frame.spoiler_index, setup_.stream, frame.sequence);
    const double bytes_count = frame.spoilt_share * static_cast<double>(pixels.size_bytes());
    const auto spoilt_count = std::max<std::size_t>(1, static_cast<std::size_t>(bytes_count));
    auto* bytes = reinterpret_cast<unsigned char*>(pixels.data());
    for (std::size_t i = 0; i < spoilt_count; ++i) {
      const std::size_t at = random.next_below(pixels.size_bytes());
      bytes[at] = static_cast<unsigned char>(random.next());
      // Backends hand out no 65535.
      if constexpr (sizeof(Pixel) == 2)
        if (pixels[at / 2] == 65535) pixels[at / 2] = 0;
    }
  }

  /// Hands over the frame that look() has found; with no room for it, passes over it.
  rt::Status take(std::span<Pixel> pixels, rt::HostTime deadline) {
    const Frame frame = std::exchange(next_, Frame{});
    if (frame.from == From::source) {
      if (const rt::Status status = take_from_source(frame, pixels, deadline); status != rt::Status::ok) return status;
    } else {
      Slot& slot = frame.from == From::again ? again_ : swapped_;
      copy(slot.pixels, pixels);
      slot.frame.pause = {};
      if (--slot.deliveries_left > 0) note(FaultKind::duplicate);
    }
    ++delivered_count_;
    if (setup_.clock && frame.pause.ns > 0) pause_end_ = setup_.clock->now() + frame.pause;
    return rt::Status::ok;
  }

  rt::Status take_from_source(const Frame& frame, std::span<Pixel> pixels, rt::HostTime deadline) {
    const std::span<Pixel> into = frame.doubles ? std::span<Pixel>(again_.pixels) : pixels;
    if (into.empty()) {
      const std::uint64_t before = source_->counters().frames_delivered;
      source_->skip();
      if (source_->counters().frames_delivered == before) return rt::Status::corrupt;
    } else {
      FrameHeader header;
      if (const rt::Status status = source_->read(into, header, left(deadline)); status != rt::Status::ok) return status;
      spoil(into, frame);
    }
    if (frame.doubles) {
      copy(again_.pixels, pixels);
      again_.frame = frame;
      again_.frame.pause = {};
      again_.deliveries_left = 1;
      note(FaultKind::duplicate);
    }
    if (swapped_.deliveries_left > 0 && !successor_has_passed_) {
      successor_has_passed_ = true;
      note(FaultKind::out_of_order);
    }
    return rt::Status::ok;
  }

  static void copy(std::span<const Pixel> from, std::span<Pixel> to) {
    if (!to.empty()) std::memcpy(to.data(), from.data(), to.size_bytes());
  }

  void merge_counters() {
    const CameraCounters& theirs = source_->counters();
    counters_.frames_delivered = delivered_count_;
    counters_.frames_rejected = theirs.frames_rejected - hidden_rejections_count_ + halves_count_;
    counters_.timestamps_rejected = theirs.timestamps_rejected;
    counters_.frames_missing = theirs.frames_missing + missing_count_;
    counters_.losses = theirs.losses + losses_count_;
    if (counters_.first_rejection.empty() && !theirs.first_rejection.empty())
      counters_.first_rejection.assign(theirs.first_rejection, 0, kSentenceBytes);
  }

  std::unique_ptr<Source> source_;
  StreamSetup setup_;
  CameraCounters counters_;
  std::uint64_t delivered_count_ = 0, missing_count_ = 0, losses_count_ = 0;
  std::uint64_t halves_count_ = 0, hidden_rejections_count_ = 0;
  Frame next_;
  Slot swapped_, again_;
  bool successor_has_passed_ = false;
  rt::HostTime pause_end_{};
  rt::Duration jumped_{};
  std::optional<rt::SensorTime> last_time_;  // delivered, or about to be
  std::uint64_t away_until_sequence_ = 0;
  std::optional<rt::SensorTime> away_until_time_;
  bool passes_over_absence_ = false;
};

}  // namespace tactus::hal::faults
