#include "firmware_host/source_part.hpp"

#include <memory>
#include <utility>

#include "pipeline/capture/pairing.hpp"

namespace tactus::firmware {
namespace {

constexpr std::size_t kSentenceBytes = 512;  // as the backends

/// Shows a recorder nothing of what is passed over.
class Gate final : public hal::FrameTap {
 public:
  hal::FrameTap* beyond = nullptr;
  bool is_open = false;
  void take(hal::Stream stream, const hal::RawFrame& frame) noexcept override {
    if (is_open) beyond->take(stream, frame);
  }
};

/// What both kinds of part do: Camera in front of `whole_`, with a gate for its recorder and counters of its own.
template <typename Camera>
class Part : public Camera {
 public:
  explicit Part(std::unique_ptr<Camera> whole) : whole_(std::move(whole)) {
    counters_.first_rejection.reserve(kSentenceBytes);
  }
  void set_tap(hal::FrameTap* tap) override {
    gate_.beyond = tap;
    whole_->set_tap(tap == nullptr ? nullptr : &gate_);
  }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return counters_; }

 protected:
  /// No heap: the sentence is cut to what was reserved.
  void count() {
    const hal::CameraCounters& whole = whole_->counters();
    counters_.frames_delivered = whole.frames_delivered - skipped_count_;
    counters_.frames_rejected = whole.frames_rejected;
    counters_.timestamps_rejected = whole.timestamps_rejected;
    counters_.frames_missing = whole.frames_missing;
    counters_.losses = whole.losses;
    if (counters_.first_rejection.empty() && !whole.first_rejection.empty())
      counters_.first_rejection.assign(whole.first_rejection, 0, kSentenceBytes);
  }

  std::unique_ptr<Camera> whole_;
  hal::CameraCounters counters_;
  Gate gate_;
  std::uint64_t skipped_count_ = 0;
  bool has_ended_ = false;
};

/// Which frame is in the part, peek() says; it is then the next one of `whole_`.
class ColorPart : public Part<hal::ColorCamera> {
 public:
  using Part::Part;
  rt::Status read(std::span<std::uint8_t> rgb, hal::FrameHeader& header, rt::Duration timeout) override {
    if (const rt::Status status = peek(header, timeout); status != rt::Status::ok) return status;
    const rt::Status status = whole_->read(rgb, header, timeout);
    count();
    return status;
  }
  void skip() override {
    whole_->skip();
    count();
  }
};

class NumberedDepth final : public Part<hal::DepthCamera> {
 public:
  NumberedDepth(std::unique_ptr<hal::DepthCamera> whole, FrameRange range) : Part(std::move(whole)), range_(range) {}

  rt::Status read(std::span<std::uint16_t> depth, hal::FrameHeader& header, rt::Duration timeout) override {
    for (;;) {
      if (has_ended_ || next_ >= range_.last) return rt::Status::end_of_stream;
      gate_.is_open = next_ >= range_.first;
      const rt::Status status = whole_->read(depth, header, timeout);
      if (status == rt::Status::ok) next_ = header.sequence + 1;
      if (status == rt::Status::ok && header.sequence < range_.first) {
        ++skipped_count_;
        continue;
      }
      // Behind a gap the number before which the part ends may never come.
      has_ended_ = status == rt::Status::ok && header.sequence >= range_.last;
      if (has_ended_) ++skipped_count_;
      count();
      if (!has_ended_) return status;
    }
  }

 private:
  FrameRange range_;
  std::uint64_t next_ = 0;  // number that the next frame has where none is missing
};

class NumberedColor final : public ColorPart {
 public:
  NumberedColor(std::unique_ptr<hal::ColorCamera> whole, FrameRange range) : ColorPart(std::move(whole)), range_(range) {}

