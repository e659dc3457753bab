#include "hal/record/tac_source.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <type_traits>

#include "hal/frames/convert.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {

using frames::FrameOutcome;
using frames::RawForm;

void say_of(FrameOutcome& outcome, const TacFile& file, const char* stream, const IndexEntry& entry, const char* what) {
  std::array<char, frames::kSentenceBytes> sentence{};
  std::snprintf(sentence.data(), sentence.size(), "%s: %s frame %" PRIu64 " at byte %" PRIu64 " %s", file.path().c_str(),
                stream, entry.header.frame.sequence, entry.offset, what);
  frames::say(outcome, sentence.data());
}

rt::Status convert(const RawFrame& frame, std::span<std::uint16_t> depth) { return frames::to_depth(frame, depth); }
rt::Status convert(const RawFrame& frame, std::span<std::uint8_t> rgb) { return frames::to_rgb(frame, rgb); }

/// Bytes of the frame before it was packed; 0 when the chunk's numbers cannot be true.
std::size_t raw_bytes(const ChunkHeader& header, FrameSize size) {
  const std::size_t packed = frames::packed_bytes(header.format, size.width, size.height);
  const std::size_t expected = header.format == PixelFormat::mjpeg ? header.payload_bytes : packed;
  return header.raw_bytes == expected && expected <= kPayloadBytesMax ? expected : 0;
}

}  // namespace

template <typename Pixel>
TacSource<Pixel>::TacSource(std::shared_ptr<const TacFile> file, std::vector<IndexEntry> entries, FrameSize size)
    : file_(std::move(file)), entries_(std::move(entries)), size_(size), unpacker_(std::make_unique<Unpacker>(size)) {
  std::size_t chunk_bytes_max = 0;
  for (const IndexEntry& entry : entries_) {
    chunk_bytes_max = std::max(chunk_bytes_max, TacFile::chunk_bytes(entry));
    raw_bytes_max_ = std::max(raw_bytes_max_, raw_bytes(entry.header, size));
  }
  buffer_.resize(std::min<std::size_t>(chunk_bytes_max, file_->bytes()));
}

template <typename Pixel>
std::size_t TacSource<Pixel>::pixels_count() const {
  const std::size_t count = static_cast<std::size_t>(size_.width) * static_cast<std::size_t>(size_.height);
  return std::is_same_v<Pixel, std::uint8_t> ? count * 3 : count;
}

/// Passes over frames that are not later than the one before. False at the end.
template <typename Pixel>
bool TacSource<Pixel>::find_next(FrameOutcome& outcome) {
  outcome = {};
  for (; next_ < entries_.size(); ++next_) {
    const FrameHeader& frame = entries_[next_].header.frame;
    if (delivered_ == nullptr || (frame.time > delivered_->header.frame.time &&
                                  frame.sequence > delivered_->header.frame.sequence)) {
      outcome.header = frame;
      outcome.status = rt::Status::ok;
      return true;
    }
    ++outcome.timestamps_rejected;
    say_of(outcome, *file_, std::is_same_v<Pixel, std::uint8_t> ? "colour" : "depth", entries_[next_],
           "is not later than the one before");
  }
  return false;
}

template <typename Pixel>
void TacSource<Pixel>::peek(FrameOutcome& outcome) {
  (void)find_next(outcome);
}

/// Null, or what is wrong.
template <typename Pixel>
const char* TacSource<Pixel>::decode(const IndexEntry& entry, std::span<Pixel> pixels, RawForm& raw) {
  std::span<const std::uint8_t> payload;
  if (TacFile::chunk_bytes(entry) > buffer_.size()) return "is larger than the file";
  if (const char* fault = file_->read_chunk(entry, buffer_, payload)) return fault;
  const PixelFormat format = entry.header.format;
  const std::size_t count = raw_bytes(entry.header, size_);
  if (count == 0 || (format == PixelFormat::depth16) == std::is_same_v<Pixel, std::uint8_t>)
    return "is not of the camera's size or form";
  const auto bytes = std::span(raw.storage).first(count);
  if (!unpacker_->unpack(entry.header.packing, format, payload, bytes)) return "cannot be unpacked";
  const std::size_t row_bytes = format == PixelFormat::mjpeg  ? 0
                                : format == PixelFormat::nv12 ? static_cast<std::size_t>(size_.width)
                                                              : count / static_cast<std::size_t>(size_.height);
  raw.frame = {entry.header.frame, format, size_.width, size_.height, row_bytes, bytes};
  return convert(raw.frame, pixels) == rt::Status::ok ? nullptr : "does not decode";
}

template <typename Pixel>
void TacSource<Pixel>::next(std::span<Pixel> pixels, RawForm& raw, FrameOutcome& outcome) {
  TACTUS_ASSERT(pixels.size() == pixels_count());
  if (!find_next(outcome)) return;
  const IndexEntry& entry = entries_[next_++];
  delivered_ = &entry;
  const char* fault = decode(entry, pixels, raw);
  if (fault == nullptr) return;
  outcome.status = rt::Status::corrupt;
  say_of(outcome, *file_, std::is_same_v<Pixel, std::uint8_t> ? "colour" : "depth", entry, fault);
}

template class TacSource<std::uint16_t>;
template class TacSource<std::uint8_t>;

}  // namespace tactus::hal::record
