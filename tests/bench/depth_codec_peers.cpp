#include "tests/bench/depth_codec_peers.hpp"

#include <algorithm>
#include <cstring>

namespace tactus::bench {
namespace {

class Nibbles {
 public:
  explicit Nibbles(std::vector<std::uint8_t>& out) : out_(out) { out_.clear(); }
  void put(std::uint32_t value) {
    do {
      std::uint32_t nibble = value & 7;
      value >>= 3;
      if (value != 0) nibble |= 8;
      word_ = (word_ << 4) | nibble;
      if (++count_ == 8) flush();
    } while (value != 0);
  }
  void flush() {
    if (count_ == 0) return;
    word_ <<= 4 * (8 - count_);
    const std::size_t at = out_.size();
    out_.resize(at + 4);
    std::memcpy(out_.data() + at, &word_, 4);
    word_ = 0;
    count_ = 0;
  }

 private:
  std::vector<std::uint8_t>& out_;
  std::uint32_t word_ = 0;
  int count_ = 0;
};

class NibbleReader {
 public:
  explicit NibbleReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool take(std::uint32_t& value) {
    value = 0;
    for (int shift = 0; shift < 33; shift += 3) {
      if (count_ == 0) {
        if (at_ + 4 > bytes_.size()) return false;
        std::memcpy(&word_, bytes_.data() + at_, 4);
        at_ += 4;
        count_ = 8;
      }
      const std::uint32_t nibble = word_ >> 28;
      word_ <<= 4;
      --count_;
      value |= (nibble & 7) << std::min(shift, 31);
      if (nibble < 8) return true;
    }
    return false;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint32_t word_ = 0;
  int count_ = 0;
};

std::uint16_t median(std::uint16_t left, std::uint16_t up, std::uint16_t up_left) {
  const auto [low, high] = std::minmax(left, up);
  if (up_left >= high) return low;
  if (up_left <= low) return high;
  return static_cast<std::uint16_t>(left + up - up_left);
}

template <typename At>
std::uint16_t prediction(const At& at, std::size_t x, std::size_t y) {
  if (x == 0 && y == 0) return 0;
  if (x == 0) return at(x, y - 1);
  if (y == 0) return at(x - 1, y);
  return median(at(x - 1, y), at(x, y - 1), at(x - 1, y - 1));
}

}  // namespace

void rvl_encode(std::span<const std::uint16_t> depth, std::vector<std::uint8_t>& out) {
  Nibbles nibbles(out);
  std::int32_t before = 0;
  for (std::size_t i = 0; i < depth.size();) {
    const std::size_t holes_first = i;
    while (i < depth.size() && depth[i] == 0) ++i;
    nibbles.put(static_cast<std::uint32_t>(i - holes_first));
    std::size_t end = i;
    while (end < depth.size() && depth[end] != 0) ++end;
    nibbles.put(static_cast<std::uint32_t>(end - i));
    for (; i < end; ++i) {
      const std::int32_t delta = depth[i] - before;
      nibbles.put(static_cast<std::uint32_t>((delta << 1) ^ (delta >> 31)));
      before = depth[i];
    }
  }
  nibbles.flush();
}

bool rvl_decode(std::span<const std::uint8_t> bytes, std::span<std::uint16_t> depth) {
  NibbleReader nibbles(bytes);
  std::uint32_t before = 0, count = 0, code = 0;
  for (std::size_t i = 0; i < depth.size();) {
    if (!nibbles.take(count) || count > depth.size() - i) return false;
    for (; count > 0; --count) depth[i++] = 0;
    if (!nibbles.take(count) || count > depth.size() - i) return false;
    for (; count > 0; --count) {
      if (!nibbles.take(code)) return false;
      before += (code >> 1) ^ (0U - (code & 1));
      depth[i++] = static_cast<std::uint16_t>(before);
    }
  }
  return true;
}

void median_planes(std::span<const std::uint16_t> depth, int width, std::vector<std::uint8_t>& out) {
  const auto columns = static_cast<std::size_t>(width);
  out.resize(2 * depth.size());
  const auto at = [&](std::size_t x, std::size_t y) { return depth[y * columns + x]; };
  for (std::size_t y = 0, i = 0; i < depth.size(); ++y)
    for (std::size_t x = 0; x < columns; ++x, ++i) {
      const auto delta = static_cast<std::uint16_t>(depth[i] - prediction(at, x, y));
      const auto code = static_cast<std::uint16_t>((delta << 1) ^ -(delta >> 15));
      out[i] = static_cast<std::uint8_t>(code);
      out[depth.size() + i] = static_cast<std::uint8_t>(code >> 8);
    }
}

void from_median_planes(std::span<const std::uint8_t> planes, int width, std::span<std::uint16_t> depth) {
  const auto columns = static_cast<std::size_t>(width);
  const auto at = [&](std::size_t x, std::size_t y) { return depth[y * columns + x]; };
  for (std::size_t y = 0, i = 0; i < depth.size(); ++y)
    for (std::size_t x = 0; x < columns; ++x, ++i) {
      const auto code = static_cast<std::uint16_t>(planes[i] | planes[depth.size() + i] << 8);
      const auto delta = static_cast<std::uint16_t>((code >> 1) ^ -(code & 1));
      depth[i] = static_cast<std::uint16_t>(prediction(at, x, y) + delta);
    }
}

}  // namespace tactus::bench
