// Scenes given by an exact distance, presented as a map would: known only in a band around the surface.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "pipeline/contact/world.hpp"

namespace tactus::test {

/// What a map knows of a scene: nothing beyond the truncation band (free blocks are never allocated; behind
/// the surface the camera has not seen), and inside it the distance with its gradient.
template <typename Distance>
class AnalyticField {
 public:
  explicit AnalyticField(Distance distance, MaterialId material = material_from_name("wood"))
      : distance_(std::move(distance)) {
    set_material(material);
  }

  void set_material(MaterialId material) {
    materials_ = {};
    labelled_ = material != kUnknownMaterial;
    if (labelled_) materials_[material] = 1;
  }
  void set_materials(const MaterialDistribution& materials) {
    materials_ = materials;
    labelled_ = true;
  }
  /// Nothing is known where this is false.
  void set_seen(bool (*seen)(const Vec3d&)) { seen_ = seen; }
  void set_solid(bool solid) { solid_ = solid; }
  /// Everything has been seen to be free.
  void set_empty(bool empty) { empty_ = empty; }

  [[nodiscard]] contact::DistanceField field() const {
    contact::DistanceField f;
    f.context = this;
    f.truncation_m = kTruncationM;
    f.sample_fn = [](const void* self, const Vec3f& p, map::DistanceSample& out) noexcept {
      return static_cast<const AnalyticField*>(self)->sample(p.cast<double>(), out);
    };
    f.materials_fn = [](const void* self, const Vec3f&, MaterialDistribution& out) noexcept {
      const auto* scene = static_cast<const AnalyticField*>(self);
      out = scene->materials_;
      return scene->labelled_;
    };
    return f;
  }

  static constexpr float kTruncationM = 0.04F;

 private:
  bool sample(const Vec3d& p, map::DistanceSample& out) const {
    if (!solid_ || (seen_ != nullptr && !seen_(p))) return false;
    const double truncation = static_cast<double>(kTruncationM);
    const double d = empty_ ? truncation : distance_(p);
    if (d > truncation || d < -truncation) return false;
    constexpr double h = 1e-5;
    const Vec3d g{distance_(p + Vec3d{h, 0, 0}) - distance_(p - Vec3d{h, 0, 0}),
                  distance_(p + Vec3d{0, h, 0}) - distance_(p - Vec3d{0, h, 0}),
                  distance_(p + Vec3d{0, 0, h}) - distance_(p - Vec3d{0, 0, h})};
    out.distance_m = static_cast<float>(d);
    out.gradient = g.normalized().cast<float>();
    return true;
  }

  Distance distance_;
  MaterialDistribution materials_{};
  bool labelled_ = true;
  bool solid_ = true;
  bool empty_ = false;
  bool (*seen_)(const Vec3d&) = nullptr;
};

/// The half space below y = 0.
inline auto floor_scene(MaterialId material = material_from_name("wood")) {
  return AnalyticField([](const Vec3d& p) { return p.y; }, material);
}

/// A body of the reference: elastic, rigid, so that a surface shows its own table values against it.
inline contact::ContactProperties reference_properties(double friction = 1) {
  return {.restitution = 1,
          .static_friction = friction,
          .kinetic_friction = friction,
          .rolling_resistance = 0,
          .youngs_modulus_pa = 1e18,
          .compliance_m_per_n = 0,
          .density_kg_per_m3 = 1000,
          .roughness_m = 0};
}

/// A bound World with its memory and a list for events.
class BoundWorld {
 public:
  explicit BoundWorld(const contact::DistanceField& field, const contact::WorldConfig& config = {},
                      const contact::MaterialTable& table = contact::default_material_table())
      : bytes_(contact::World::bytes_needed(config)),
        memory_(static_cast<std::byte*>(::operator new (bytes_, std::align_val_t{64}))) {
    const auto bound = world.bind(rt::Slice(std::span(memory_.get(), bytes_)), config, field, table);
    TACTUS_ASSERT(bound.has_value());
    sink.events = events;
  }

  contact::BodyId spawn(const contact::BodySpec& spec) {
    contact::BodyId id;
    TACTUS_ASSERT(world.spawn(spec, id) == rt::Status::ok);
    return id;
  }
  void run(double seconds) {
    const int steps = static_cast<int>(seconds * contact::kStepsPerSecond + 0.5);
    for (int i = 0; i < steps; ++i) run_step();
  }
  void run_step() {
    // Whole nanoseconds that always make exactly one step.
    const std::int64_t next_ns =
        (++steps_ * 1'000'000'000 + contact::kStepsPerSecond - 1) / contact::kStepsPerSecond;
    const std::int64_t duration_ns = next_ns - elapsed_ns_;
    elapsed_ns_ = next_ns;
    TACTUS_ASSERT(world.step({duration_ns}, sink) == rt::Status::ok);
  }
  [[nodiscard]] const contact::BodyState* find(contact::BodyId id) const {
    for (const auto& state : world.bodies())
      if (state.id == id) return &state;
    return nullptr;
  }

 private:
  struct Free {
    void operator()(std::byte* p) const { ::operator delete (p, std::align_val_t{64}); }
  };
  std::size_t bytes_;
  std::unique_ptr<std::byte, Free> memory_;
  std::int64_t steps_ = 0, elapsed_ns_ = 0;
  contact::ContactEvent events[4096];

 public:
  contact::World world;  // declared last: closed before its memory goes
  contact::ContactSink sink;
};

}  // namespace tactus::test
