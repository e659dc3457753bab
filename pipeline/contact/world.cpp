#include "pipeline/contact/world.hpp"

#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "pipeline/contact/body_geom.hpp"
#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/field_geom.hpp"
#include "pipeline/contact/pair_contacts.hpp"

namespace tactus::contact {
namespace {

// Over-relaxed by more than ODE's 1.3. On the map of a real kitchen nine in ten bodies that are woken every second stay
// within 1 mm in 10 s; 16 and 18 iterations save 10 us a step and let them creep 1.2 and 1.6 mm.
constexpr int kSolverIterations = 20;
constexpr double kOverRelaxation = 1.4;
/// Slower impacts do not bounce and make no event. Above what gravity adds in one step (0.082 m/s), so that a
/// body at rest never bounces on its own weight.
constexpr double kBounceSpeed = 0.15;
constexpr double kSlipSpeed = 0.02;  // faster contact points slide: kinetic friction, along their motion
constexpr double kErp = 0.2;
constexpr double kPushOutSpeedMax = 1.0;  // m/s: a body that the map grows over is eased out, not shot
constexpr double kSinkMaxM = 0.008;
constexpr double kSweepLeastM = 0.002;
constexpr double kHeldM = 0.0001;
constexpr double kCalmSpeed = 0.02;       // of any point of the body
constexpr std::uint16_t kCalmSteps = 30;  // a quarter of a second
constexpr double kShiftM = 0.002;         // of a surface under a sleeper, that wakes it: a fifth of a voxel
constexpr double kWorldRadiusM = 50;
constexpr int kPairContactsMax = 8;
static_assert(kFieldContactsMax <= kPairContactsMax);

// What ODE 0.16.2 (double) takes on x86-64, by counting its calls: a body and its geom 944 bytes, its spare
// hull geom 384; contact
// joints 416 bytes from blocks of 16 KiB; solving one island 2184 bytes a contact point with 6 rows, its
// share of bodies included; the list of islands 12 bytes a joint and body. bind() proves the sum by running
// the worst case.
constexpr std::size_t kOdeBaseBytes = 64 * 1024;
constexpr std::size_t kOdeBodyBytes = 1024 + 512;
constexpr std::size_t kOdeJointBytes = 448;
constexpr std::size_t kOdeJointBlockBytes = 16 * 1024;
constexpr std::size_t kWorkBodyBytes = 512;
constexpr std::size_t kWorkContactBytes = 2208;
constexpr std::size_t kIslandBytes = 16;

std::size_t pool_bytes(const WorldConfig& config) {
  const std::size_t bodies = config.bodies_capacity;
  const std::size_t contacts = config.contacts_capacity;
  const std::size_t joints =
      rt::round_up(contacts * kOdeJointBytes, kOdeJointBlockBytes) + 2 * kOdeJointBlockBytes;
  const std::size_t work =
      bodies * kWorkBodyBytes + contacts * kWorkContactBytes + (bodies + contacts) * kIslandBytes;
  // A block is rounded up by at most an eighth (OdePool).
  return kOdeBaseBytes + bodies * kOdeBodyBytes + joints + work + work / 8;
}

// ODE's step memory may be refused (the step then answers false), so it is asked of the pool directly and not
// through ode_allocate. The size stands in front of the block because ODE may shrink what it believes to
// hold.
OdePool* work_pool = nullptr;
constexpr std::size_t kWorkHeaderBytes = 64;

void* work_allocate(dsizeint bytes) {
  auto* block = static_cast<std::byte*>(work_pool->allocate(bytes + kWorkHeaderBytes));
  if (block == nullptr) return nullptr;
  const std::size_t held = bytes + kWorkHeaderBytes;
  std::memcpy(block, &held, sizeof held);
  return block + kWorkHeaderBytes;
}

void* work_shrink(void* block, dsizeint, dsizeint) { return block; }

void work_free(void* block, dsizeint) {
  auto* start = static_cast<std::byte*>(block) - kWorkHeaderBytes;
  std::size_t held = 0;
  std::memcpy(&held, start, sizeof held);
  work_pool->free(start, held);
}

Vec3d vec(const dReal* v) { return {v[0], v[1], v[2]}; }

Quaternion quaternion_of(dBodyID body) {
  const dReal* q = dBodyGetQuaternion(body);
  return {q[0], q[1], q[2], q[3]};
}

bool is_finite(const Vec3d& v) { return std::isfinite(v.x + v.y + v.z); }

std::uint16_t slot_of(dBodyID body, std::uint16_t none) {
  if (body == nullptr) return none;
  return static_cast<std::uint16_t>(reinterpret_cast<std::uintptr_t>(dBodyGetData(body)));
}

Vec3d velocity_at(dBodyID body, const Vec3d& p) {
  if (body == nullptr) return {};
  return vec(dBodyGetLinearVel(body)) + vec(dBodyGetAngularVel(body)).cross(p - vec(dBodyGetPosition(body)));
}

/// Categories of geoms: debris meets bodies and the field, not other debris.
constexpr unsigned long kFieldBits = 1, kBodyBits = 2, kDebrisBits = 4;

bool boxes_meet(dGeomID a, dGeomID b) {
  if ((dGeomGetCollideBits(a) & dGeomGetCategoryBits(b)) == 0 &&
      (dGeomGetCollideBits(b) & dGeomGetCategoryBits(a)) == 0)
    return false;
  dReal p[6], q[6];
  dGeomGetAABB(a, p);
  dGeomGetAABB(b, q);
  return p[0] <= q[1] && q[0] <= p[1] && p[2] <= q[3] && q[2] <= p[3] && p[4] <= q[5] && q[4] <= p[5];
}

bool is_awake(dBodyID body) { return body != nullptr && dBodyIsEnabled(body) != 0; }

/// One contact point as the solver needs it.
struct Touch {
  Vec3d normal;             // towards the body
  Vec3d relative_velocity;  // of the body's point against the other's
  Vec3d travel;             // velocity of the body's centre
  Vec3d gravity;
  double mass_kg = 1;
  int points_count = 1;         // of the same pair
  double rolling_radius_m = 0;  // 0: it does not roll
};

void set_surface(dContact& contact, const ContactLaw& law, const Touch& touch) {
  const auto& [normal, relative_velocity, travel, gravity, mass_kg, points_count, rolling_radius_m] = touch;
  const double approach = -relative_velocity.dot(normal);
  dSurfaceParameters& s = contact.surface;
  s.mode = dContactApprox1_1 | dContactApprox1_2 | dContactFDir1;

  if (approach > kBounceSpeed) {
    // An impact is rigid and follows the restitution; compliance on top would take its energy a second time.
    s.mode |= dContactBounce;
    s.bounce = law.restitution;
    s.bounce_vel = kBounceSpeed;
  } else {
    // At rest the surface is a spring of stiffness k = 1/compliance shared by the contact points, critically
    // damped, and damped more where that would take out more than kErp of the depth in a step: erp = h k / (h
    // k + d), cfm = 1 / (h k + d). A soft layer bottoms out before the body leaves the truncation band.
    const double give = std::min(law.compliance_m_per_n, kSinkMaxM / (mass_kg * gravity.norm() + 1e-9));
    const double stiffness = 1 / std::max(give, 1e-9) / points_count;
    const double damping =
        std::max(2 * std::sqrt(stiffness * mass_kg / points_count), kStepS * stiffness * (1 / kErp - 1));
    s.mode |= dContactSoftERP | dContactSoftCFM;
    s.soft_erp = kStepS * stiffness / (kStepS * stiffness + damping);
    s.soft_cfm = 1 / (kStepS * stiffness + damping);
  }

  // The friction pyramid is exact along its first axis: put it along the sliding, the rolling, or the pull of
  // gravity.
  const Vec3d slip = relative_velocity + normal * approach;
  const Vec3d roll = travel - normal * travel.dot(normal);
  const bool slides = slip.dot(slip) > kSlipSpeed * kSlipSpeed;
  const bool rolls = rolling_radius_m > 0 && roll.dot(roll) > kSlipSpeed * kSlipSpeed;
  s.mu = slides ? law.kinetic_friction : law.static_friction;
  Vec3d along = slides ? slip : rolls ? roll : gravity - normal * gravity.dot(normal);
  if (along.dot(along) < 1e-8)
    along = std::abs(normal.x) < 0.9 ? normal.cross({1, 0, 0}) : normal.cross({0, 1, 0});
  along = along.normalized();
  contact.fdir1[0] = along.x;
  contact.fdir1[1] = along.y;
  contact.fdir1[2] = along.z;

  if (rolling_radius_m > 0 && law.rolling_resistance > 0 && s.mu > 0 && approach <= kBounceSpeed) {
    s.mode |= dContactRolling | dContactApprox1_N;
    s.rho = law.rolling_resistance * rolling_radius_m;
  }
}

}  // namespace

std::size_t World::bytes_needed(const WorldConfig& config) {
  return rt::bytes_of<Slot>(config.bodies_capacity) + rt::bytes_of<PointMemory>(config.bodies_capacity) +
         rt::bytes_of<BodyState>(config.bodies_capacity) +
         rt::bytes_of<dJointFeedback>(config.contacts_capacity) +
         rt::bytes_of<Vec3d>(config.contacts_capacity) + rt::bytes_of<Manifold>(config.contacts_capacity) +
         rt::bytes_of<std::uint16_t>(config.bodies_capacity) + rt::bytes_of<dxGeom*>(config.bodies_capacity) +
         rt::bytes_of<std::byte>(pool_bytes(config));
}

rt::Result<void> World::bind(rt::Slice slice, const WorldConfig& config, const DistanceField& field,
                             const MaterialTable& materials) {
  TACTUS_ASSERT(world_ == nullptr);
  TACTUS_ASSERT(field.sample_fn != nullptr && field.materials_fn != nullptr && field.truncation_m > 0);
  if (config.bodies_capacity == 0 || config.bodies_capacity > 1024)
    return rt::Error{rt::ExitCode::bad_usage, "contact: bodies_capacity is " +
                                                  std::to_string(config.bodies_capacity) +
                                                  "; it must lie between 1 and 1024"};
  if (config.contacts_capacity < config.bodies_capacity || config.contacts_capacity > 65536)
    return rt::Error{rt::ExitCode::bad_usage, "contact: contacts_capacity is " +
                                                  std::to_string(config.contacts_capacity) +
                                                  "; it must lie between bodies_capacity and 65536"};
  if (config.steps_max_per_call < 1 || !is_finite(config.gravity_world_m_per_s2))
    return rt::Error{
        rt::ExitCode::bad_usage,
        "contact: steps_max_per_call must be at least 1 and gravity must be three finite numbers"};

  config_ = config;
  field_ = field;
  materials_ = materials;
  slots_ = slice.take<Slot>(config.bodies_capacity);
  states_ = slice.take<BodyState>(config.bodies_capacity);
  memories_ = slice.take<PointMemory>(config.bodies_capacity);
  feedbacks_ = slice.take<dJointFeedback>(config.contacts_capacity).data();
  feedback_normals_ = slice.take<Vec3d>(config.contacts_capacity);
  manifolds_ = slice.take<Manifold>(config.contacts_capacity);
  work_list_ = slice.take<std::uint16_t>(config.bodies_capacity);
  spare_hull_geoms_ = slice.take<dxGeom*>(config.bodies_capacity);
  pool_ = OdePool(slice, pool_bytes(config));

  start_ode(pool_);
  work_pool = &pool_;
  dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
  world_ = dWorldCreate();
  // 64 bodies make 2080 box tests, a few microseconds; ODE's hash space would allocate every step.
  space_ = dSimpleSpaceCreate(nullptr);
  joints_ = dJointGroupCreate(0);
  const Vec3d& g = config.gravity_world_m_per_s2;
  dWorldSetGravity(world_, g.x, g.y, g.z);
  dWorldSetQuickStepNumIterations(world_, kSolverIterations);
  dWorldSetQuickStepW(world_, kOverRelaxation);
  dWorldSetContactSurfaceLayer(world_, kContactMarginM);
  dWorldSetContactMaxCorrectingVel(world_, kPushOutSpeedMax);
  dWorldSetERP(world_, kErp);
  dWorldSetCFM(world_, 1e-9);
  // sleep_calm_groups() does it: ODE's own way averages over buffers that it takes from the heap, past
  // its handler.
  dWorldSetAutoDisableFlag(world_, 0);
  dWorldSetAutoDisableAverageSamplesCount(world_, 0);

  dWorldStepMemoryFunctionsInfo functions;
  functions.struct_size = sizeof functions;
  functions.alloc_block = work_allocate;
  functions.shrink_block = work_shrink;
  functions.free_block = work_free;
  dWorldStepReserveInfo reserve;
  reserve.struct_size = sizeof reserve;
  reserve.reserve_factor = 1;
  reserve.reserve_minimum = 4096;  // prove_plan() asks for the most that there will ever be, once
  if (dWorldSetStepMemoryManager(world_, &functions) == 0 ||
      dWorldSetStepMemoryReservationPolicy(world_, &reserve) == 0)
    return rt::Error{rt::ExitCode::failed,
                     "contact: ODE refused the step memory manager; is libode 0.16 installed?"};

  for (dxGeom*& geom : spare_hull_geoms_) geom = create_spare_hull_geom();
  if (!prove_plan())
    return rt::Error{rt::ExitCode::failed,
                     "contact: ODE needs more work memory than planned for this many bodies and contacts"};
  field_geom_ = create_field_geom(space_, field, memories_);
  dGeomSetCategoryBits(field_geom_, kFieldBits);
  return {};
}

World::~World() {
  if (world_ == nullptr) return;
  dJointGroupDestroy(joints_);
  for (Slot& slot : slots_)
    if (slot.body != nullptr) destroy(slot);
  for (dxGeom* geom : spare_hull_geoms_)
    if (geom != nullptr) dGeomDestroy(geom);
  if (field_geom_ != nullptr) dGeomDestroy(field_geom_);
  dSpaceDestroy(space_);
  dWorldDestroy(world_);
  stop_ode();
  work_pool = nullptr;
}

/// One step with every body and every contact, rolling, chained into a single island.
bool World::prove_plan() noexcept {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    BodySpec spec;
    spec.position_world_m = {0.2 * static_cast<double>(i % 64), 0.2 * static_cast<double>(i / 64), 0};
    if (i % 2 == 1) spec.shape = Shape::cylinder(0.05, 0.05);
    BodyId id;
    if (spawn(spec, id) != rt::Status::ok) return false;
  }
  const std::size_t pairs = std::max<std::size_t>(slots_.size() - 1, 1);
  for (std::size_t i = 0; i < config_.contacts_capacity; ++i) {
    dContact contact;
    std::memset(&contact, 0, sizeof contact);
    Touch touch;
    touch.normal = {0, 1, 0};
    touch.gravity = {0, -9.81, 0};
    touch.rolling_radius_m = 0.05;
    set_surface(contact, {0.5, 1, 1, 0.1, 1e-6}, touch);
    contact.geom.normal[1] = 1;
    const Slot& a = slots_[i % pairs];
    dBodyID other = slots_.size() > 1 ? slots_[i % pairs + 1].body : nullptr;
    dJointID joint = dJointCreateContact(world_, joints_, &contact);
    dJointAttach(joint, a.body, other);
    dJointSetFeedback(joint, &feedbacks_[i]);
  }
  dRandSetSeed(0);
  const bool ok = dWorldQuickStep(world_, kStepS) != 0;
  dJointGroupEmpty(joints_);
  for (Slot& slot : slots_) {
    destroy(slot);
    slot = {};
  }
  counters_ = {};
  publish();
  return ok;
}

