#include "firmware_host/registration_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware_host/progress.hpp"
#include "pipeline/capture/pairing.hpp"
#include "pipeline/register/half_color.hpp"

namespace tactus::firmware {
namespace {

// A jump of depth that is an edge of something: 6 % and at least 8 cm, well over the noise of the cameras here at 5 m.
constexpr double kJumpShare = 0.06, kJumpMin_m = 0.08;
// Structured light leaves a shadow without depth beside near things: so far across it the surface behind is looked for.
constexpr int kShadowPixels = 12;
constexpr int kBinsPerPixel = 20;
constexpr int kDistanceMax_px = 40;  // farther ones are counted there
// Width of an agreement: narrower, noise decides; wider, neighbouring edges blur into each other.
constexpr double kFitSigma_px = 1.5;
constexpr int kShifts = 2 * RegistrationCheck::kShiftMax + 1;
constexpr int kChanceDraws = 4;  // displaced copies of each pair's edges
constexpr std::uint64_t kEdgesMin = 1000;
// The best shift against the mean of all: 2.1 to 2.7 where depth lies well, 1.4 to 1.55 in a recording of a camera that
// turns at 1 rad/s and opens its two shutters at different times, 1 by chance.
constexpr double kChanceFit = 1.2, kPeakMin = 1.7;
constexpr double kGoodShift_px = 1;
// A recording answers at once; a second without a frame means that none will come.
constexpr rt::Duration kFrameTimeout{1'000'000'000};
constexpr std::uint64_t kLiveStride = 10;  // of a device, one frame in so many is looked at

double quantile(const std::vector<std::uint32_t>& histogram, double share) {
  std::uint64_t total = 0, seen = 0;
  for (const std::uint32_t n : histogram) total += n;
  if (total == 0) return 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const std::uint64_t before = seen;
    seen += histogram[i];
    const double wanted = share * static_cast<double>(total);
    if (static_cast<double>(seen) >= wanted && histogram[i] > 0)
      return static_cast<double>(i) + (wanted - static_cast<double>(before)) / histogram[i];
  }
  return static_cast<double>(histogram.size());
}

/// Distances to the nearest strong colour edge, upright ones and level ones apart: the edge of a table top says nothing of
/// where its leg is.
struct ColorEdges {
  cv::Mat upright, level;

