// The contact stage: virtual bodies fall, bounce, slide and rest on the real surfaces.
//
//   inputs    the distance field of the live map, bodies to spawn, a duration
//   outputs   ContactEvents (impacts) and BodyStates
//   budget    1/120 s fixed steps; 50 bodies at rest or bouncing cost about 0.1-0.3 ms a step (tests/bench)
//   memory    one planned slice: own tables and ODE's fenced heap; no heap call after bind
//   late      at most steps_max_per_call steps a call; the surplus of time is dropped and counted, never
//   caught up full      a spawn answers Status::full and is counted; contacts beyond the plan are dropped and
//   counted lost      bodies that leave the world (50 m from the origin) or stop being finite are removed and
//   counted
//
// Physics: ODE's QuickStep. Between contacts a body follows the exact parabola (ODE's symplectic Euler step
// is corrected by -g h^2 / 2), and each step's path is swept against the field: a body stops where it first
// touches, keeps the velocity it had there, and bounces from that place in the next step. So rebounds follow
// the table at any speed and nothing passes through a wall, at the price of the rest of that one step (< 8.4
// ms). Results are the same bits for the same inputs from run to run on one machine. Debian's libode is
// compiled by others for each architecture and may differ in rounding between them; contacts do not feed the
// map, so map_hash is safe.
//
// Body against body: ODE 0.16.2 with libccd has a collider for every pair of the five shapes, and none of them
// calls the heap, but those with a hull, and capsule with cylinder, give one point, on which a body rocks for
// ever, and box with capsule gave points that kept it rocking. So ODE serves spheres and two boxes, and
// pair_contacts.hpp the rest. Bodies are not swept against each other.
#pragma once

#include <cstdint>
#include <span>

#include "pipeline/contact/contact_law.hpp"
#include "pipeline/contact/distance_field.hpp"
#include "pipeline/contact/ode_memory.hpp"
#include "pipeline/contact/point_memory.hpp"
#include "pipeline/contact/shape.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

struct dxWorld;
struct dxSpace;
struct dxJointGroup;
struct dxGeom;
struct dxBody;
struct dJointFeedback;

namespace tactus::contact {

inline constexpr std::int64_t kStepsPerSecond = 120;
inline constexpr double kStepS = 1.0 / 120.0;

/// Slot and generation: an id of a removed body names nothing, even after its slot is used again. Generation
/// 0: no body.
struct BodyId {
  std::uint16_t index = 0;
  std::uint16_t generation = 0;
  friend constexpr bool operator==(BodyId, BodyId) = default;
  [[nodiscard]] constexpr bool is_body() const { return generation != 0; }
};

struct BodySpec {
  Shape shape;
  MaterialId material = material_from_name("plastic");
  Vec3d position_world_m;
  Quaternion q_world_body;
  Vec3d velocity_world_m_per_s;
  Vec3d angular_velocity_world_rad_per_s;
  double mass_kg = 0;                             // 0: volume times the material's density
  const ContactProperties* properties = nullptr;  // null: the material's; else copied at spawn
  bool is_debris = false;                         // chips, shards: pass through each other, cheap in numbers
};

struct BodyState {
  BodyId id;
  Shape shape;
  MaterialId material = kUnknownMaterial;
  Vec3d position_world_m;  // centre of mass
  Quaternion q_world_body;
  Vec3d velocity_world_m_per_s;
  Vec3d angular_velocity_world_rad_per_s;
  double mass_kg = 0;
  bool resting = false;  // asleep: costs nothing until something touches it or its support is seen to be gone
};

/// One impact of one body, summed over its contact points of that step.
struct ContactEvent {
  rt::Duration time;  // simulated time since bind, end of the step of the impact
  BodyId body;
  BodyId other;                            // no body: a real surface
  Vec3d position_world_m;                  // deepest contact point
  Vec3d normal_world;                      // towards `body`
  double impulse_n_s = 0;                  // along the normal
  double impact_speed_m_per_s = 0;         // approach along the normal
  MaterialId material = kUnknownMaterial;  // of the surface (most likely one) or of the other body
  MaterialId body_material = kUnknownMaterial;
};

/// Caller's bounded list of events; what does not fit is counted.
struct ContactSink {
  std::span<ContactEvent> events;
  std::size_t count = 0;
  std::uint64_t dropped = 0;

  void push(const ContactEvent& event) noexcept {
    if (count < events.size())
      events[count++] = event;
    else
      ++dropped;
  }
};

struct WorldConfig {
  std::size_t bodies_capacity = 64;
  std::size_t contacts_capacity =
      384;                     // contact points a step: 6 a body; a box on a floor has 4, in a corner 8
  int steps_max_per_call = 8;  // 67 ms: two frames at 30 Hz; a longer pause is not caught up
  Vec3d gravity_world_m_per_s2{0, -9.81, 0};
};

struct WorldCounters {
  std::uint64_t steps = 0;
  std::uint64_t steps_dropped = 0;  // late: time that was not simulated
  std::uint64_t spawned = 0;
  std::uint64_t spawns_refused = 0;  // pool full
  std::uint64_t bodies_lost = 0;     // left the world or stopped being finite
  std::uint64_t contacts = 0;
  std::uint64_t contacts_dropped = 0;  // beyond contacts_capacity
  std::uint64_t sweeps_stopped = 0;    // paths that ended at a surface
  std::uint64_t steps_failed = 0;      // the solver had no work memory; bodies kept their state
  std::size_t bodies_max = 0;          // high-water
  std::size_t contacts_max = 0;
};

/// The simulated bodies. One thread calls spawn, remove, step and reads states. ODE's allocator belongs to
/// the process, so one World is bound at a time: a second bind() asserts. Not copyable, not movable.
class World {
 public:
  World() = default;
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World();

