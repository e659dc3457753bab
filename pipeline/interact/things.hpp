// What can be thrown besides plain shapes: plates and drinking glasses with the pieces they break into, and the chips that
// fly off real surfaces. Cut once, at boot.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "pipeline/contact/fracture.hpp"
#include "pipeline/contact/shape.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::interact {

enum class ThingKind : std::uint8_t { plain, plate, cup };
inline constexpr std::size_t kThingsCount = 3;
inline constexpr std::array<std::string_view, kThingsCount> kThingNames = {"plain", "plate", "cup"};

/// A part of a thing, about its own centre of mass.
struct Piece {
  const contact::ConvexHull* hull = nullptr;
  Vec3d offset_m;  // of its centre of mass, in the thing's frame
};

struct Thing {
  contact::Shape shape;
  MaterialId material = kUnknownMaterial;
  contact::Build build;             // no walls: it does not break
  std::span<const Piece> pieces;    // together the thing, 12 each
};

/// All hulls lie side by side, so that a body's hull has a number that the renderer knows it by.
class ThingCatalogue {
 public:
  static constexpr std::size_t kPiecesCount = 12;  // of a plate: 4 inside, 8 around; of a cup: 10 staves, 2 halves of its foot
  static constexpr std::size_t kChipShapesCount = 5;  // one for each BreakPattern
  static constexpr std::size_t kHullsCount = 2 * kPiecesCount + kChipShapesCount;

  static std::size_t bytes_needed();
  /// Boot. `failed` when a hull cannot be made: a bug of the table in things.cpp.
  rt::Result<void> bind(rt::Slice& slice);

  /// Any phase. `plain` has no shape of its own and does not break.
  [[nodiscard]] const Thing& of(ThingKind kind) const { return things_[static_cast<std::size_t>(kind)]; }
  /// Chips are all of one size a pattern.
  [[nodiscard]] const contact::ConvexHull& chip(contact::BreakPattern pattern) const {
    return hulls_[2 * kPiecesCount + static_cast<std::size_t>(pattern)];
  }
  [[nodiscard]] std::span<const contact::ConvexHull> hulls() const { return hulls_; }
  [[nodiscard]] std::size_t index_of(const contact::ConvexHull& hull) const {
    return static_cast<std::size_t>(&hull - hulls_.data());
  }

 private:
  rt::Result<void> cut(std::size_t hull, std::span<const Vec3d> points, Vec3d& center_m);

  std::span<contact::ConvexHull> hulls_;
  std::array<Piece, 2 * kPiecesCount> pieces_{};
  std::array<Thing, kThingsCount> things_{};
};

}  // namespace tactus::interact
