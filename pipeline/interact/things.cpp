#include "pipeline/interact/things.hpp"

#include <cmath>

#include "pipeline/contact/hull.hpp"

namespace tactus::interact {
namespace {

constexpr double kPlateRadiusM = 0.11, kPlateHeightM = 0.012, kPlateWallM = 0.005;
constexpr double kCupRadiusM = 0.035, kCupHeightM = 0.1, kCupWallM = 0.002;
// Shards as thin as the glass would hang on voxels; only the mass is that of the real wall.
constexpr double kShardM = 0.004;

/// Unit vectors every 22.5 degrees.
constexpr double kC1 = 0.92387953251128674, kS1 = 0.38268343236508977, kC2 = 0.70710678118654752;
constexpr std::array<std::array<double, 2>, 16> kCircle = {{{1, 0}, {kC1, kS1}, {kC2, kC2}, {kS1, kC1}, {0, 1}, {-kS1, kC1}, {-kC2, kC2}, {-kC1, kS1},
    {-1, 0}, {-kC1, -kS1}, {-kC2, -kC2}, {-kS1, -kC1}, {0, -1}, {kS1, -kC1}, {kC2, -kC2}, {kC1, -kS1}}};

Vec3d on_circle(std::size_t step, double radius_m, double z_m) {
  const auto& direction = kCircle[step % 16];
  return {direction[0] * radius_m, direction[1] * radius_m, z_m};
}

/// Radius of the crack around the middle at each eighth turn: uneven, as cracks are.
constexpr std::array<double, 8> kCrackRadius = {0.46, 0.55, 0.42, 0.5, 0.6, 0.44, 0.52, 0.48};

/// Corner points of one piece, both faces of it.
struct Points {
  std::array<Vec3d, 16> at;
  std::size_t count = 0;
  void add(const Vec3d& p) { at[count++] = p; }
  void add_both(Vec3d p, double half_m) {
    p.z = half_m;
    add(p);
    p.z = -half_m;
    add(p);
  }
};

Points plate_piece(std::size_t i) {
  Points points;
  const double half = kPlateHeightM / 2;
  const auto crack = [&](std::size_t eighth) { return on_circle(2 * eighth, kPlateRadiusM * kCrackRadius[eighth % 8], 0); };
  if (i < 4) {  // a quarter of the middle
    points.add_both({}, half);
    for (std::size_t k = 0; k <= 2; ++k) points.add_both(crack(2 * i + k), half);
    return points;
  }
  const std::size_t eighth = i - 4;  // of the rim
  points.add_both(crack(eighth), half);
  points.add_both(crack(eighth + 1), half);
  for (std::size_t k = 0; k <= 2; ++k) points.add_both(on_circle(2 * eighth + k, kPlateRadiusM, 0), half);
  return points;
}

Points cup_piece(std::size_t i) {
  Points points;
  const double half = kCupHeightM / 2;
  if (i >= 10) {  // half of the foot
    for (std::size_t k = 0; k <= 4; ++k) {
      const Vec3d p = on_circle(8 * (i - 10) + 2 * k, kCupRadiusM - kShardM, 0);
      points.add({p.x, p.y, -half});
      points.add({p.x, p.y, -half + kShardM});
    }
    return points;
  }
  // Five staves, each broken across at its own height.
  const std::size_t stave = i % 5;
  const double break_z = half * (0.3 - 0.15 * static_cast<double>(stave));
  const double low = i < 5 ? -half : break_z, high = i < 5 ? break_z : half;
  const std::size_t from = stave * 3, to = stave == 4 ? 16 : from + 3;
  for (const std::size_t step : {from, to})
    for (const double radius : {kCupRadiusM, kCupRadiusM - kShardM})
      for (const double z : {low, high}) points.add(on_circle(step, radius, z));
  return points;
}

/// About a centimetre and a half long: of the chips that fly, those that are seen from across a room.
Points chip_points(contact::BreakPattern pattern) {
  Points points;
  const auto box = [&](double x, double y, double z, double lean) {
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0})
        for (const double sz : {-1.0, 1.0}) points.add({sx * x + sy * lean, sy * y, sz * z});
  };
  switch (pattern) {
    case contact::BreakPattern::shards:
      points.add_both({0.010, 0, 0}, 0.0015);
      points.add_both({-0.007, 0.007, 0}, 0.0015);
      points.add_both({-0.003, -0.008, 0}, 0.0015);
      break;
    case contact::BreakPattern::splinters: box(0.013, 0.002, 0.0016, 0.0016); break;
    case contact::BreakPattern::fibres: box(0.009, 0.0013, 0.0013, 0); break;
    case contact::BreakPattern::crumbs:
    case contact::BreakPattern::none: box(0.0065, 0.005, 0.004, 0.0015); break;
  }
  return points;
}

}  // namespace

std::size_t ThingCatalogue::bytes_needed() { return rt::bytes_of<contact::ConvexHull>(kHullsCount); }

rt::Result<void> ThingCatalogue::cut(std::size_t hull, std::span<const Vec3d> points, Vec3d& center_m) {
  auto made = contact::make_hull(points, &center_m);
  if (!made) return made.error();
  hulls_[hull] = *made;
  return {};
}

rt::Result<void> ThingCatalogue::bind(rt::Slice& slice) {
  hulls_ = slice.take<contact::ConvexHull>(kHullsCount);
  for (std::size_t i = 0; i < 2 * kPiecesCount; ++i) {
    const Points points = i < kPiecesCount ? plate_piece(i) : cup_piece(i - kPiecesCount);
    pieces_[i].hull = &hulls_[i];
    if (auto done = cut(i, std::span(points.at).first(points.count), pieces_[i].offset_m); !done) return done.error();
  }
  for (std::size_t i = 0; i < kChipShapesCount; ++i) {
    const Points points = chip_points(static_cast<contact::BreakPattern>(i));
    Vec3d center;
    if (auto done = cut(2 * kPiecesCount + i, std::span(points.at).first(points.count), center); !done)
      return done.error();
  }

  Thing& plate = things_[static_cast<std::size_t>(ThingKind::plate)];
  plate.shape = contact::Shape::cylinder(kPlateRadiusM, kPlateHeightM / 2);
  plate.material = material_from_name("ceramic");
  plate.build = {kPlateWallM, kPlateRadiusM, contact::kPi * kPlateRadiusM * kPlateRadiusM * kPlateWallM};
  plate.pieces = std::span(pieces_).first(kPiecesCount);
  Thing& cup = things_[static_cast<std::size_t>(ThingKind::cup)];
  cup.shape = contact::Shape::cylinder(kCupRadiusM, kCupHeightM / 2);
  cup.material = material_from_name("glass");
  cup.build = {kCupWallM, kCupRadiusM,
               contact::kPi * kCupRadiusM * (2 * kCupHeightM + kCupRadiusM) * kCupWallM};
  cup.pieces = std::span(pieces_).subspan(kPiecesCount, kPiecesCount);
  return {};
}

}  // namespace tactus::interact