  rt::Status peek(hal::FrameHeader& header, rt::Duration timeout) override {
    for (;;) {
      if (has_ended_) return rt::Status::end_of_stream;
      const rt::Status status = whole_->peek(header, timeout);
      gate_.is_open = status == rt::Status::ok && header.sequence >= range_.first && header.sequence < range_.last;
      if (status == rt::Status::ok && header.sequence < range_.first) {
        whole_->skip();
        ++skipped_count_;
        continue;
      }
      has_ended_ = status == rt::Status::ok && header.sequence >= range_.last;
      count();
      if (!has_ended_) return status;
    }
  }

 private:
  FrameRange range_;
};

/// What the colour camera of a device has to know of how far depth is; one thread reads both.
struct DepthProgress {
  bool has_begun = false, has_ended = false;
  std::int64_t first_ns = 0, last_ns = 0;  // of what was delivered
  bool has_two_clocks = false;

  [[nodiscard]] std::int64_t time_ns(const hal::FrameHeader& header) const {
    return has_two_clocks ? header.arrived.ns : header.time.ns;
  }
};

class NextDepth final : public Part<hal::DepthCamera> {
 public:
  NextDepth(std::unique_ptr<hal::DepthCamera> whole, FrameRange range, std::shared_ptr<DepthProgress> progress)
      : Part(std::move(whole)), range_(range), progress_(std::move(progress)) {}

  rt::Status read(std::span<std::uint16_t> depth, hal::FrameHeader& header, rt::Duration timeout) override {
    for (;;) {
      if (progress_->has_ended) return rt::Status::end_of_stream;
      gate_.is_open = taken_count_ >= range_.first;
      const rt::Status status = whole_->read(depth, header, timeout);
      if (status == rt::Status::ok && taken_count_++ < range_.first) {
        ++skipped_count_;
        continue;
      }
      if (status == rt::Status::ok) {
        progress_->last_ns = progress_->time_ns(header);
        if (!progress_->has_begun) progress_->first_ns = progress_->last_ns;
        progress_->has_begun = true;
        progress_->has_ended = taken_count_ >= range_.last;
      }
      count();
      return status;
    }
  }

 private:
  FrameRange range_;
  std::shared_ptr<DepthProgress> progress_;
  std::uint64_t taken_count_ = 0;
};

class NextColor final : public ColorPart {
 public:
  NextColor(std::unique_ptr<hal::ColorCamera> whole, std::shared_ptr<DepthProgress> progress)
      : ColorPart(std::move(whole)), progress_(std::move(progress)) {}

  rt::Status peek(hal::FrameHeader& header, rt::Duration timeout) override {
    if (!progress_->has_begun) return rt::Status::timeout;
    for (;;) {
      if (has_ended_) return rt::Status::end_of_stream;
      const rt::Status status = whole_->peek(header, timeout);
      const std::int64_t time_ns = progress_->time_ns(header);
      const bool is_early = time_ns < progress_->first_ns - Pairing::kSkewMax.ns;
      const bool is_late = progress_->has_ended && time_ns > progress_->last_ns + Pairing::kSkewMax.ns;
      gate_.is_open = status == rt::Status::ok && !is_early && !is_late;
      if (status == rt::Status::ok && is_early) {
        whole_->skip();
        ++skipped_count_;
        continue;
      }
      // Colour that fell silent must not keep a part from its end.
      has_ended_ = status == rt::Status::ok ? is_late : progress_->has_ended && status != rt::Status::corrupt;
      count();
      if (!has_ended_) return status;
    }
  }

 private:
  std::shared_ptr<DepthProgress> progress_;
};

}  // namespace

void play_numbers(hal::Sensor& sensor, FrameRange range) {
  sensor.depth = std::make_unique<NumberedDepth>(std::move(sensor.depth), range);
  if (sensor.color) sensor.color = std::make_unique<NumberedColor>(std::move(sensor.color), range);
}

void play_next_frames(hal::Sensor& sensor, FrameRange range) {
  auto progress = std::make_shared<DepthProgress>();
  progress->has_two_clocks = sensor.has_two_clocks;
  sensor.depth = std::make_unique<NextDepth>(std::move(sensor.depth), range, progress);
  if (sensor.color) sensor.color = std::make_unique<NextColor>(std::move(sensor.color), progress);
}

}  // namespace tactus::firmware