  explicit ColorEdges(const cv::Mat& rgb) {
    cv::Mat grey, gx, gy;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    cv::GaussianBlur(grey, grey, {0, 0}, 1.0);
    cv::Sobel(grey, gx, CV_16S, 1, 0);
    cv::Sobel(grey, gy, CV_16S, 0, 1);
    // Strong is what the steepest tenth of the picture is, but never what sensor noise makes of a grey wall.
    std::vector<std::uint32_t> steepness(3000, 0);
    for (int y = 0; y < grey.rows; ++y)
      for (int x = 0; x < grey.cols; ++x)
        ++steepness[static_cast<std::size_t>(std::min(
            2999.0, std::hypot(static_cast<double>(gx.at<short>(y, x)), static_cast<double>(gy.at<short>(y, x)))))];
    const double strong = std::max(60.0, quantile(steepness, 0.9));
    cv::Mat edges;
    cv::Canny(gx, gy, edges, strong / 2, strong, true);
    cv::Mat no_upright(grey.size(), CV_8U, cv::Scalar(255)), no_level(grey.size(), CV_8U, cv::Scalar(255));
    for (int y = 0; y < grey.rows; ++y)
      for (int x = 0; x < grey.cols; ++x) {
        if (edges.at<std::uint8_t>(y, x) == 0) continue;
        const int across = std::abs(gx.at<short>(y, x)), down = std::abs(gy.at<short>(y, x));
        if (2 * across >= down) no_upright.at<std::uint8_t>(y, x) = 0;
        if (2 * down >= across) no_level.at<std::uint8_t>(y, x) = 0;
      }
    cv::distanceTransform(no_upright, upright, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    cv::distanceTransform(no_level, level, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  }

  /// Between pixel centres by bilinear interpolation; negative outside the picture.
  [[nodiscard]] static float at(const cv::Mat& map, float u, float v) {
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(map.cols - 1) && v < static_cast<float>(map.rows - 1))) return -1;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
    const float *above = map.ptr<float>(y) + x, *below = map.ptr<float>(y + 1) + x;
    return (1 - b) * ((1 - a) * above[0] + a * above[1]) + b * ((1 - a) * below[0] + a * below[1]);
  }
};

std::size_t bin_of(float distance_px) {
  return static_cast<std::size_t>(std::min(static_cast<float>(kDistanceMax_px), distance_px) * kBinsPerPixel);
}

/// Where between the samples at -1, 0 and +1 the parabola through them is highest.
double peak_offset(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  return curvature < 0 ? std::clamp((before - after) / (2 * curvature), -0.5, 0.5) : 0;
}

std::string verdict_of(const RegistrationReport& r, bool is_at_border, double fx) {
  if (r.pairs_count == 0) return "There is no depth frame with a colour frame beside it, so nothing can be said.";
  if (r.edges_count < kEdgesMin)
    return "Too little stands in front of anything else in these frames to judge the registration by.";
  if (r.fit_share < kChanceFit)
    return "Depth edges lie no nearer to colour edges than chance has it: the scene has no contrast there, or the "
           "calibration is far off.";
  if (!r.is_decidable)
    return "Depth edges lie beside colour edges by amounts that vary: depth and colour are of different moments of a moving "
           "camera, or the calibration is off by more than a shift.";
  if (is_at_border)
    return "The registration is off by " + std::to_string(RegistrationCheck::kShiftMax) +
           " pixels or more; check which cameras the calibration is of.";
  const double shift_px = std::hypot(r.shift_x_px, r.shift_y_px);
  if (shift_px <= kGoodShift_px) return "The registration is good: no shift beyond a pixel would fit better.";
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(),
                "The registration is off: depth moved by (%+.1f, %+.1f) colour pixels would fit better, which is %.0f mm at "
                "%.2f m.",
                r.shift_x_px, r.shift_y_px, shift_px * r.edge_depth_m / fx * 1e3, r.edge_depth_m);
  return text.data();
}

/// The colour frame nearest in time to depth frames that are asked for one after another.
class ColorAtTime {
 public:
  explicit ColorAtTime(hal::Sensor& sensor)
      : sensor_(sensor),
        rgb_(static_cast<std::size_t>(sensor.calibration.color.width) *
             static_cast<std::size_t>(sensor.calibration.color.height) * 3) {}

  /// Empty: there is none within Pairing::kSkewMax.
  std::span<const std::uint8_t> at(const hal::FrameHeader& depth) {
    const std::int64_t wanted_ns = time_ns(depth);
    hal::FrameHeader next;
    for (int tries = 0; tries < kTriesMax; ++tries) {
      const rt::Status status = sensor_.color->peek(next, kFrameTimeout);
      if (status == rt::Status::corrupt) continue;
      if (status != rt::Status::ok) break;
      if (has_frame_ && std::abs(time_ns(next) - wanted_ns) >= std::abs(held_ns_ - wanted_ns)) break;
      if (time_ns(next) < wanted_ns - Pairing::kSkewMax.ns) {
        sensor_.color->skip();
        continue;
      }
      if (!has_frame_ && time_ns(next) > wanted_ns + Pairing::kSkewMax.ns) return {};
      has_frame_ = sensor_.color->read(rgb_, next, kFrameTimeout) == rt::Status::ok;
      held_ns_ = time_ns(next);
    }
    if (!has_frame_ || std::abs(held_ns_ - wanted_ns) > Pairing::kSkewMax.ns) return {};
    return rgb_;
  }

 private:
  static constexpr int kTriesMax = 100'000;  // frames passed over between two pairs: an hour at 30 Hz

  [[nodiscard]] std::int64_t time_ns(const hal::FrameHeader& header) const {
    return sensor_.has_two_clocks ? header.arrived.ns : header.time.ns;
  }

  hal::Sensor& sensor_;
  std::vector<std::uint8_t> rgb_;
  std::int64_t held_ns_ = 0;
  bool has_frame_ = false;
};

}  // namespace

