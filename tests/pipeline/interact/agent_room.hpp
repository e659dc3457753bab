// Rooms made of boxes with exact distances and chosen floors, seen as a map would answer; and an agent with
// its memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <new>
#include <vector>

#include "pipeline/interact/agent.hpp"

namespace tactus::test {

inline MaterialDistribution only(const char* material) {
  MaterialDistribution d{};
  d[material_from_name(material)] = 1;
  return d;
}
inline MaterialDistribution mixed(const char* a, float share, const char* b) {
  MaterialDistribution d{};
  d[material_from_name(a)] = share;
  d[material_from_name(b)] = 1 - share;
  return d;
}

/// Solids are boxes; the floor is the plane y = 0. Rays and samples answer as map::Reader's: in front of a
/// surface up to the truncation distance, 4 cm behind it as inside, nothing where `is_seen` is false.
class BoxRoom {
 public:
  struct Solid {
    Vec3d low_m, high_m;
    MaterialDistribution materials = only("wood");
  };
  struct Patch {  // of the floor; the last one that covers a point counts
    double low_x_m, low_z_m, high_x_m, high_z_m;
    MaterialDistribution materials;
  };
  std::vector<Solid> solids;
  std::vector<Patch> patches;
  MaterialDistribution floor = only("carpet");
  bool is_labelled = true;
  std::function<bool(const Vec3d&)> is_seen = [](const Vec3d&) { return true; };

  [[nodiscard]] double distance(const Vec3d& p) const {
    double d = p.y;
    for (const Solid& s : solids) d = std::min(d, distance_to(s, p));
    return d;
  }
  /// Four walls 1 m high around the inside of this rectangle.
  void enclose(double low_x_m, double low_z_m, double high_x_m, double high_z_m) {
    const double t = 0.1;
    solids.push_back({{low_x_m - t, 0, low_z_m - t}, {low_x_m, 1, high_z_m + t}});
    solids.push_back({{high_x_m, 0, low_z_m - t}, {high_x_m + t, 1, high_z_m + t}});
    solids.push_back({{low_x_m - t, 0, low_z_m - t}, {high_x_m + t, 1, low_z_m}});
    solids.push_back({{low_x_m - t, 0, high_z_m}, {high_x_m + t, 1, high_z_m + t}});
  }

  [[nodiscard]] contact::DistanceField scene() const {
    contact::DistanceField scene;
    scene.context = this;
    scene.raycast_fn = [](const void* self, const Vec3f& origin, const Vec3f& direction, float range_m,
                          map::SurfacePoint& out) noexcept {
      return static_cast<const BoxRoom*>(self)->raycast(
          origin.cast<double>(), direction.cast<double>().normalized(), static_cast<double>(range_m), out);
    };
    scene.sample_fn = [](const void* self, const Vec3f& p, map::DistanceSample& out) noexcept {
      return static_cast<const BoxRoom*>(self)->sample(p.cast<double>(), out);
    };
    scene.materials_fn = [](const void* self, const Vec3f& p, MaterialDistribution& out) noexcept {
      const auto& room = *static_cast<const BoxRoom*>(self);
      out = room.materials(p.cast<double>());
      return room.is_labelled;
    };
    return scene;
  }

 private:
  static constexpr double kTruncationM = 0.04;

  static double distance_to(const Solid& s, const Vec3d& p) {
    const Vec3d center = (s.low_m + s.high_m) * 0.5, half = (s.high_m - s.low_m) * 0.5;
    const Vec3d q{std::abs(p.x - center.x) - half.x, std::abs(p.y - center.y) - half.y,
                  std::abs(p.z - center.z) - half.z};
    const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return outside.norm() + std::min(std::max({q.x, q.y, q.z}), 0.0);
  }
  [[nodiscard]] Vec3d gradient(const Vec3d& p) const {
    constexpr double h = 1e-5;
    return Vec3d{distance(p + Vec3d{h, 0, 0}) - distance(p - Vec3d{h, 0, 0}),
                 distance(p + Vec3d{0, h, 0}) - distance(p - Vec3d{0, h, 0}),
                 distance(p + Vec3d{0, 0, h}) - distance(p - Vec3d{0, 0, h})}
        .normalized();
  }
  bool sample(const Vec3d& p, map::DistanceSample& out) const {
    const double d = distance(p);
    if (d > kTruncationM || d < -kTruncationM || !is_seen(p)) return false;
    out.distance_m = static_cast<float>(d);
    out.gradient = gradient(p).cast<float>();
    return true;
  }
  bool raycast(const Vec3d& origin, const Vec3d& direction, double range_m, map::SurfacePoint& out) const {
    double s = 0;
    for (int i = 0; i < 200 && s <= range_m; ++i) {
      const Vec3d p = origin + direction * s;
      const double d = distance(p);
      if (d < -1e-6) return false;
      if (d > 1e-6) {
        s += d;
        continue;
      }
      if (!is_seen(p)) return false;
      out.position_world_m = p.cast<float>();
      out.normal_world = gradient(p).cast<float>();
      out.materials = materials(p);
      out.material = kUnknownMaterial;
      if (is_labelled)
        out.material = static_cast<MaterialId>(std::max_element(out.materials.begin(), out.materials.end()) -
                                               out.materials.begin());
      return true;
    }
    return false;
  }
  [[nodiscard]] MaterialDistribution materials(const Vec3d& p) const {
    for (const Solid& s : solids)
      if (distance_to(s, p) < 1e-5) return s.materials;
    MaterialDistribution found = floor;
    for (const Patch& patch : patches)
      if (p.x >= patch.low_x_m && p.x < patch.high_x_m && p.z >= patch.low_z_m && p.z < patch.high_z_m)
        found = patch.materials;
    return found;
  }
};

/// An agent with its memory, stepped at 30 Hz.
class BoundAgent {
 public:
  explicit BoundAgent(const contact::DistanceField& scene, const interact::AgentConfig& config = {})
      : bytes_(interact::Agent::bytes_needed()),
        memory_(static_cast<std::byte*>(::operator new (bytes_, std::align_val_t{64}))) {
    rt::Slice slice(std::span(memory_.get(), bytes_));
    agent.bind(slice, scene, {0, -9.81, 0}, config);
    bytes_left = slice.bytes_left();
  }
  rt::Status step() { return agent.step({33'333'333}); }
  /// After each step calls `each(pose)`.
  template <typename Each>
  void run(double seconds, const Each& each) {
    for (int i = 0; i < static_cast<int>(seconds * 30 + 0.5); ++i) {
      (void)step();
      each(agent.pose());
    }
  }
  void run(double seconds) {
    run(seconds, [](const interact::AgentPose&) {});
  }
  /// Until it arrives; false when that takes longer.
  template <typename Each>
  bool walk(double seconds_max, const Each& each) {
    for (int i = 0; i < static_cast<int>(seconds_max * 30 + 0.5); ++i) {
      (void)step();
      each(agent.pose());
      if (agent.state() == interact::AgentState::arrived) return true;
    }
    return false;
  }
  bool walk(double seconds_max) {
    return walk(seconds_max, [](const interact::AgentPose&) {});
  }

 private:
  struct Free {
    void operator()(std::byte* p) const { ::operator delete (p, std::align_val_t{64}); }
  };
  std::size_t bytes_;
  std::unique_ptr<std::byte, Free> memory_;

 public:
  interact::Agent agent;
  std::size_t bytes_left = 0;
};

}  // namespace tactus::test