  /// Bytes of the slice that bind() takes. Any phase.
  static std::size_t bytes_needed(const WorldConfig& config);

  /// Boot. The field's context must outlive the World; the table is copied. Runs the worst case once (every
  /// body and every contact in one island), so that a plan that is too small fails here and every page has
  /// been touched. Errors: bad_usage with the limit that a capacity exceeds.
  rt::Result<void> bind(rt::Slice slice, const WorldConfig& config, const DistanceField& field,
                        const MaterialTable& materials);

  /// Step phase, wait-free. ok | full (counted) | unsupported (a spec that is not finite or has no size;
  /// counted as refused).
  rt::Status spawn(const BodySpec& spec, BodyId& id) noexcept;
  /// Step phase. What it may have carried wakes up. ok | stale (no such body any more).
  rt::Status remove(BodyId id) noexcept;

  /// Step phase: gives the body an impulse at a place, at once. ok | stale | unsupported (not finite).
  rt::Status push(BodyId id, const Vec3d& impulse_n_s, const Vec3d& position_world_m) noexcept;

  /// Advances simulated time by `duration` in fixed steps; what does not fill a step waits for the next call.
  /// Impacts go to `sink`. ok | late (time was dropped) | full (work memory; counted). Step phase, no heap,
  /// no lock, bounded.
  rt::Status step(rt::Duration duration, ContactSink& sink) noexcept;

  /// Changes gravity from the next step on and wakes every body. Step phase.
  void set_gravity(const Vec3d& gravity_world_m_per_s2) noexcept;
  /// Step phase: after the map has jumped (relocalisation, loaded map), sleepers look for their support
  /// again.
  void wake_all() noexcept;

  /// Living bodies in slot order, as of the last step or spawn. Valid until the next call that changes the
  /// world.
  [[nodiscard]] std::span<const BodyState> bodies() const { return states_.first(states_count_); }
  [[nodiscard]] const WorldCounters& counters() const { return counters_; }
  [[nodiscard]] const OdeMemoryUse& memory_use() const { return pool_.use(); }
  [[nodiscard]] rt::Duration time() const { return {step_index_ * 1'000'000'000 / kStepsPerSecond}; }

 private:
  struct Slot {
    dxBody* body = nullptr;
    dxGeom* geom = nullptr;
    std::uint16_t generation = 0;
    std::uint16_t calm_steps = 0;
    std::uint16_t held_steps = 0;  // in a row that its path was stopped where it began
    bool touching = false;  // had a contact in the last step
    bool on_field = false;  // one of them with a real surface
    bool in_group = false;  // scratch of sleep_calm_groups()
    Shape shape;
    MaterialId material = kUnknownMaterial;
    ContactProperties properties;
    double mass_kg = 0;
    Vec3d position_before_m;
    // Deepest contact with a real surface, the last there was, and its normal towards the body.
    Vec3d support_world_m, support_normal_world;
    double support_depth_m = 0;
  };
  /// The contact points of one pair in one step, kept when it may be an impact.
  struct Manifold {
    std::uint16_t body = 0, other = 0;  // slot; other == kNoSlot for the field
    std::uint32_t first_feedback = 0, count = 0;
    Vec3d position_world_m, normal_world;
    double impact_speed = 0, least_speed = 0;  // greatest and least approach of its points
    MaterialId material = kUnknownMaterial;
  };
  static constexpr std::uint16_t kNoSlot = 0xffff;

  static void near_pair(void* self, dxGeom* a, dxGeom* b);
  void collide_pair(dxGeom* a, dxGeom* b) noexcept;
  bool fixed_step(ContactSink& sink) noexcept;
  void emit_events(ContactSink& sink) noexcept;
  void fly_on_after_bounce(const Slot& slot, const Vec3d& normal) noexcept;
  bool ease_out(const Slot& slot) noexcept;
  void settle_body(Slot& slot) noexcept;
  void sweep(Slot& slot, bool free_flight) noexcept;
  void check_one_sleeper() noexcept;
  void wake_neighbors() noexcept;
  void sleep_calm_groups() noexcept;
  void destroy(Slot& slot) noexcept;
  void publish() noexcept;
  bool prove_plan() noexcept;

  WorldConfig config_;
  DistanceField field_;
  MaterialTable materials_;
  OdePool pool_;
  dxWorld* world_ = nullptr;
  dxSpace* space_ = nullptr;
  dxJointGroup* joints_ = nullptr;
  dxGeom* field_geom_ = nullptr;
  std::span<Slot> slots_;
  std::span<BodyState> states_;
  dJointFeedback* feedbacks_ = nullptr;  // contacts_capacity of them
  std::span<PointMemory> memories_;      // one a slot
  std::span<Vec3d> feedback_normals_;
  std::span<Manifold> manifolds_;
  std::span<std::uint16_t> work_list_;
  std::span<dxGeom*> spare_hull_geoms_;  // one a slot
  std::size_t states_count_ = 0;
  std::size_t contacts_count_ = 0;
  std::size_t feedbacks_count_ = 0;
  std::size_t manifolds_count_ = 0;
  std::size_t sleeper_next_ = 0;
  std::int64_t elapsed_ns_ = 0;
  std::int64_t step_index_ = 0;
  WorldCounters counters_;
};

}  // namespace tactus::contact