RegistrationCheck::RegistrationCheck(const hal::RigCalibration& rig)
    : rig_(rig),
      at_place_(kDistanceMax_px * kBinsPerPixel + 1, 0),
      by_chance_(at_place_.size(), 0),
      fit_(kShifts * kShifts, 0.0),
      depths_(6554 * 10, 0) {}

void RegistrationCheck::add_edge(int x, int y, int step_x, int step_y, std::uint16_t raw) {
  const hal::Intrinsics &depth = rig_.depth, &color = rig_.color;
  // The edge itself is between the last near pixel and the next one.
  double u = x + 0.5 * step_x, v = y + 0.5 * step_y, z = raw * rig_.depth_m_per_unit;
  if (!rig_.registered) {
    Normalized ray{static_cast<float>((u - depth.cx) / depth.fx), static_cast<float>((v - depth.cy) / depth.fy)};
    if (depth.has_distortion()) ray = undistort(depth, ray);
    const Vec3d p = rig_.T_color_depth * Vec3d{static_cast<double>(ray.x) * z, static_cast<double>(ray.y) * z, z};
    if (!(p.z > 0.05)) return;
    z = p.z;
    // Brown's polynomial folds back far outside the image.
    if (std::fabs(p.x / z * color.fx) > color.width || std::fabs(p.y / z * color.fy) > color.height) return;
    const Normalized seen = distort(color, {static_cast<float>(p.x / z), static_cast<float>(p.y / z)});
    u = static_cast<double>(seen.x) * color.fx + color.cx;
    v = static_cast<double>(seen.y) * color.fy + color.cy;
  }
  if (!(u >= 0 && v >= 0 && u < color.width - 1 && v < color.height - 1)) return;
  edges_.push_back({static_cast<float>(u), static_cast<float>(v), step_x != 0});
  ++depths_[std::min(depths_.size() - 1, static_cast<std::size_t>(z * 100))];
}

void RegistrationCheck::find_edges(std::span<const std::uint16_t> raw) {
  edges_.clear();
  const int width = rig_.depth.width, height = rig_.depth.height;
  const auto value = [&](int x, int y) {
    return raw[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  };
  constexpr std::array<std::array<int, 2>, 4> kSteps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::uint16_t near = value(x, y);
      if (near == 0) continue;
      const double jump = std::max(kJumpShare * near, kJumpMin_m / rig_.depth_m_per_unit);
      for (const auto& [step_x, step_y] : kSteps)
        for (int i = 1; i <= kShadowPixels; ++i) {
          const int at_x = x + i * step_x, at_y = y + i * step_y;
          if (at_x < 0 || at_y < 0 || at_x >= width || at_y >= height) break;
          const std::uint16_t beyond = value(at_x, at_y);
          if (beyond == 0) continue;
          if (beyond > near + jump) add_edge(x, y, step_x, step_y, near);
          break;
        }
    }
}

void RegistrationCheck::add(std::span<const std::uint16_t> raw, std::span<const std::uint8_t> rgb) {
  ++pairs_count_;
  find_edges(raw);
  const cv::Mat image(rig_.color.height, rig_.color.width, CV_8UC3, const_cast<std::uint8_t*>(rgb.data()));
  const ColorEdges color(image);
  const auto distance = [&](const Edge& edge, float dx, float dy) {
    return ColorEdges::at(edge.is_across ? color.upright : color.level, edge.u + dx, edge.v + dy);
  };
  for (const Edge& edge : edges_)
    if (const float d = distance(edge, 0, 0); d >= 0) ++at_place_[bin_of(d)];

  for (int draw = 0; draw < kChanceDraws; ++draw) {
    random_state_ = random_state_ * 6364136223846793005u + 1442695040888963407u;
    const double angle = static_cast<double>(random_state_ >> 40) / (1 << 24) * 2 * M_PI;
    const double away_px = 24 + static_cast<double>(random_state_ >> 32 & 0xFF) / 8;  // 24 to 56
    const auto dx = static_cast<float>(away_px * std::cos(angle)), dy = static_cast<float>(away_px * std::sin(angle));
    for (const Edge& edge : edges_)
      if (const float d = distance(edge, dx, dy); d >= 0) ++by_chance_[bin_of(d)];
  }

  std::array<double, kDistanceMax_px * kBinsPerPixel + 1> agreement{};
  for (std::size_t i = 0; i < agreement.size(); ++i) {
    const double d = (static_cast<double>(i) + 0.5) / kBinsPerPixel / kFitSigma_px;
    agreement[i] = std::exp(-d * d / 2);
  }
  for (int row = 0; row < kShifts; ++row)
    for (int column = 0; column < kShifts; ++column) {
      const auto dx = static_cast<float>(column - kShiftMax), dy = static_cast<float>(row - kShiftMax);
      double sum = 0;
      for (const Edge& edge : edges_)
        if (const float d = distance(edge, dx, dy); d >= 0) sum += agreement[bin_of(d)];
      fit_[static_cast<std::size_t>(row * kShifts + column)] += sum;
    }
}