rt::Status World::spawn(const BodySpec& spec, BodyId& id) noexcept {
  id = {};
  const Quaternion& q = spec.q_world_body;
  const double q_norm2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (!is_usable(spec.shape) || !is_finite(spec.position_world_m) ||
      !is_finite(spec.velocity_world_m_per_s) || !is_finite(spec.angular_velocity_world_rad_per_s) ||
      !(q_norm2 > 0.25 && q_norm2 < 4) || !(spec.mass_kg >= 0)) {
    ++counters_.spawns_refused;
    return rt::Status::unsupported;
  }
  const auto free_slot =
      std::find_if(slots_.begin(), slots_.end(), [](const Slot& s) { return s.body == nullptr; });
  if (free_slot == slots_.end()) {
    ++counters_.spawns_refused;
    return rt::Status::full;
  }
  Slot& slot = *free_slot;
  const auto index = static_cast<std::uint16_t>(free_slot - slots_.begin());
  const auto generation = static_cast<std::uint16_t>(slot.generation == 0xffff ? 1 : slot.generation + 1);
  slot = {};
  slot.generation = generation;
  memories_[index].count = 0;
  memories_[index].turn = index;
  slot.shape = spec.shape;
  slot.material = spec.material;
  slot.properties = spec.properties != nullptr ? *spec.properties : materials_.of(spec.material);
  slot.mass_kg = spec.mass_kg > 0 ? spec.mass_kg : volume_m3(spec.shape) * slot.properties.density_kg_per_m3;

  slot.body = dBodyCreate(world_);
  slot.geom = create_body_geom(space_, slot.shape, spare_hull_geoms_[index]);
  dGeomSetCategoryBits(slot.geom, spec.is_debris ? kDebrisBits : kBodyBits);
  dGeomSetCollideBits(slot.geom, spec.is_debris ? kFieldBits | kBodyBits : ~0UL);
  const dMass mass = mass_of(slot.shape, slot.mass_kg);
  dBodySetMass(slot.body, &mass);
  dGeomSetBody(slot.geom, slot.body);
  dBodySetData(slot.body, reinterpret_cast<void*>(static_cast<std::uintptr_t>(index)));
  const Vec3d& p = spec.position_world_m;
  const Quaternion unit = q.normalized();
  const dQuaternion ode_q = {unit.w, unit.x, unit.y, unit.z};
  const Vec3d& v = spec.velocity_world_m_per_s;
  const Vec3d& w = spec.angular_velocity_world_rad_per_s;
  dBodySetPosition(slot.body, p.x, p.y, p.z);
  dBodySetQuaternion(slot.body, ode_q);
  dBodySetLinearVel(slot.body, v.x, v.y, v.z);
  dBodySetAngularVel(slot.body, w.x, w.y, w.z);

  id = {index, generation};
  ++counters_.spawned;
  publish();
  counters_.bodies_max = std::max(counters_.bodies_max, states_count_);
  return rt::Status::ok;
}

