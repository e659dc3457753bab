// Points of a surface that touch a field, and the few of them that hold a body.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "pipeline/contact/field_contacts.hpp"

namespace tactus::contact {

struct Candidates {
  static constexpr std::size_t kMax = 96;

  std::array<FieldContact, kMax> items;
  std::array<std::uint8_t, kMax> group{};
  std::size_t count = 0;
  bool touches = false;  // one of them is closer than kContactMarginM
};

/// Adds the shape's points (surface_points.hpp, `spacing_m`) that are closer than `margin_m` to the field and
/// that it pushes towards the shape's centre. `memory` as in field_contacts(). Step phase; wait-free.
void collect(const DistanceField& field, const Shape& shape, const Vec3d& center_world_m,
             const Rotation& R_world_body, double spacing_m, double margin_m, Candidates& candidates,
             PointMemory* memory = nullptr) noexcept;

/// Groups the candidates by normal, seeded by the first member: three are enough for a box in a corner; what
/// else there is joins the last. Four points of a single face hold a body; of three faces the one that
/// carries it (nearest to `up_world`) keeps four and each of the others two. The number written; 0 when none
/// touches. Step phase; wait-free.
int reduce(Candidates& candidates, const Vec3d& up_world,
           std::span<FieldContact, kFieldContactsMax> out) noexcept;

}  // namespace tactus::contact
