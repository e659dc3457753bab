#include "firmware_host/report_plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_host/html.hpp"
#include "firmware_host/run_result.hpp"

namespace tactus::firmware {
namespace {

struct Column {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double sum = 0;
  std::size_t count = 0;
};

/// The series reduced to at most `columns_max` columns.
std::vector<Column> columns_of(std::span<const float> values, std::size_t columns_max) {
  const std::size_t count = std::min(values.size(), columns_max);
  std::vector<Column> columns(count);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    Column& c = columns[i * count / values.size()];
    const auto v = static_cast<double>(values[i]);
    c.low = std::min(c.low, v);
    c.high = std::max(c.high, v);
    c.sum += v;
    ++c.count;
  }
  return columns;
}

/// 1, 2 or 5 times a power of ten, so that about `steps` of it cover `range`.
double nice_step(double range, int steps) {
  const double raw = range / steps;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (raw <= factor * power * 1.0001) return factor * power;
  return 10 * power;
}

int digits_of(double step) { return std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9))); }

std::string point(double x, double y) { return fixed(x, 1) + "," + fixed(y, 1); }

/// Upper end of the scale: everything, unless the maximum stands far above the 99th percentile.
double scale_top(std::span<const float> values, double budget) {
  const LatencySummary s = summarise_latency(values);
  const double usual = s.max > 2.5 * s.p99 ? 1.5 * s.p99 : s.max;
  const double top = std::max(usual, budget > 0 && budget < 6 * usual ? budget * 1.05 : usual);
  return top > 0 ? top * 1.06 : 1;
}

/// Band, line and spike marks of a series in the rectangle (x0, y0) to (x1, y1), y1 at the bottom = 0.
std::string series_marks(std::span<const float> values, double top, double x0, double y0, double x1,
                         double y1, std::size_t columns_max) {
  const std::vector<Column> columns = columns_of(values, columns_max);
  const auto count = static_cast<double>(columns.size());
  const auto x = [&](std::size_t i) { return x0 + (static_cast<double>(i) + 0.5) / count * (x1 - x0); };
  const auto y = [&](double v) { return y1 - std::min(v, top) / top * (y1 - y0); };
  std::string line, bands, spikes;
  for (std::size_t i = 0; i < columns.size();) {
    if (columns[i].count == 0) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < columns.size() && columns[end].count > 0) ++end;
    std::string upper, lower;
    for (std::size_t k = i; k < end; ++k) {
      const double mean = columns[k].sum / static_cast<double>(columns[k].count);
      line += (k == i ? "M" : "L") + point(x(k), y(mean));
      upper += (k == i ? "M" : "L") + point(x(k), y(columns[k].high));
      lower = "L" + point(x(k), y(columns[k].low)) + lower;
      if (columns[k].high > top) spikes += "M" + point(x(k) - 3, y0 + 1) + "l3,-5l3,5z";
    }
    // A lone value between gaps would be a path without length: give it the width of its column.
    if (end == i + 1) line += "h" + fixed(std::max(1.0, (x1 - x0) / count), 1);
    bands += upper + lower + "Z";
    i = end;
  }
  std::string svg = "<path class=\"band\" d=\"" + bands + "\"/><path class=\"line\" d=\"" + line + "\"/>";
  if (!spikes.empty()) svg += "<path class=\"spike\" d=\"" + spikes + "\"/>";
  return svg;
}

struct Bounds {
  double x_min = std::numeric_limits<double>::infinity(), x_max = -std::numeric_limits<double>::infinity();
  double y_min = x_min, y_max = x_max;
  void add(double x, double y) {
    x_min = std::min(x_min, x);
    x_max = std::max(x_max, x);
    y_min = std::min(y_min, y);
    y_max = std::max(y_max, y);
  }
};

}  // namespace