void World::destroy(Slot& slot) noexcept {
  release_body_geom(slot.geom);
  dBodyDestroy(slot.body);
  slot.geom = nullptr;
  slot.body = nullptr;
}

rt::Status World::remove(BodyId id) noexcept {
  if (!id.is_body() || id.index >= slots_.size()) return rt::Status::stale;
  Slot& slot = slots_[id.index];
  if (slot.body == nullptr || slot.generation != id.generation) return rt::Status::stale;
  for (Slot& other : slots_) {
    if (&other == &slot || other.body == nullptr || !boxes_meet(slot.geom, other.geom)) continue;
    dBodyEnable(other.body);
    other.calm_steps = 0;
  }
  destroy(slot);
  publish();
  return rt::Status::ok;
}

rt::Status World::push(BodyId id, const Vec3d& impulse, const Vec3d& position) noexcept {
  if (!id.is_body() || id.index >= slots_.size()) return rt::Status::stale;
  Slot& slot = slots_[id.index];
  if (slot.body == nullptr || slot.generation != id.generation) return rt::Status::stale;
  if (!is_finite(impulse) || !is_finite(position)) return rt::Status::unsupported;
  dBodyEnable(slot.body);
  slot.calm_steps = 0;
  // A force over one step is the impulse; QuickStep applies it with the next one's.
  const Vec3d force = impulse * (1 / kStepS);
  dBodyAddForceAtPos(slot.body, force.x, force.y, force.z, position.x, position.y, position.z);
  return rt::Status::ok;
}

