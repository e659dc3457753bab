// The room as a walker meets it: what is real, and the virtual things that lie in it.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "pipeline/contact/distance_field.hpp"
#include "pipeline/contact/world.hpp"

namespace tactus::interact {

/// A room with a few solids more, as one distance field. A walker so goes around a ball that lies on the
/// floor and steps onto a plate. Thread-bound; neither copied nor moved once field() was called.
class Surroundings {
 public:
  Surroundings() = default;
  Surroundings(const Surroundings&) = delete;
  Surroundings& operator=(const Surroundings&) = delete;

  static constexpr std::size_t kSolidsMax = 8;
  static constexpr double kReachM = 1;  // solids farther away are left out

  /// Boot. The room's context outlives this.
  void bind(const contact::DistanceField& room) { room_ = room; }
  /// Forgets the solids; those to come are near this place. Step, as all below; wait-free.
  void clear(const Vec3d& middle_world_m) noexcept;
  /// Adds a solid; of more than kSolidsMax the nearest to the middle stay. Hulls, which are shards and chips,
  /// and what moves faster than kMovingMPerS are left out: the first are trodden on, the second are gone when
  /// one comes there.
  void add(const contact::BodyState& body) noexcept;
  void add(const contact::Shape& shape, const Vec3d& center_world_m, const Quaternion& q_world_body) noexcept;

  /// Solids have no material. Any phase.
  [[nodiscard]] contact::DistanceField field() const noexcept;

  static constexpr double kMovingMPerS = 0.2;

 private:
  struct Solid {
    contact::Shape shape;
    Vec3d center_world_m;
    Rotation R_world_body;
    double reach_m = 0, away_m = 0;
  };
  [[nodiscard]] double distance_to_solids(const Vec3d& p_world_m, double range_m,
                                          const Solid** nearest) const noexcept;
  bool sample(const Vec3d& p_world_m, map::DistanceSample& out) const noexcept;
  bool raycast(const Vec3d& origin_world_m, const Vec3d& direction_world, double range_m,
               map::SurfacePoint& out) const noexcept;

  contact::DistanceField room_;
  Vec3d middle_world_m_;
  std::array<Solid, kSolidsMax> solids_{};
  std::size_t count_ = 0;
};

}  // namespace tactus::interact
