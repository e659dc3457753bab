#include "pipeline/register/panes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pipeline/register/depth_images.hpp"
#include "rt/assert.hpp"

namespace tactus {
namespace {

constexpr int kTileSide = 4;
constexpr int kHoleValidMax = 2;      // of 16 pixels: stray returns
constexpr int kIslandHolesMin = 5;    // of 8 neighbours: a measured tile inside a hole, as glass gives at times
constexpr int kBorderReach = 3;       // tiles between a hole and the first measured tile beside it
constexpr int kOuterStep = 2;         // tiles from there to the border's outer point
constexpr std::size_t kTilesMin = 48;  // 28 pixels squared
constexpr double kContactsPerTileMax = 0.5;  // a strip of four tiles; the shadow of an edge is thinner
constexpr double kEdgeShareMax = 0.5;        // of the contacts: the rest would be a guess
constexpr int kSectorsMin = 10;  // of 16 around the hole that hold border in the plane: a worktop that is lost at a slant
                                 // has a cupboard's front on one side only (7-Scenes kitchen, frame 71)
constexpr double kInlierShareMin = 0.75, kOuterInlierShareMin = 0.5, kBehindShareMax = 0.1;
// Returns inside a hole: in the plane from glass, before it from what stands there; behind it, it is an opening.
constexpr std::size_t kStraysBehindMin = 2, kStraysBehindPart = 4, kStraysToFit = 24;
constexpr double kToleranceM = 0.02;  // a frame's depth before its mirror; and two sigma of the sensor
constexpr double kFacingMin = 0.2;    // cosine; also what a wall's far end seen at a slant would ask for
constexpr double kZMaxM = 4.5;        // sigma is 33 mm there, a border of 100 tiles still a plane
constexpr double kZRatioMax = 1.4;    // of the pane to its border: it does not run away from it
constexpr int kTrials = 64;           // at 60 % inliers 1 of 10^6 fails to draw three good points
constexpr std::size_t kBorderMax = 1024;
constexpr std::size_t kBorderMin = 16;

/// Least squares for a plane.
struct PlaneSum {
  double m[6] = {};  // xx xy x1 yy y1 11
  double r[3] = {};
  void add(const InverseDepth& p) {
    const double x = p.ray_x, y = p.ray_y, q = p.inverse_z;
    m[0] += x * x, m[1] += x * y, m[2] += x, m[3] += y * y, m[4] += y, m[5] += 1;
    r[0] += x * q, r[1] += y * q, r[2] += q;
  }
  bool solve(InversePlane& plane) const {
    const double c00 = m[3] * m[5] - m[4] * m[4], c01 = m[2] * m[4] - m[1] * m[5], c02 = m[1] * m[4] - m[2] * m[3];
    const double det = m[0] * c00 + m[1] * c01 + m[2] * c02;
    if (!(std::fabs(det) > 1e-12 * m[5] * m[5] * m[5])) return false;  // in one line
    const double c11 = m[0] * m[5] - m[2] * m[2], c12 = m[1] * m[2] - m[0] * m[4], c22 = m[0] * m[3] - m[1] * m[1];
    plane = {(c00 * r[0] + c01 * r[1] + c02 * r[2]) / det, (c01 * r[0] + c11 * r[1] + c12 * r[2]) / det,
             (c02 * r[0] + c12 * r[1] + c22 * r[2]) / det};
    return true;
  }
};

/// In inverse depth, of a measurement at z.
double tolerance_at(double z_m) {
  return (kToleranceM + 2 * static_cast<double>(depth_sigma_m(static_cast<float>(z_m)))) / (z_m * z_m);
}

/// Which of 16 equal parts of the circle; by comparisons, so that every machine says the same.
int sector_of(double x, double y) {
  constexpr double kTan22 = 0.41421356237309503;
  const double ax = std::fabs(x), ay = std::fabs(y);
  return (x < 0 ? 8 : 0) + (y < 0 ? 4 : 0) + (ax < ay ? 2 : 0) + (std::min(ax, ay) < kTan22 * std::max(ax, ay) ? 1 : 0);
}

}  // namespace

double PaneFiller::ray_x_of(Tile tile) const noexcept { return (4.0 * (tile % tiles_x_) + 1.5 - full_.cx) * inverse_fx_; }
double PaneFiller::ray_y_of(Tile tile) const noexcept { return (4.0 * (tile / tiles_x_) + 1.5 - full_.cy) * inverse_fy_; }

std::size_t PaneFiller::bytes_needed(const hal::Intrinsics& full) {
  const std::size_t tiles = tiles_count(full.width, full.height);
  return rt::bytes_of<Kind>(tiles) + rt::bytes_of<float>(tiles) + rt::bytes_of<std::uint16_t>(tiles) +
         rt::bytes_of<Tile>(tiles) + rt::bytes_of<BorderPoint>(kBorderMax) +
         rt::bytes_of<std::uint64_t>(pane_words_count(full)) + rt::bytes_of<float>(tiles * 4);
}

void PaneFiller::bind(rt::Slice& memory, const hal::Intrinsics& full) {
  TACTUS_ASSERT(full.width % kTileSide == 0 && full.height % kTileSide == 0 &&
                tiles_count(full.width, full.height) <= 65535);
  full_ = full;
  inverse_fx_ = 1 / full.fx;
  inverse_fy_ = 1 / full.fy;
  tiles_x_ = full.width / kTileSide;
  tiles_y_ = full.height / kTileSide;
  const std::size_t tiles = tiles_count(full.width, full.height);
  kind_ = memory.take<Kind>(tiles);
  tile_m_ = memory.take<float>(tiles);
  border_of_ = memory.take<std::uint16_t>(tiles);
  hole_ = memory.take<Tile>(tiles);
  border_ = memory.take<BorderPoint>(kBorderMax);
  pane_bits_ = memory.take<std::uint64_t>(pane_words_count(full));
  closed_half_m_ = memory.take<float>(tiles * 4);
}

void PaneFiller::clear() noexcept {
  if (panes_count_ > 0) std::fill(pane_bits_.begin(), pane_bits_.end(), 0);
  panes_count_ = 0;
}

void PaneFiller::classify(std::span<const std::uint16_t> depth) noexcept {
  const auto width = static_cast<std::size_t>(full_.width), tiles_x = static_cast<std::size_t>(tiles_x_);
  std::fill(border_of_.begin(), border_of_.end(), std::uint16_t{0});
  for (std::size_t tile = 0; tile < kind_.size(); ++tile) {
    kind_[tile] = Kind::measured;
    if (tile_m_[tile] > 0) continue;
    const std::uint16_t* first = &depth[tile / tiles_x * kTileSide * width + tile % tiles_x * kTileSide];
    int valid = 0;
    for (std::size_t y = 0; y < kTileSide; ++y)
      for (std::size_t x = 0; x < kTileSide; ++x) valid += first[y * width + x] != 0;
    kind_[tile] = valid <= kHoleValidMax ? Kind::hole : Kind::mixed;
  }
}

InverseDepth PaneFiller::measurement_of(Tile tile) const noexcept {
  const auto z = static_cast<double>(tile_m_[tile]);
  return {ray_x_of(tile), ray_y_of(tile), 1 / z, tolerance_at(z)};
}

void PaneFiller::add_border(Tile tile) noexcept {
  const int tx = tile % tiles_x_, ty = tile / tiles_x_;
  constexpr std::array<std::array<int, 2>, 4> kSteps = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  const auto inside = [&](int x, int y) { return x >= 0 && y >= 0 && x < tiles_x_ && y < tiles_y_; };
  const auto index = [&](int x, int y) { return static_cast<std::size_t>(y * tiles_x_ + x); };
  const auto put = [&](int x, int y, bool is_outer) {
    const std::size_t at = index(x, y);
    if (border_of_[at] == hole_number_ || border_count_ == border_.size()) return;
    border_of_[at] = hole_number_;
    border_[border_count_++] = {measurement_of(static_cast<Tile>(at)), is_outer};
  };
  for (const auto& step : kSteps) {
    int x = tx + step[0], y = ty + step[1];
    if (inside(x, y) && (kind_[index(x, y)] == Kind::seen || kind_[index(x, y)] == Kind::stray)) continue;
    ++contacts_count_;
    for (int reach = 1; reach < kBorderReach && inside(x, y) && kind_[index(x, y)] == Kind::mixed; ++reach)
      x += step[0], y += step[1];
    if (!inside(x, y)) {
      ++edge_contacts_count_;
      continue;
    }
    if (kind_[index(x, y)] != Kind::measured) continue;
    put(x, y, false);
    x += kOuterStep * step[0], y += kOuterStep * step[1];
    if (inside(x, y) && kind_[index(x, y)] == Kind::measured) put(x, y, true);
  }
}

bool PaneFiller::is_island(int x, int y) const noexcept {
  if (x == 0 || y == 0 || x == tiles_x_ - 1 || y == tiles_y_ - 1) return false;
  int holes = 0;
  for (int ny = y - 1; ny <= y + 1; ++ny)
    for (int nx = x - 1; nx <= x + 1; ++nx) {
      const Kind kind = kind_[static_cast<std::size_t>(ny * tiles_x_ + nx)];
      holes += kind == Kind::hole || kind == Kind::seen;
    }
  return holes >= kIslandHolesMin;
}

void PaneFiller::flood(Tile first) noexcept {
  hole_count_ = border_count_ = contacts_count_ = edge_contacts_count_ = 0;
  ++hole_number_;
  hole_[hole_count_++] = first;
  kind_[first] = Kind::seen;
  for (std::size_t next = 0; next < hole_count_; ++next) {
    const int x = hole_[next] % tiles_x_, y = hole_[next] / tiles_x_;
    const auto visit = [&](int nx, int ny) {
      if (nx < 0 || ny < 0 || nx >= tiles_x_ || ny >= tiles_y_) return;
      const auto tile = static_cast<Tile>(ny * tiles_x_ + nx);
      if (kind_[tile] == Kind::hole) {
        kind_[tile] = Kind::seen;
      } else if (kind_[tile] != Kind::seen && kind_[tile] != Kind::stray && is_island(nx, ny)) {
        kind_[tile] = Kind::stray;
      } else {
        return;
      }
      hole_[hole_count_++] = tile;
    };
    visit(x + 1, y);
    visit(x - 1, y);
    visit(x, y + 1);
    visit(x, y - 1);
  }
}

// RANSAC, then two rounds of least squares over what agrees.
bool PaneFiller::find_plane(InversePlane& plane) const noexcept {
  const auto border = border_.first(border_count_);
  std::uint32_t state = 1;  // the same draws for every hole: equal images, equal planes
  std::size_t best_count = 0;
  for (int trial = 0; trial < kTrials && best_count * 10 <= border.size() * 9; ++trial) {
    PlaneSum three;
    for (int i = 0; i < 3; ++i) {
      state = state * 1664525u + 1013904223u;
      three.add(border[(state >> 8) % border.size()].point);
    }
    InversePlane candidate;
    if (!three.solve(candidate)) continue;
    std::size_t count = 0;
    for (const BorderPoint& b : border) count += candidate.holds(b.point);
    if (count > best_count) {
      best_count = count;
      plane = candidate;
    }
  }
  if (best_count < kBorderMin) return false;
  for (int round = 0; round < 2; ++round) {
    PlaneSum all;
    for (const BorderPoint& b : border)
      if (plane.holds(b.point)) all.add(b.point);
    if (!all.solve(plane)) return false;
  }
  return true;
}

bool PaneFiller::border_is_of(const InversePlane& plane, Range& range) const noexcept {
  double centre_x = 0, centre_y = 0;
  for (const Tile tile : hole_.first(hole_count_)) {
    centre_x += ray_x_of(tile);
    centre_y += ray_y_of(tile);
  }
  centre_x /= static_cast<double>(hole_count_);
  centre_y /= static_cast<double>(hole_count_);
  std::uint32_t sectors = 0;
  double inner = 0, inner_held = 0, outer = 0, outer_held = 0, behind = 0;
  range = {0, 1e9};
  for (const auto& [point, is_outer] : border_.first(border_count_)) {
    const bool is_held = plane.holds(point);
    (is_outer ? outer : inner) += 1;
    (is_outer ? outer_held : inner_held) += is_held;
    behind += !is_held && plane.behind(point) > 0;
    if (!is_held) continue;
    sectors |= 1u << sector_of(point.ray_x - centre_x, point.ray_y - centre_y);
    range.nearest = std::max(range.nearest, point.inverse_z);
    range.farthest = std::min(range.farthest, point.inverse_z);
  }
  return inner_held >= kInlierShareMin * inner && outer_held >= kOuterInlierShareMin * outer &&
         behind <= kBehindShareMax * (inner + outer) && std::popcount(sectors) >= kSectorsMin;
}

bool PaneFiller::hole_is_pane(const Range& border, InversePlane& plane) const noexcept {
  const auto hole = hole_.first(hole_count_);
  const double norm = std::sqrt(plane.x * plane.x + plane.y * plane.y + plane.one * plane.one);
  std::size_t strays_count = 0, behind_count = 0, held_count = 0;
  PlaneSum held;
  for (const Tile tile : hole) {
    const double ray_x = ray_x_of(tile), ray_y = ray_y_of(tile), q = plane.inverse_z_at(ray_x, ray_y);
    if (!(q * kZMaxM >= 1 && q <= border.nearest * kZRatioMax && q * kZRatioMax >= border.farthest)) return false;
    if (!(q >= kFacingMin * norm * std::sqrt(ray_x * ray_x + ray_y * ray_y + 1))) return false;
    if (!(tile_m_[tile] > 0)) continue;
    const InverseDepth stray = measurement_of(tile);
    ++strays_count;
    if (plane.holds(stray)) {
      ++held_count;
      held.add(stray);
    } else {
      behind_count += plane.behind(stray) > 0;
    }
  }
  if (behind_count > std::max(kStraysBehindMin, strays_count / kStraysBehindPart)) return false;
  // A pane lies some millimetres behind its frame: where enough of it came back, that says more than the frame.
  InversePlane own;
  if (held_count < kStraysToFit || !held.solve(own)) return true;
  for (const Tile tile : hole) {
    const double ray_x = ray_x_of(tile), ray_y = ray_y_of(tile), q = plane.inverse_z_at(ray_x, ray_y);
    // Returns in one corner say nothing of the other.
    if (!(std::fabs(own.inverse_z_at(ray_x, ray_y) - q) <= kToleranceM * q * q)) return true;
  }
  plane = own;
  return true;
}

void PaneFiller::close(const InversePlane& plane, std::span<std::uint16_t> depth) noexcept {
  const auto half_width = static_cast<std::size_t>(full_.width / 2), width = static_cast<std::size_t>(full_.width);
  const auto mark = [&](std::size_t pixel) { pane_bits_[pixel / 64] |= std::uint64_t{1} << (pixel % 64); };
  const double dx = plane.x / full_.fx / 2, dy = plane.y / full_.fy / 2;  // of inverse depth, over half a pixel
  const auto towards_00 = static_cast<float>(dx + dy), towards_01 = static_cast<float>(dx - dy);
  const double at_corner = plane.inverse_z_at((0.5 - full_.cx) / full_.fx, (0.5 - full_.cy) / full_.fy);
  const auto close_tile = [&](std::size_t tile, bool is_inside) {
    const std::size_t tx = tile % static_cast<std::size_t>(tiles_x_), ty = tile / static_cast<std::size_t>(tiles_x_);
    for (std::size_t hy = 2 * ty; hy < 2 * ty + 2; ++hy)
      for (std::size_t hx = 2 * tx; hx < 2 * tx + 2; ++hx) {
        std::uint16_t* above = &depth[2 * hy * width + 2 * hx];
        std::uint16_t* below = above + width;
        const std::size_t pixel = hy * half_width + hx;
        const double q = at_corner + static_cast<double>(hx) * 4 * dx + static_cast<double>(hy) * 4 * dy;
        if ((above[0] | above[1] | below[0] | below[1]) != 0) {
          const auto z = static_cast<double>(closed_half_m_[pixel]);
          if (is_inside && z > 0 && std::fabs(1 / z - q) <= tolerance_at(z)) mark(pixel);
          continue;
        }
        // 1 / (q + d) = z - z^2 d to 10 um: the four pixels lie half a pixel beside.
        // Within a pane z is between 0.2 and 4.5 m, so that they fit.
        const float z = 1.0f / static_cast<float>(q), middle = z / kDepthUnitM + 0.5f, slope = z * z / kDepthUnitM;
        above[0] = static_cast<std::uint16_t>(middle + slope * towards_00);
        above[1] = static_cast<std::uint16_t>(middle - slope * towards_01);
        below[0] = static_cast<std::uint16_t>(middle + slope * towards_01);
        below[1] = static_cast<std::uint16_t>(middle - slope * towards_00);
        closed_half_m_[pixel] = z;
        mark(pixel);
      }
  };
  for (const Tile tile : hole_.first(hole_count_)) {
    close_tile(tile, true);
    // The tiles around hold the hole's own edge.
    const int tx = tile % tiles_x_, ty = tile / tiles_x_;
    for (int y = std::max(ty - 1, 0); y <= std::min(ty + 1, tiles_y_ - 1); ++y)
      for (int x = std::max(tx - 1, 0); x <= std::min(tx + 1, tiles_x_ - 1); ++x) {
        const auto beside = static_cast<std::size_t>(y * tiles_x_ + x);
        if (kind_[beside] == Kind::mixed || kind_[beside] == Kind::measured) close_tile(beside, false);
      }
  }
}

std::span<const float> PaneFiller::fill(std::span<std::uint16_t> depth, std::span<const float> half_m) noexcept {
  TACTUS_ASSERT(half_m.size() == closed_half_m_.size() && depth.size() == 4 * half_m.size());
  clear();
  tile_means(half_m, full_, tile_m_);
  classify(depth);
  hole_number_ = 0;
  for (std::size_t first = 0; first < kind_.size() && panes_count_ < kPanesMax; ++first) {
    if (kind_[first] != Kind::hole) continue;
    flood(static_cast<Tile>(first));
    if (hole_count_ < kTilesMin) continue;
    for (std::size_t i = 0; i < hole_count_; ++i) add_border(hole_[i]);
    const auto contacts = static_cast<double>(contacts_count_);
    if (contacts > kContactsPerTileMax * static_cast<double>(hole_count_) ||
        static_cast<double>(edge_contacts_count_) > kEdgeShareMax * contacts || border_count_ < kBorderMin)
      continue;
    InversePlane plane;
    Range border;
    if (!find_plane(plane) || !border_is_of(plane, border) || !hole_is_pane(border, plane)) continue;
    if (panes_count_ == 0) std::copy(half_m.begin(), half_m.end(), closed_half_m_.begin());
    close(plane, depth);
    ++panes_count_;
  }
  return panes_count_ > 0 ? std::span<const float>(closed_half_m_) : half_m;
}

}  // namespace tactus