void World::wake_all() noexcept {
  for (Slot& slot : slots_) {
    if (slot.body == nullptr) continue;
    dBodyEnable(slot.body);
    slot.calm_steps = 0;
  }
}

void World::set_gravity(const Vec3d& gravity) noexcept {
  TACTUS_ASSERT(is_finite(gravity));
  config_.gravity_world_m_per_s2 = gravity;
  dWorldSetGravity(world_, gravity.x, gravity.y, gravity.z);
  wake_all();
}

rt::Status World::step(rt::Duration duration, ContactSink& sink) noexcept {
  TACTUS_ASSERT(world_ != nullptr && duration.ns >= 0);
  elapsed_ns_ += duration.ns;
  std::int64_t due = elapsed_ns_ * kStepsPerSecond / 1'000'000'000 - step_index_;
  bool late = false;
  if (due > config_.steps_max_per_call) {
    const std::int64_t surplus = due - config_.steps_max_per_call;
    counters_.steps_dropped += static_cast<std::uint64_t>(surplus);
    elapsed_ns_ -= surplus * 1'000'000'000 / kStepsPerSecond;
    due = config_.steps_max_per_call;
    late = true;
  }
  bool solved = true;
  for (std::int64_t i = 0; i < due; ++i) solved = fixed_step(sink) && solved;
  publish();
  if (!solved) return rt::Status::full;
  return late ? rt::Status::late : rt::Status::ok;
}

