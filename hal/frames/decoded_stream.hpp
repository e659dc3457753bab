// Plays frames that must be decoded, either on the caller's thread or from a ring that a reader thread keeps full.
//
//   reader thread --decodes into--> [slot][slot][slot][slot] --read() copies out--> caller
//
// The ring is for callers that may not touch the heap (pipeline threads after seal): libpng, libjpeg and the
// sentences about rejected frames all allocate, and do it on the reader thread. A slot belongs to the reader
// while it is free and to the caller while it is filled; the mutex guards only the two counts, and no pixel
// is touched under it. Frames come in the list's order either way, so what is delivered does not depend on
// the choice.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "hal/frames/frame_outcome.hpp"

namespace tactus::hal::frames {

/// A frame as it was recorded, where that differs from its pixels; `frame.bytes` lies in `storage`.
struct RawForm {
  std::vector<std::uint8_t> storage;
  RawFrame frame;
};

/// Source has a type Pixel (uint16 or uint8) and
///   void next(std::span<Pixel>, FrameOutcome&)   decodes the next frame; the end stays the end
///   void peek(FrameOutcome&)                     says of the next frame what is known without decoding it, and leaves it;
///                                                one that is no frame at all it passes over, as corrupt
///   std::size_t pixels_count() const             values that next() writes
/// or, when its frames have a form of their own, instead of next()
///   void next(std::span<Pixel>, RawForm&, FrameOutcome&)   the same, with that form, in storage of
///   std::size_t raw_bytes_max() const                      bytes
template <typename Source>
class DecodedStream {
  using Pixel = typename Source::Pixel;
  static constexpr bool kHasRawForm = requires(const Source& source) { source.raw_bytes_max(); };

 public:
  /// Boot phase. `prefetch` slots are allocated and touched here; 0 means no thread.
  DecodedStream(Source source, std::size_t prefetch) : source_(std::move(source)) {
    counters_.first_rejection.reserve(kSentenceBytes);
    slots_.resize(prefetch);
    for (Slot& slot : slots_) slot.pixels.resize(source_.pixels_count());
    if constexpr (kHasRawForm) {
      for (Slot& slot : slots_) slot.raw.storage.resize(source_.raw_bytes_max());
      if (slots_.empty()) {
        direct_raw_.storage.resize(source_.raw_bytes_max());
        passed_over_.resize(source_.pixels_count());
      }
    }
    if (prefetch > 0) reader_ = std::thread([this] { decode_ahead(); });
  }
  DecodedStream(const DecodedStream&) = delete;
  DecodedStream& operator=(const DecodedStream&) = delete;
  ~DecodedStream() {
    if (!reader_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    slot_freed_.notify_one();
    reader_.join();
  }

  /// See DepthCamera::read. Without prefetch the timeout is not looked at: a file never waits for an event.
  /// With it, makes no heap call and waits at most `timeout` for the reader thread. Thread-bound.
  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration timeout) {
    return read(pixels, header, timeout, [](const auto&...) {});
  }

  /// The same; `look` sees a good frame as skip() shows it.
  template <typename Look>
  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration timeout, const Look& look) {
    if (ended_) return rt::Status::end_of_stream;
    if (slots_.empty()) {
      decode(pixels, direct_raw_, direct_);
      if (direct_.status == rt::Status::ok) show(look, pixels, direct_raw_, direct_);
      return deliver(direct_, header);
    }
    TACTUS_ASSERT(pixels.size() == slots_[read_index_].pixels.size());
    if (!wait_for_slot(timeout)) return rt::Status::timeout;
    const Slot& slot = slots_[read_index_];
    if (slot.outcome.status == rt::Status::ok) {
      std::memcpy(pixels.data(), slot.pixels.data(), pixels.size() * sizeof(Pixel));
      show(look, slot.pixels, slot.raw, slot.outcome);
    }
    return take_slot(header);
  }