RegistrationReport RegistrationCheck::report() const {
  RegistrationReport r;
  r.pairs_count = pairs_count_;
  for (const std::uint32_t n : at_place_) r.edges_count += n;
  r.edge_depth_m = quantile(depths_, 0.5) / 100;
  r.median_px = quantile(at_place_, 0.5) / kBinsPerPixel;
  r.p90_px = quantile(at_place_, 0.9) / kBinsPerPixel;
  r.chance_median_px = quantile(by_chance_, 0.5) / kBinsPerPixel;
  r.chance_p90_px = quantile(by_chance_, 0.9) / kBinsPerPixel;

  if (r.edges_count == 0) {
    r.verdict = verdict_of(r, false, rig_.color.fx);
    return r;
  }
  const auto best = static_cast<int>(std::max_element(fit_.begin(), fit_.end()) - fit_.begin());
  const int row = best / kShifts, column = best % kShifts;
  const auto fit = [&](int y, int x) { return fit_[static_cast<std::size_t>(y * kShifts + x)]; };
  const bool is_at_border = row == 0 || column == 0 || row == kShifts - 1 || column == kShifts - 1;
  r.shift_x_px = column - kShiftMax;
  r.shift_y_px = row - kShiftMax;
  if (!is_at_border) {
    r.shift_x_px += peak_offset(fit(row, column - 1), fit(row, column), fit(row, column + 1));
    r.shift_y_px += peak_offset(fit(row - 1, column), fit(row, column), fit(row + 1, column));
  }
  // A peak stands out of what all shifts together give.
  double sum = 0;
  for (const double f : fit_) sum += f;
  r.fit_share = fit(row, column) / (sum / static_cast<double>(fit_.size()));
  r.is_decidable = r.edges_count >= kEdgesMin && r.fit_share > kPeakMin;
  r.verdict = verdict_of(r, is_at_border, rig_.color.fx);
  return r;
}

rt::Result<RegistrationReport> check_registration(hal::Sensor& sensor, const std::string& source, int pairs_max) {
  if (!sensor.color)
    return rt::Error{rt::ExitCode::bad_usage, source + ": there is no colour that depth could lie on."};
  const hal::Intrinsics& k = sensor.calibration.depth;
  std::vector<std::uint16_t> raw(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
  ColorAtTime color(sensor);
  RegistrationCheck check(sensor.calibration);
  const auto pairs = static_cast<std::uint64_t>(pairs_max);
  const std::uint64_t stride =
      sensor.frames_count > 0 ? std::max<std::uint64_t>(1, sensor.frames_count / pairs) : kLiveStride;
  Progress progress("checking " + source, sensor.frames_count, rt::Clock::monotonic());
  std::uint64_t taken = 0;
  for (std::uint64_t i = 0; taken < pairs; ++i) {
    hal::FrameHeader header;
    const rt::Status status = sensor.depth->read(raw, header, kFrameTimeout);
    if (status == rt::Status::corrupt) continue;
    if (status != rt::Status::ok) break;
    if (i % stride != stride / 2) continue;
    if (const auto rgb = color.at(header); !rgb.empty()) {
      check.add(raw, rgb);
      ++taken;
    }
    progress.update(i + 1);
  }
  return check.report();
}

}  // namespace tactus::firmware