void World::near_pair(void* self, dxGeom* a, dxGeom* b) { static_cast<World*>(self)->collide_pair(a, b); }

void World::collide_pair(dxGeom* a, dxGeom* b) noexcept {
  dBodyID body_a = dGeomGetBody(a);
  dBodyID body_b = dGeomGetBody(b);
  if (!is_awake(body_a) && !is_awake(body_b)) return;

  std::array<dContact, kPairContactsMax> contacts;
  const int found = pair_contacts(a, b, contacts);
  if (found <= 0) return;
  std::size_t count = static_cast<std::size_t>(found);
  if (contacts_count_ + count > config_.contacts_capacity) {
    const std::size_t room = config_.contacts_capacity - contacts_count_;
    counters_.contacts_dropped += count - room;
    count = room;
    if (count == 0) return;
  }

  // The pair is told from the side of one body: `self_is_a` when the first geom's body is it.
  const bool self_is_a = body_a != nullptr;
  dBodyID body = self_is_a ? body_a : body_b;
  dBodyID other = self_is_a ? body_b : nullptr;
  Slot& slot = slots_[slot_of(body, kNoSlot)];
  std::size_t deepest = 0;
  for (std::size_t i = 1; i < count; ++i)
    if (contacts[i].geom.depth > contacts[deepest].geom.depth) deepest = i;

  // One law a pair and step: at the deepest point.
  ContactLaw law;
  Manifold manifold;
  const Vec3d deepest_m = vec(contacts[deepest].geom.pos);
  manifold.body = slot_of(body, kNoSlot);
  manifold.other = slot_of(other, kNoSlot);
  slot.touching = true;
  if (other == nullptr) {
    MaterialDistribution surface;
    slot.on_field = true;
    slot.support_world_m = deepest_m;
    slot.support_depth_m = contacts[deepest].geom.depth;
    if (field_.materials(deepest_m, surface)) {
      law = expected_law(slot.properties, surface, materials_);
      manifold.material = most_likely(surface);
    } else {
      law = combine(slot.properties, materials_.of(kUnknownMaterial));
    }
  } else {
    Slot& other_slot = slots_[manifold.other];
    other_slot.touching = true;
    law = combine(slot.properties, other_slot.properties);
    // ODE's contact points of two boxes jump when the boxes overlap by millimetres: soft stacks would never
    // calm down.
    law.compliance_m_per_n = 0;
    manifold.material = other_slot.material;
  }
  const double mass_kg =
      other == nullptr ? slot.mass_kg : std::min(slot.mass_kg, slots_[manifold.other].mass_kg);
  const Vec3d travel = vec(dBodyGetLinearVel(body));
  const dReal* r = dBodyGetRotation(body);
  const Vec3d axis{r[2], r[6], r[10]};

  std::array<dJointID, kPairContactsMax> joints;
  for (std::size_t i = 0; i < count; ++i) {
    dContact& contact = contacts[i];
    const Vec3d position = vec(contact.geom.pos);
    const Vec3d normal = vec(contact.geom.normal) * (self_is_a ? 1.0 : -1.0);
    const Vec3d relative = velocity_at(body, position) - velocity_at(other, position);
    set_surface(contact, law,
                {.normal = normal,
                 .relative_velocity = relative,
                 .travel = travel,
                 .gravity = config_.gravity_world_m_per_s2,
                 .mass_kg = mass_kg,
                 .points_count = static_cast<int>(count),
                 .rolling_radius_m = rolling_radius_m(slot.shape, axis, normal)});
    const double approach = -relative.dot(normal);
    manifold.impact_speed = std::max(manifold.impact_speed, approach);
    if (i == 0 || approach < manifold.least_speed) manifold.least_speed = approach;
    if (i == deepest) {
      manifold.position_world_m = position;
      manifold.normal_world = normal;
    }
    joints[i] = dJointCreateContact(world_, joints_, &contact);
    dJointAttach(joints[i], body_a, body_b);
  }
  if (other == nullptr) slot.support_normal_world = manifold.normal_world;
  contacts_count_ += count;
  if (manifold.impact_speed > kBounceSpeed) {
    manifold.first_feedback = static_cast<std::uint32_t>(feedbacks_count_);
    manifold.count = static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < count; ++i) {
      feedback_normals_[feedbacks_count_] = vec(contacts[i].geom.normal);
      dJointSetFeedback(joints[i], &feedbacks_[feedbacks_count_++]);
    }
    manifolds_[manifolds_count_++] = manifold;
  }
}