  /// See ColorCamera::peek. What is no frame is passed over and counted.
  rt::Status peek(FrameHeader& header, rt::Duration timeout) {
    if (ended_) return rt::Status::end_of_stream;
    if (slots_.empty()) {
      source_.peek(direct_);
      if (direct_.status != rt::Status::ok) return deliver(direct_, header);
      count_passed_over(direct_, counters_);
      header = direct_.header;
      return rt::Status::ok;
    }
    if (!wait_for_slot(timeout)) return rt::Status::timeout;
    const FrameOutcome& outcome = slots_[read_index_].outcome;
    if (outcome.status != rt::Status::ok) return take_slot(header);
    header = outcome.header;
    return rt::Status::ok;
  }

  /// See ColorCamera::skip. Without prefetch the frame is decoded all the same: whether it is a good one decides how it is
  /// counted, and that may not depend on the prefetch. A good one is seen by `look(pixels, header)`, or by `look(raw_frame)`
  /// when frames have a form of their own.
  template <typename Look>
  void skip(const Look& look) {
    FrameHeader header;
    if (slots_.empty()) {
      passed_over_.resize(source_.pixels_count());
      (void)read(passed_over_, header, {}, look);
      return;
    }
    const Slot& slot = slots_[read_index_];
    if (slot.outcome.status == rt::Status::ok) show(look, slot.pixels, slot.raw, slot.outcome);
    (void)take_slot(header);
  }

  [[nodiscard]] const CameraCounters& counters() const { return counters_; }

 private:
  struct Slot {
    std::vector<Pixel> pixels;
    RawForm raw;  // empty when frames have no form of their own
    FrameOutcome outcome;
  };

  void decode(std::span<Pixel> pixels, RawForm& raw, FrameOutcome& outcome) {
    if constexpr (kHasRawForm)
      source_.next(pixels, raw, outcome);
    else
      source_.next(pixels, outcome);
  }

  template <typename Look>
  static void show(const Look& look, std::span<const Pixel> pixels, const RawForm& raw, const FrameOutcome& outcome) {
    if constexpr (kHasRawForm)
      look(raw.frame);
    else
      look(pixels, outcome.header);
  }

  bool wait_for_slot(rt::Duration timeout) {
    std::unique_lock lock(mutex_);
    return slot_filled_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [this] { return filled_count_ > 0; });
  }

  rt::Status take_slot(FrameHeader& header) {
    const rt::Status status = deliver(slots_[read_index_].outcome, header);
    if (ended_) return status;  // the reader has gone; the slot stays as it is
    read_index_ = (read_index_ + 1) % slots_.size();
    {
      const std::lock_guard lock(mutex_);
      --filled_count_;
    }
    slot_freed_.notify_one();
    return status;
  }

  rt::Status deliver(const FrameOutcome& outcome, FrameHeader& header) {
    count(outcome, counters_);
    ended_ = outcome.status == rt::Status::end_of_stream;
    if (!ended_) header = outcome.header;
    return outcome.status;
  }

  void decode_ahead() {
    for (std::size_t write_index = 0;; write_index = (write_index + 1) % slots_.size()) {
      {
        std::unique_lock lock(mutex_);
        slot_freed_.wait(lock, [this] { return stop_ || filled_count_ < slots_.size(); });
        if (stop_) return;
      }
      Slot& slot = slots_[write_index];
      decode(slot.pixels, slot.raw, slot.outcome);
      const bool last = slot.outcome.status == rt::Status::end_of_stream;
      {
        const std::lock_guard lock(mutex_);
        ++filled_count_;
      }
      slot_filled_.notify_one();
      if (last) return;
    }
  }

  Source source_;  // the reader thread's while it runs
  FrameOutcome direct_;
  RawForm direct_raw_;
  std::vector<Pixel> passed_over_;
  CameraCounters counters_;
  bool ended_ = false;
  std::vector<Slot> slots_;
  std::size_t read_index_ = 0;
  std::mutex mutex_;  // guards filled_count_ and stop_
  std::condition_variable slot_filled_;
  std::condition_variable slot_freed_;
  std::size_t filled_count_ = 0;
  bool stop_ = false;
  std::thread reader_;
};

}  // namespace tactus::hal::frames
