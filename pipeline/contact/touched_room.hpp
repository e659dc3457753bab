// The room as virtual things feel it: the live map, seen through one of the paper's three conditions (section V-B).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "pipeline/contact/depth_field.hpp"
#include "pipeline/contact/map_field.hpp"

namespace tactus::contact {

/// none: nothing real stops a thing. uniform: everything real is of one material ("other"). semantic: each surface acts by
/// its posterior.
enum class Collision : std::uint8_t { none, uniform, semantic };
inline constexpr std::array<std::string_view, 3> kCollisionNames = {"none", "uniform", "semantic"};

/// Holds the condition, which may change at any time between steps, and the newest depth frame, which answers where the
/// map does not know yet. Thread-bound; neither copied nor moved once field() was called.
class TouchedRoom {
 public:
  TouchedRoom() = default;
  TouchedRoom(const TouchedRoom&) = delete;
  TouchedRoom& operator=(const TouchedRoom&) = delete;

  /// Boot. `reader` outlives the room.
  void bind(const map::Reader& reader, Collision collision) {
    map_ = field_of(reader);
    backed_ = DepthBackedField(map_, depth_);
    inner_ = backed_.field();
    collision_ = collision;
  }
  void set_collision(Collision collision) noexcept { collision_ = collision; }
  [[nodiscard]] Collision collision() const noexcept { return collision_; }
  /// The frame's memory must stay until the next call.
  void set_depth(const DepthView& view) noexcept { depth_ = view; }

  /// What a person sees and aims at, whatever the condition: the same throw is the same in all three.
  [[nodiscard]] DistanceField seen() const noexcept { return inner_; }
  /// What stops things and is struck by them.
  [[nodiscard]] DistanceField field() const noexcept {
    DistanceField field = inner_;
    field.context = this;
    field.sample_fn = [](const void* self, const Vec3f& p, map::DistanceSample& out) noexcept {
      const TouchedRoom& room = *static_cast<const TouchedRoom*>(self);
      return room.collision_ != Collision::none && room.inner_.sample(p.cast<double>(), out);
    };
    field.distances_fn = [](const void* self, std::span<const Vec3f> points, std::span<float> out) noexcept {
      const TouchedRoom& room = *static_cast<const TouchedRoom*>(self);
      if (room.collision_ == Collision::none)
        std::fill(out.begin(), out.end(), map::kUnknownDistanceM);
      else
        room.inner_.distances(points, out);
    };
    field.materials_fn = [](const void* self, const Vec3f& p, MaterialDistribution& out) noexcept {
      const TouchedRoom& room = *static_cast<const TouchedRoom*>(self);
      return room.collision_ == Collision::semantic && room.inner_.materials(p.cast<double>(), out);
    };
    field.raycast_fn = [](const void* self, const Vec3f& origin, const Vec3f& direction, float range_m,
                          map::SurfacePoint& out) noexcept {
      const TouchedRoom& room = *static_cast<const TouchedRoom*>(self);
      if (room.collision_ == Collision::none ||
          !room.inner_.raycast(origin.cast<double>(), direction.cast<double>(), static_cast<double>(range_m), out))
        return false;
      if (room.collision_ == Collision::uniform) out.material = kUnknownMaterial;
      return true;
    };
    return field;
  }

 private:
  DistanceField map_;
  DepthView depth_;
  DepthBackedField backed_;
  DistanceField inner_;
  Collision collision_ = Collision::semantic;
};

}  // namespace tactus::contact