bool World::fixed_step(ContactSink& sink) noexcept {
  contacts_count_ = feedbacks_count_ = manifolds_count_ = 0;
  check_one_sleeper();
  wake_neighbors();
  for (Slot& slot : slots_) {
    if (slot.body == nullptr) continue;
    if (is_awake(slot.body)) slot.touching = slot.on_field = slot.on_field && ease_out(slot);
    slot.position_before_m = vec(dBodyGetPosition(slot.body));
  }

  dSpaceCollide(space_, this, near_pair);
  // QuickStep shuffles its rows with the library's random numbers: the same step gets the same ones.
  dRandSetSeed(static_cast<unsigned long>(step_index_));
  const bool solved = dWorldQuickStep(world_, kStepS) != 0;
  ++step_index_;
  ++counters_.steps;
  counters_.contacts += contacts_count_;
  counters_.contacts_max = std::max(counters_.contacts_max, contacts_count_);
  if (solved)
    emit_events(sink);
  else
    ++counters_.steps_failed;
  dJointGroupEmpty(joints_);

  for (Slot& slot : slots_)
    if (slot.body != nullptr && is_awake(slot.body)) settle_body(slot);
  sleep_calm_groups();
  return solved;
}

void World::emit_events(ContactSink& sink) noexcept {
  for (const Manifold& m : manifolds_.first(manifolds_count_)) {
    double impulse = 0;
    for (std::size_t i = m.first_feedback; i < m.first_feedback + m.count; ++i)
      impulse += std::abs(vec(feedbacks_[i].f1).dot(feedback_normals_[i])) * kStepS;
    const Slot& slot = slots_[m.body];
    ContactEvent event;
    event.time = time();
    event.body = {m.body, slot.generation};
    if (m.other != kNoSlot) event.other = {m.other, slots_[m.other].generation};
    event.position_world_m = m.position_world_m;
    event.normal_world = m.normal_world;
    event.impulse_n_s = impulse;
    event.impact_speed_m_per_s = m.impact_speed;
    event.material = m.material;
    event.body_material = slot.material;
    sink.push(event);
    if (m.least_speed <= kBounceSpeed) continue;
    if (m.other == kNoSlot) {
      fly_on_after_bounce(slot, m.normal_world);
      continue;
    }
    // A body that lies on a real surface passes the other's missing gravity on to it.
    const Slot& other = slots_[m.other];
    if (other.on_field && !slot.on_field) fly_on_after_bounce(slot, m.normal_world);
    if (slot.on_field && !other.on_field) fly_on_after_bounce(other, -m.normal_world);
  }
}

