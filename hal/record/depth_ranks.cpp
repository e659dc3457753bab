#include "hal/record/depth_ranks.hpp"

#include <algorithm>

#include "hal/record/little_endian.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {

constexpr std::size_t kValuesCount = 65536;
constexpr std::uint8_t kEscape = 255;

std::uint8_t* put_length(std::uint8_t* at, std::size_t value) {
  for (; value >= 128; value >>= 7) *at++ = static_cast<std::uint8_t>(value | 128);
  *at++ = static_cast<std::uint8_t>(value);
  return at;
}

/// False when the bytes end within the number or it is larger than any image.
bool take_length(const std::uint8_t*& at, const std::uint8_t* end, std::size_t& value) {
  value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    if (at == end) return false;
    const std::uint8_t byte = *at++;
    value |= static_cast<std::size_t>(byte & 127) << shift;
    if (byte < 128) return true;
  }
  return false;
}

std::uint16_t zigzag(std::uint16_t difference) {
  return static_cast<std::uint16_t>((difference << 1) ^ -(difference >> 15));
}
std::uint16_t unzigzag(std::uint16_t code) { return static_cast<std::uint16_t>((code >> 1) ^ -(code & 1)); }

/// The mean of both neighbours' ranks.
std::uint16_t predicted(std::uint16_t left, std::uint16_t up) {
  return static_cast<std::uint16_t>((std::uint32_t{left} + up) / 2);
}

}  // namespace

DepthRanks::DepthRanks(int width, int height)
    : width_(static_cast<std::size_t>(width)),
      height_(static_cast<std::size_t>(height)),
      table_(kValuesCount),
      above_(width_) {
  TACTUS_ASSERT(width > 0 && height > 0);
}

std::size_t DepthRanks::memory_bytes() const { return sizeof(std::uint16_t) * (table_.size() + above_.size()); }

std::size_t DepthRanks::pack(std::span<const std::uint16_t> depth, std::span<std::uint8_t> out) {
  TACTUS_ASSERT(depth.size() == width_ * height_ && out.size() >= ranks_bytes_max(depth.size()));
  std::fill(table_.begin(), table_.end(), std::uint16_t{0});
  for (const std::uint16_t value : depth) table_[value] = 1;
  std::uint8_t* at = out.data() + 4;
  std::uint16_t ranks_count = 0;
  for (std::size_t value = 1, before = 0; value < kValuesCount; ++value) {
    if (table_[value] == 0) continue;
    at = put_length(at, value - before);
    table_[value] = ++ranks_count;
    before = value;
  }
  put(out.data(), std::uint32_t{ranks_count});

  bool is_hole = true;
  for (std::size_t i = 0, first = 0; i < depth.size(); first = i, is_hole = !is_hole) {
    while (i < depth.size() && (depth[i] == 0) == is_hole) ++i;
    at = put_length(at, i - first);
  }

  const std::uint16_t* pixel = depth.data();
  for (std::size_t y = 0; y < height_; ++y) {
    std::uint16_t left = y == 0 ? std::uint16_t{0} : above_[0];
    for (std::size_t x = 0; x < width_; ++x, ++pixel) {
      if (*pixel != 0) {
        const std::uint16_t rank = table_[*pixel], up = y == 0 ? left : above_[x];
        const std::uint16_t code = zigzag(static_cast<std::uint16_t>(rank - predicted(left, up)));
        if (code < kEscape) {
          *at++ = static_cast<std::uint8_t>(code);
        } else {
          *at++ = kEscape;
          at = put(at, code);
        }
        left = rank;
      }
      above_[x] = left;
    }
  }
  return static_cast<std::size_t>(at - out.data());
}

bool DepthRanks::unpack(std::span<const std::uint8_t> packed, std::span<std::uint16_t> depth) {
  TACTUS_ASSERT(depth.size() == width_ * height_);
  if (packed.size() < 4) return false;
  const std::uint8_t* at = packed.data();
  const std::uint8_t* const end = at + packed.size();
  const auto ranks_count = take<std::uint32_t>(at);
  if (ranks_count >= kValuesCount) return false;
  std::fill(table_.begin(), table_.end(), std::uint16_t{0});
  std::size_t length = 0;
  for (std::size_t rank = 1, value = 0; rank <= ranks_count; ++rank) {
    if (!take_length(at, end, length) || length == 0) return false;
    value += length;
    if (value >= kValuesCount) return false;
    table_[rank] = static_cast<std::uint16_t>(value);
  }

  // Over the runs once to find the end of them and the number of values, then again with the values.
  const std::uint8_t* run_at = at;
  std::size_t values_count = 0;
  bool is_hole = true;
  for (std::size_t covered = 0; covered < depth.size(); covered += length, is_hole = !is_hole) {
    if (!take_length(at, end, length) || length > depth.size() - covered) return false;
    values_count += is_hole ? 0 : length;
  }
  if (static_cast<std::size_t>(end - at) < values_count) return false;

  bool are_known = true;
  std::uint16_t* pixel = depth.data();
  std::size_t run = 0;
  bool is_value = true;  // the run before the first
  for (std::size_t y = 0; y < height_; ++y) {
    std::uint16_t left = y == 0 ? std::uint16_t{0} : above_[0];
    for (std::size_t x = 0; x < width_;) {
      for (; run == 0; is_value = !is_value) (void)take_length(run_at, end, run);
      const std::size_t stop = std::min(width_, x + run);
      run -= stop - x;
      if (!is_value) {
        for (; x < stop; ++x) {
          *pixel++ = 0;
          above_[x] = left;
        }
        continue;
      }
      for (; x < stop; ++x) {
        if (at == end) return false;
        std::uint16_t code = *at++;
        if (code == kEscape) {
          if (end - at < 2) return false;
          code = take<std::uint16_t>(at);
        }
        const std::uint16_t up = y == 0 ? left : above_[x];
        left = static_cast<std::uint16_t>(predicted(left, up) + unzigzag(code));
        const std::uint16_t value = table_[left];
        are_known = are_known && value != 0;
        *pixel++ = value;
        above_[x] = left;
      }
    }
  }
  return are_known && at == end;
}

}  // namespace tactus::hal::record
