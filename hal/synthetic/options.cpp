#include "hal/synthetic/options.hpp"

#include <charconv>
#include <string>

#include "hal/synthetic/deterministic_math.hpp"

namespace tactus::hal::synthetic {
namespace {

rt::Error wrong(std::string_view name, std::string_view word, std::string_view what) {
  return {rt::ExitCode::bad_usage,
          "source '" + std::string(name) + "': '" + std::string(word) + "' " + std::string(what)};
}

/// The whole word as a decimal number within [low, high].
template <typename Integer>
bool parse_integer(std::string_view word, Integer low, Integer high, Integer& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc{} && end == word.data() + word.size() && out >= low && out <= high;
}

bool parse_switch(std::string_view word, bool& out) {
  if (word != "0" && word != "1") return false;
  out = word == "1";
  return true;
}

constexpr int kFramesMax = 100000;  // an hour at 30 Hz: beyond it a typing error is likelier than a wish

/// Empty when `value` was taken, else what is allowed for `key`.
std::string_view set_option(std::string_view key, std::string_view value, SyntheticOptions& options) {
  if (key == "frames") {
    if (!parse_integer(value, 1, kFramesMax, options.frames_count))
      return "must be frames=N with N from 1 to 100000";
  } else if (key == "seed") {
    if (!parse_integer<std::uint64_t>(value, 0, ~std::uint64_t{0}, options.seed))
      return "must be seed=N with N >= 0";
  } else if (key == "noise") {
    if (!parse_switch(value, options.has_noise)) return "must be noise=0 or noise=1";
  } else if (key == "registered") {
    if (!parse_switch(value, options.is_registered)) return "must be registered=0 or registered=1";
  } else if (key == "jump") {
    if (!parse_switch(value, options.has_jump)) return "must be jump=0 or jump=1";
  } else if (key == "mode") {
    if (value.ends_with("@30")) value.remove_suffix(3);
    if (value == "640x480")
      options.mode = Mode::vga_640x480;
    else if (value == "960x540")
      options.mode = Mode::wide_960x540;
    else if (value == "320x240")
      options.mode = Mode::qvga_320x240;
    else
      return "must be mode=640x480, mode=960x540 or mode=320x240";
  } else if (key == "trajectory") {
    if (value == "handheld")
      options.trajectory = TrajectoryKind::handheld;
    else if (value == "still")
      options.trajectory = TrajectoryKind::still;
    else
      return "must be trajectory=handheld or trajectory=still";
  } else if (key == "blank") {
    const std::size_t colon = value.find(':');
    if (colon == std::string_view::npos ||
        !parse_integer(value.substr(0, colon), 0, kFramesMax, options.blank_first) ||
        !parse_integer(value.substr(colon + 1), 1, kFramesMax, options.blank_count))
      return "must be blank=FIRST:COUNT, two frame numbers";
  } else {
    return "is not an option; known are frames, mode, trajectory, seed, noise, registered, blank, jump";
  }
  return {};
}

}  // namespace

rt::Result<SyntheticOptions> parse_synthetic_name(std::string_view name) {
  constexpr std::string_view kPrefix = "synthetic:";
  std::string_view rest = name;
  if (rest.starts_with(kPrefix)) rest.remove_prefix(kPrefix.size());
  const std::size_t question = rest.find('?');
  const std::string_view scene = rest.substr(0, question);
  SyntheticOptions options;
  bool is_known = false;
  for (int i = 0; i < kScenesCount; ++i)
    if (scene == synthetic::name(static_cast<SceneId>(i))) {
      options.scene = static_cast<SceneId>(i);
      is_known = true;
    }
  if (!is_known)
    return wrong(name, scene, "is not a synthetic scene; known are bedroom, office, wall, corner");

  rest = question == std::string_view::npos ? std::string_view{} : rest.substr(question + 1);
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view word = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) return wrong(name, word, "must be key=value");
    const std::string_view problem = set_option(word.substr(0, equals), word.substr(equals + 1), options);
    if (!problem.empty()) return wrong(name, word, problem);
  }
  if (options.has_jump && options.blank_count == 0)
    return wrong(name, "jump=1", "needs blank=FIRST:COUNT: the camera jumps while it sees nothing");
  return options;
}

RigCalibration calibration_of(const SyntheticOptions& options) {
  RigCalibration rig;
  double scale = 1;
  switch (options.mode) {
    case Mode::vga_640x480:
      break;
    case Mode::wide_960x540:
      scale = 1.5;
      break;
    case Mode::qvga_320x240:
      scale = 0.5;
      break;
  }
  rig.depth.width = static_cast<int>(640 * scale);
  rig.depth.height = options.mode == Mode::wide_960x540 ? 540 : static_cast<int>(480 * scale);
  const double rows_cut = (480 * scale - rig.depth.height) / 2;
  rig.depth.fx = rig.depth.fy = 525 * scale;
  rig.depth.cx = 320 * scale - 0.5;
  rig.depth.cy = 240 * scale - 0.5 - rows_cut;
  rig.depth_m_per_unit = kDepth_m_per_unit;
  rig.has_color = true;
  rig.registered = options.is_registered;
  rig.color = rig.depth;
  if (!options.is_registered) {
    rig.color.fx = 538 * scale;
    rig.color.fy = 537 * scale;
    rig.color.cx = 324.2 * scale - 0.5;
    rig.color.cy = 236.7 * scale - 0.5 - rows_cut;
    rig.color.k1 = 0.09;
    rig.color.k2 = -0.16;
    rig.color.p1 = 0.0008;
    rig.color.p2 = -0.0006;
    rig.color.k3 = 0.05;
    const auto [s, c] = sin_cos_degrees(0.6);
    rig.T_color_depth = {{{c, 0, s, 0, 1, 0, -s, 0, c}}, {-0.035, 0.0015, 0.002}};
  }
  return rig;
}

}  // namespace tactus::hal::synthetic