/// A bounce happens where the step begins (sweep() stopped the body there), and the solver's rebound speed
/// holds for its end: the gravity in between is missing along the normal, which would lift a rebound by e v h
/// (1 cm at 1 m/s).
void World::fly_on_after_bounce(const Slot& slot, const Vec3d& normal) noexcept {
  const Vec3d velocity = vec(dBodyGetLinearVel(slot.body));
  const Vec3d pull = normal * config_.gravity_world_m_per_s2.dot(normal);
  if ((velocity + pull * kStepS).dot(normal) <= 0) return;  // too slow to leave the surface
  const Vec3d v = velocity + pull * kStepS;
  const Vec3d p = vec(dBodyGetPosition(slot.body)) + pull * (0.5 * kStepS * kStepS);
  dBodySetLinearVel(slot.body, v.x, v.y, v.z);
  dBodySetPosition(slot.body, p.x, p.y, p.z);
}

/// A surface that the map moves over the centre of a body would be one that the body is behind of, and touch
/// it no more. A body that lay on this surface a step ago is carried out on its side, without gaining speed:
/// true while that goes on.
bool World::ease_out(const Slot& slot) noexcept {
  const Vec3d center = vec(dBodyGetPosition(slot.body));
  double distance_m = 0;
  if (!field_.distance(center, distance_m) || distance_m >= 0) return false;
  map::DistanceSample there;
  if (!field_.sample(center, there)) return false;
  const Vec3d out = there.gradient.cast<double>();
  if (out.dot(slot.support_normal_world) < 0.5) return false;
  const Vec3d p = center + out * std::min(kContactMarginM - distance_m, kPushOutSpeedMax * kStepS);
  const Vec3d velocity = vec(dBodyGetLinearVel(slot.body));
  const Vec3d v = velocity - out * velocity.dot(out);
  dBodySetPosition(slot.body, p.x, p.y, p.z);
  dBodySetLinearVel(slot.body, v.x, v.y, v.z);
  return true;
}

/// After the solver: what left the world goes, flight becomes the exact parabola, the path is swept, calm
/// steps are counted.
void World::settle_body(Slot& slot) noexcept {
  const Vec3d position = vec(dBodyGetPosition(slot.body));
  const Vec3d velocity = vec(dBodyGetLinearVel(slot.body));
  const Vec3d spin = vec(dBodyGetAngularVel(slot.body));
  const bool finite = is_finite(position) && is_finite(velocity) && is_finite(spin);
  if (!finite || position.dot(position) > kWorldRadiusM * kWorldRadiusM) {
    destroy(slot);
    ++counters_.bodies_lost;
    return;
  }
  const bool free_flight = !slot.touching;
  if (free_flight) {
    const Vec3d p = position - config_.gravity_world_m_per_s2 * (0.5 * kStepS * kStepS);
    dBodySetPosition(slot.body, p.x, p.y, p.z);
  }
  sweep(slot, free_flight);

  const double size_m = reach_m(slot.shape);
  const bool calm = slot.touching && velocity.dot(velocity) < kCalmSpeed * kCalmSpeed &&
                    spin.dot(spin) * size_m * size_m < kCalmSpeed * kCalmSpeed;
  slot.calm_steps =
      calm ? static_cast<std::uint16_t>(std::min<int>(slot.calm_steps + 1, kCalmSteps)) : std::uint16_t{0};
}

/// Sleepers whose bounding boxes meet those of an awake body wake up, and wake their neighbours in turn,
/// before contacts are made: ODE would wake them in the middle of the step, without the contacts that carry
/// them.
void World::wake_neighbors() noexcept {
  std::size_t count = 0;
  std::size_t asleep = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].body == nullptr) continue;
    if (is_awake(slots_[i].body))
      work_list_[count++] = static_cast<std::uint16_t>(i);
    else
      ++asleep;
  }
  for (std::size_t done = 0; done < count && asleep > 0; ++done) {
    const Slot& awake = slots_[work_list_[done]];
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      Slot& slot = slots_[i];
      if (slot.body == nullptr || is_awake(slot.body) || !boxes_meet(awake.geom, slot.geom)) continue;
      dBodyEnable(slot.body);
      slot.calm_steps = 0;
      work_list_[count++] = static_cast<std::uint16_t>(i);
      --asleep;
    }
  }
}

