#include "firmware_host/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cinttypes>

namespace tactus::firmware {

Progress::Progress(std::string what, std::uint64_t total, rt::Clock clock, std::FILE* stream)
    : Progress(std::move(what), total, clock, stream, isatty(fileno(stream)) == 1) {}

Progress::Progress(std::string what, std::uint64_t total, rt::Clock clock, std::FILE* stream,
                   bool is_terminal)
    : what_(std::move(what)),
      total_(total),
      clock_(clock),
      stream_(stream),
      is_terminal_(is_terminal),
      start_(clock.now()),
      next_(start_) {}

void Progress::update(std::uint64_t done) {
  if (!is_terminal_) return;
  const rt::HostTime now = clock_.now();
  if (now < next_) return;
  next_ = now + rt::Duration{100'000'000};
  const double elapsed_s = (now - start_).seconds();
  std::fprintf(stream_, "\r\033[K%s ", what_.c_str());
  if (total_ > 0) {
    const double share = std::min(1.0, static_cast<double>(done) / static_cast<double>(total_));
    constexpr int kBarWidth = 24;
    const int filled = static_cast<int>(share * kBarWidth);
    std::fputc('[', stream_);
    for (int i = 0; i < kBarWidth; ++i) std::fputc(i < filled ? '=' : ' ', stream_);
    std::fprintf(stream_, "] %3.0f %%  %" PRIu64 "/%" PRIu64, share * 100, done, total_);
    if (done > 0 && elapsed_s > 1 && share < 1) {
      std::fprintf(stream_, "  %.0f s left", elapsed_s * (1 - share) / share);
    }
  } else {
    std::fprintf(stream_, "%" PRIu64, done);
  }
  std::fflush(stream_);
  is_shown_ = true;
}

void Progress::finish() {
  if (!is_shown_) return;
  std::fputs("\r\033[K", stream_);
  std::fflush(stream_);
  is_shown_ = false;
}

}  // namespace tactus::firmware
