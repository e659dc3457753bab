#include "hal/replay/gravity_file.hpp"

#include <array>
#include <cmath>
#include <cstdlib>

#include "hal/replay/text.hpp"

namespace tactus::hal::replay {

rt::Result<Vec3d> parse_gravity(std::string_view text, std::string_view file) {
  std::array<double, 3> v{};
  std::size_t count = 0;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const auto number = parse_number(word);
      if (!number) return bad_input(file, lines.line_number(), quote(word) + " is not a finite number");
      if (count == v.size())
        return bad_input(file, lines.line_number(), "more than the three numbers gx gy gz");
      v[count++] = *number;
    }
  }
  if (count != v.size())
    return bad_input(file, 0, "needs the three numbers gx gy gz, the direction of gravity");
  const Vec3d direction{v[0], v[1], v[2]};
  // Bounds keep the squares inside the range of a double.
  const double norm = direction.norm();
  if (!(norm > 1e-6 && norm < 1e6))
    return bad_input(file, 0, "the direction of gravity has no usable length");
  return direction.normalized();
}

std::optional<Vec3d> gravity_from_accelerometer(std::string_view text, rt::SensorTime time) {
  constexpr rt::Duration kWindow{100'000'000};
  constexpr int kSamplesMin = 3;
  Vec3d sum;
  int count = 0;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    const auto ns = parse_seconds_as_ns(next_word(line));
    if (!ns || std::abs(*ns - time.ns) > kWindow.ns) continue;
    const auto x = parse_number(next_word(line));
    const auto y = parse_number(next_word(line));
    const auto z = parse_number(next_word(line));
    if (!x || !y || !z) continue;
    sum += Vec3d{*x, *y, *z};
    ++count;
  }
  if (count < kSamplesMin) return std::nullopt;
  const Vec3d mean = sum * (1.0 / count);
  const double norm = mean.norm();
  if (!(norm >= 5 && norm <= 15)) return std::nullopt;
  return Vec3d{mean.x, mean.y, -mean.z} * (1 / norm);
}

}  // namespace tactus::hal::replay
