// Recordings: whatever the bytes, opening and playing end, and what plays is of the camera's size. Each input is taken as
// it is and with its checksums made to fit, so that the fuzzer gets behind them.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "hal/record/chunk.hpp"
#include "hal/record/crc32c.hpp"
#include "hal/record/little_endian.hpp"
#include "hal/record/tac.hpp"
#include "rt/assert.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace tactus;
using namespace tactus::hal::record;

namespace {

class Tap final : public hal::FrameTap {
 public:
  void take(hal::Stream, const hal::RawFrame& frame) noexcept override { bytes += frame.bytes.size(); }
  std::size_t bytes = 0;
};

void play(const std::string& path) {
  (void)is_tac(path);
  const auto facts = tac_facts(path);
  auto sensor = open_tac(path, {});
  if (!facts) {
    TACTUS_ASSERT(facts.error().code == rt::ExitCode::bad_input && !facts.error().message.empty());
    TACTUS_ASSERT(!sensor);
    return;
  }
  if (!sensor) return;
  const auto pixels = [](const hal::Intrinsics& k) {
    return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
  };
  constexpr std::size_t kPixelsMax = 1 << 16;  // larger ones are only slow
  if (pixels(sensor->calibration.depth) > kPixelsMax) return;
  Tap tap;
  hal::FrameHeader header;
  std::vector<std::uint16_t> depth(pixels(sensor->calibration.depth));
  std::vector<std::uint8_t> ids(depth.size());
  sensor->depth->set_tap(&tap);
  for (rt::Status status = rt::Status::ok; status != rt::Status::end_of_stream;) {
    status = sensor->depth->read(depth, header, {});
    TACTUS_ASSERT(status == rt::Status::ok || status == rt::Status::corrupt || status == rt::Status::end_of_stream);
    if (sensor->labels && status == rt::Status::ok) (void)sensor->labels->read(header.sequence, ids);
  }
  if (!sensor->color || pixels(sensor->calibration.color) > kPixelsMax) return;
  std::vector<std::uint8_t> rgb(3 * pixels(sensor->calibration.color));
  sensor->color->set_tap(&tap);
  for (rt::Status status = rt::Status::ok; status != rt::Status::end_of_stream;) {
    status = sensor->color->peek(header, {});
    if (status == rt::Status::ok) (void)sensor->color->read(rgb, header, {});
  }
}

/// From chunk to chunk as the lengths say.
void make_checksums_fit(std::vector<std::uint8_t>& bytes) {
  for (std::size_t at = kMagicBytes; at + kChunkHeaderBytes <= bytes.size();) {
    put(bytes.data() + at, kMark);
    const std::uint8_t* length_at = bytes.data() + at + 8;
    const auto length = take<std::uint64_t>(length_at);
    const std::size_t left = bytes.size() - at - kChunkHeaderBytes;
    const std::size_t count = length < left ? static_cast<std::size_t>(length) : left;
    std::uint8_t* header = bytes.data() + at;
    put(header + 48, crc32c({header + kChunkHeaderBytes, count}));
    put(header + 52, crc32c({header, 52}));
    at += kChunkHeaderBytes + count;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  static test::MemoryFile file;
  play(file.holding(data, bytes));
  std::vector<std::uint8_t> fitted(data, data + bytes);
  make_checksums_fit(fitted);
  play(file.holding(fitted.data(), fitted.size()));
  return 0;
}