std::string series_svg(const SeriesPlot& plot) {
  constexpr double kWidth = 960, kHeight = 240, kLeft = 46, kRight = 950, kTop = 14, kBottom = 208;
  const double top = scale_top(plot.values, plot.budget);
  const auto y = [&](double v) { return kBottom - v / top * (kBottom - kTop); };
  std::string svg =
      "<svg class=\"plot\" viewBox=\"0 0 960 240\" role=\"img\" aria-label=\"" + escaped(plot.label) + "\">";
  const double y_step = nice_step(top, 5);
  for (double v = 0; v <= top; v += y_step) {
    svg += "<path class=\"grid\" d=\"M" + point(kLeft, y(v)) + "H" + fixed(kRight, 1) +
           "\"/><text class=\"tick\" x=\"" + fixed(kLeft - 8, 1) + "\" y=\"" + fixed(y(v) + 4, 1) +
           "\" text-anchor=\"end\">" + fixed(v, digits_of(y_step)) + "</text>";
  }
  const bool is_time = plot.seconds_per_value > 0;
  const double x_range = static_cast<double>(plot.values.size()) * (is_time ? plot.seconds_per_value : 1);
  const double x_step = x_range > 0 ? std::max(nice_step(x_range, 8), is_time ? 0.0 : 1.0) : 1;
  for (double v = 0; v <= x_range * 1.0001 && x_range > 0; v += x_step) {
    const double x = kLeft + v / x_range * (kRight - kLeft);
    // The last label would run over the edge or into the axis title.
    if (x > kRight - 70) break;
    svg += "<path class=\"grid\" d=\"M" + point(x, kBottom) + "v4\"/><text class=\"tick\" x=\"" +
           fixed(x, 1) + "\" y=\"" + fixed(kBottom + 18, 1) + "\" text-anchor=\"middle\">" +
           fixed(v, digits_of(x_step)) + "</text>";
  }
  svg += "<text class=\"tick\" x=\"" + fixed(kRight, 1) + "\" y=\"" + fixed(kBottom + 18, 1) +
         "\" text-anchor=\"end\">" + (is_time ? "seconds" : "frame") + "</text>";
  svg += "<text class=\"tick\" x=\"" + fixed(kLeft + 4, 1) + "\" y=\"" + fixed(kTop - 3, 1) + "\">" +
         escaped(plot.unit) + "</text>";
  svg += series_marks(plot.values, top, kLeft, kTop, kRight, kBottom, 600);
  if (plot.budget > 0 && plot.budget <= top) {
    svg += "<path class=\"budget\" d=\"M" + point(kLeft, y(plot.budget)) + "H" + fixed(kRight, 1) +
           "\"/><text class=\"budget-label\" x=\"" + fixed(kRight - 4, 1) + "\" y=\"" +
           fixed(y(plot.budget) - 5, 1) + "\" text-anchor=\"end\">" + escaped(plot.budget_label) + "</text>";
  }
  static_assert(kWidth == 960 && kHeight == 240, "the viewBox above");
  return svg + "</svg>";
}

std::string sparkline_svg(std::span<const float> values, double budget) {
  constexpr double kWidth = 220, kHeight = 30;
  // A stage that runs once in many frames would be dots: its runs are drawn side by side instead.
  std::vector<float> runs;
  for (const float v : values)
    if (std::isfinite(v)) runs.push_back(v);
  if (runs.empty()) return {};
  if (2 * runs.size() < values.size()) values = runs;
  const double top = scale_top(values, budget);
  std::string svg =
      "<svg class=\"spark\" viewBox=\"0 0 220 30\" aria-hidden=\"true\"><path class=\"grid\" "
      "d=\"M0,29.5H220\"/>";
  svg += series_marks(values, top, 0, 6, kWidth, kHeight - 1, 220);
  if (budget > 0 && budget <= top) {
    svg +=
        "<path class=\"budget\" d=\"M0," + fixed(kHeight - 1 - budget / top * (kHeight - 7), 1) + "H220\"/>";
  }
  return svg + "</svg>";
}

std::string range_svg(const LatencySummary& latency_ms, double budget_ms) {
  if (!(budget_ms > 0)) return {};
  const auto x = [&](double v) { return fixed(std::clamp(v / (1.5 * budget_ms), 0.0, 1.0) * 198 + 1, 1); };
  std::string svg =
      "<svg class=\"range\" viewBox=\"0 0 200 20\" aria-hidden=\"true\"><path class=\"grid\" "
      "d=\"M1,10H199\"/>";
  svg += "<path class=\"whisker\" d=\"M" + x(latency_ms.p99) + ",10H" + x(latency_ms.max) + "\"/>";
  svg += "<path class=\"" + std::string(latency_ms.p99 > budget_ms ? "bar over" : "bar") + "\" d=\"M1,10H" +
         x(latency_ms.p99) + "\"/>";
  svg += "<path class=\"median\" d=\"M" + x(latency_ms.p50) + ",5V15\"/>";
  return svg + "<path class=\"budget\" d=\"M" + x(budget_ms) + ",1V19\"/></svg>";
}