/// Bodies whose bounding boxes meet fall asleep together, when all of them are calm.
void World::sleep_calm_groups() noexcept {
  bool any = false;
  for (Slot& slot : slots_) {
    slot.in_group = false;
    any = any || (slot.body != nullptr && is_awake(slot.body) && slot.calm_steps == kCalmSteps);
  }
  if (!any) return;
  for (std::size_t first = 0; first < slots_.size(); ++first) {
    if (slots_[first].body == nullptr || !is_awake(slots_[first].body) || slots_[first].in_group) continue;
    std::size_t count = 0;
    bool calm = true;
    work_list_[count++] = static_cast<std::uint16_t>(first);
    slots_[first].in_group = true;
    for (std::size_t done = 0; done < count; ++done) {
      const Slot& member = slots_[work_list_[done]];
      calm = calm && member.calm_steps == kCalmSteps;
      for (std::size_t i = 0; i < slots_.size(); ++i) {
        Slot& slot = slots_[i];
        if (slot.body == nullptr || slot.in_group || !is_awake(slot.body) ||
            !boxes_meet(member.geom, slot.geom))
          continue;
        slot.in_group = true;
        work_list_[count++] = static_cast<std::uint16_t>(i);
      }
    }
    if (!calm) continue;
    for (std::size_t i = 0; i < count; ++i) {
      dBodyID body = slots_[work_list_[i]].body;
      dBodySetLinearVel(body, 0, 0, 0);
      dBodySetAngularVel(body, 0, 0, 0);
      dBodyDisable(body);
    }
  }
}

void World::sweep(Slot& slot, bool free_flight) noexcept {
  const Vec3d from = slot.position_before_m;
  const Vec3d travel = vec(dBodyGetPosition(slot.body)) - from;
  const std::uint16_t held_steps = slot.held_steps;
  slot.held_steps = 0;
  if (travel.dot(travel) < kSweepLeastM * kSweepLeastM) return;
  const double fraction =
      free_fraction(field_, slot.shape, from, Rotation::from(quaternion_of(slot.body)), travel);
  if (fraction >= 1) return;
  ++counters_.sweeps_stopped;
  const Vec3d p = from + travel * fraction;
  dBodySetPosition(slot.body, p.x, p.y, p.z);
  // A bounce takes one step. What is still held then is wedged where the contacts do not tell: gravity would
  // go on filling it with speed.
  if (travel.norm() * fraction < kHeldM) slot.held_steps = static_cast<std::uint16_t>(held_steps + 1);
  if (slot.held_steps > 2) {
    slot.held_steps = 2;
    dBodySetLinearVel(slot.body, 0, 0, 0);
    return;
  }
  if (!free_flight) return;
  const Vec3d v =
      vec(dBodyGetLinearVel(slot.body)) - config_.gravity_world_m_per_s2 * (kStepS * (1 - fraction));
  dBodySetLinearVel(slot.body, v.x, v.y, v.z);
}

/// The map may take a sleeper's support away, or rise over it. One sleeper a step is asked, in turn, whether
/// it still touches as deep as when it fell asleep. Where the map has forgotten the place (an evicted block)
/// it sleeps on: what nobody sees need not fall out of the world.
void World::check_one_sleeper() noexcept {
  sleeper_next_ = sleeper_next_ + 1 < slots_.size() ? sleeper_next_ + 1 : 0;
  Slot& slot = slots_[sleeper_next_];
  if (slot.body == nullptr || is_awake(slot.body) || !slot.on_field) return;
  std::array<FieldContact, kFieldContactsMax> contacts;
  const Vec3d center = vec(dBodyGetPosition(slot.body));
  const int touches = field_contacts(field_, slot.shape, center, Rotation::from(quaternion_of(slot.body)),
                                     kContactMarginM, {}, contacts);
  double depth_m = 0;
  for (int i = 0; i < touches; ++i)
    depth_m = std::max(depth_m, contacts[static_cast<std::size_t>(i)].depth_m);
  if (touches > 0 && std::abs(depth_m - slot.support_depth_m) < kShiftM) return;
  double distance_m = 0;
  if (touches == 0 && !field_.distance(slot.support_world_m, distance_m)) return;
  dBodyEnable(slot.body);
  slot.calm_steps = 0;
}

void World::publish() noexcept {
  states_count_ = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& slot = slots_[i];
    if (slot.body == nullptr) continue;
    BodyState& state = states_[states_count_++];
    state.id = {static_cast<std::uint16_t>(i), slot.generation};
    state.shape = slot.shape;
    state.material = slot.material;
    state.position_world_m = vec(dBodyGetPosition(slot.body));
    state.q_world_body = quaternion_of(slot.body);
    state.velocity_world_m_per_s = vec(dBodyGetLinearVel(slot.body));
    state.angular_velocity_world_rad_per_s = vec(dBodyGetAngularVel(slot.body));
    state.mass_kg = slot.mass_kg;
    state.resting = !is_awake(slot.body);
  }
}

}  // namespace tactus::contact