std::string trajectory_svg(std::span<const evaluate::StampedPose> estimate,
                           std::span<const evaluate::StampedPose> truth, View view, rt::Duration gap_max) {
  constexpr double kWidth = 470, kHeight = 360, kMargin = 34;
  Bounds x_bounds;  // of x and z over the floor plan, to choose the side view's axis
  for (const auto& pose : estimate)
    x_bounds.add(pose.T_world_depth.translation.x, pose.T_world_depth.translation.z);
  const bool side_is_z =
      view == View::side && x_bounds.y_max - x_bounds.y_min > x_bounds.x_max - x_bounds.x_min;
  const auto horizontal = [&](const Vec3d& p) { return side_is_z ? p.z : p.x; };
  const auto vertical = [&](const Vec3d& p) { return view == View::top ? -p.z : p.y; };

  Bounds bounds;
  for (const auto& pose : estimate)
    bounds.add(horizontal(pose.T_world_depth.translation), vertical(pose.T_world_depth.translation));
  for (const auto& pose : truth)
    bounds.add(horizontal(pose.T_world_depth.translation), vertical(pose.T_world_depth.translation));
  if (estimate.empty() && truth.empty()) return {};
  // A camera that stands still is drawn at 2 cm across, not at the scale of its noise.
  const double extent_x = bounds.x_max - bounds.x_min, extent_y = bounds.y_max - bounds.y_min;
  const double scale = std::min((kWidth - 2 * kMargin) / std::max(extent_x, 0.02),
                                (kHeight - 2 * kMargin) / std::max(extent_y, 0.02));
  const auto place = [&](const Vec3d& p) {
    return Vec3d{kWidth / 2 + (horizontal(p) - (bounds.x_min + bounds.x_max) / 2) * scale,
                 kHeight / 2 - (vertical(p) - (bounds.y_min + bounds.y_max) / 2) * scale, 0};
  };
  const auto path = [&](std::span<const evaluate::StampedPose> poses) {
    std::string d;
    Vec3d last;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Vec3d q = place(poses[i].T_world_depth.translation);
      const bool is_start = i == 0 || poses[i].time - poses[i - 1].time > gap_max;
      // Steps below a third of a pixel are invisible; the ends are kept.
      if (!is_start && i + 1 < poses.size() && (q - last).norm() < 0.33) continue;
      d += (is_start ? "M" : "L") + point(q.x, q.y);
      last = q;
    }
    return d;
  };

  std::string svg = "<svg class=\"plot\" viewBox=\"0 0 470 360\" role=\"img\" aria-label=\"" +
                    std::string(view == View::top ? "camera path from above" : "camera path from the side") +
                    "\">";
  const double grid_m = nice_step(std::max(kWidth, kHeight) / scale, 8);
  const double x_first = std::ceil(((bounds.x_min + bounds.x_max) / 2 - kWidth / 2 / scale) / grid_m);
  const double y_first = std::ceil(((bounds.y_min + bounds.y_max) / 2 - kHeight / 2 / scale) / grid_m);
  std::string grid;
  for (int i = 0; i < 20; ++i) {
    const double gx = kWidth / 2 + ((x_first + i) * grid_m - (bounds.x_min + bounds.x_max) / 2) * scale;
    const double gy = kHeight / 2 - ((y_first + i) * grid_m - (bounds.y_min + bounds.y_max) / 2) * scale;
    if (gx <= kWidth) grid += "M" + point(gx, 0) + "V360";
    if (gy >= 0) grid += "M" + point(0, gy) + "H470";
  }
  svg += "<path class=\"grid\" d=\"" + grid + "\"/>";
  if (!truth.empty()) svg += "<path class=\"truth\" d=\"" + path(truth) + "\"/>";
  if (!estimate.empty()) {
    // Where the camera looked, about two dozen times along the path.
    std::string looks;
    const std::size_t stride = std::max<std::size_t>(1, estimate.size() / 24);
    for (std::size_t i = 0; i < estimate.size(); i += stride) {
      const T_WorldDepth& T = estimate[i].T_world_depth;
      const Vec3d from = place(T.translation);
      const Vec3d to = place(T.translation + T.rotation * Vec3d{0, 0, 1} * (18 / scale));
      looks += "M" + point(from.x, from.y) + "L" + point(to.x, to.y);
    }
    svg += "<path class=\"look\" d=\"" + looks + "\"/><path class=\"line\" d=\"" + path(estimate) + "\"/>";
    const Vec3d start = place(estimate.front().T_world_depth.translation);
    const Vec3d end = place(estimate.back().T_world_depth.translation);
    svg += "<circle class=\"start\" cx=\"" + fixed(start.x, 1) + "\" cy=\"" + fixed(start.y, 1) +
           "\" r=\"4.5\"/>";
    svg += "<circle class=\"end\" cx=\"" + fixed(end.x, 1) + "\" cy=\"" + fixed(end.y, 1) + "\" r=\"4.5\"/>";
  }
  const double bar = grid_m * scale;
  svg += "<path class=\"scale\" d=\"M12," + fixed(kHeight - 14, 1) + "v4h" + fixed(bar, 1) +
         "v-4\"/><text class=\"tick\" x=\"" + fixed(12 + bar + 6, 1) + "\" y=\"" + fixed(kHeight - 9, 1) +
         "\">" +
         (grid_m >= 1      ? fixed(grid_m, 0) + " m"
          : grid_m >= 0.01 ? fixed(grid_m * 100, 0) + " cm"
                           : fixed(grid_m * 1000, 0) + " mm") +
         "</text>";
  svg += "<text class=\"tick\" x=\"460\" y=\"" + fixed(kHeight - 9, 1) + "\" text-anchor=\"end\">" +
         std::string(view == View::top ? "x →, −z ↑"
                     : side_is_z       ? "z →, y ↑"
                                       : "x →, y ↑") +
         "</text>";
  return svg + "</svg>";
}

}  // namespace tactus::firmware
