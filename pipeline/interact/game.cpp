#include "pipeline/interact/game.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tactus::interact {
namespace {

constexpr rt::Duration kSingleStep{1'000'000'000 / contact::kStepsPerSecond};
constexpr rt::Duration kChipLife{3'000'000'000}, kPieceLife{30'000'000'000}, kBulletLife{2'000'000'000};
constexpr double kShotRangeM = 10;
constexpr double kBulletRadiusM = 0.003, kBulletKg = 0.002;  // of a small pistol; its energy is the shot's
constexpr double kSurfaceProbeM = 0.05;
constexpr Rgb8 kCupColor{205, 225, 228};
constexpr int kBreakCues = 4;
constexpr double kPieceClearM = 0.008;  // a shard is 4 to 12 mm thick

/// Cube root by Newton's method, of 1e-6 .. 1e6: marks need no more than a per cent.
double cube_root(double value) {
  double root = value > 1 ? 0.5 * value + 0.5 : 0.5;
  for (int i = 0; i < 24; ++i) root = (2 * root + value / (root * root)) / 3;
  return root;
}

/// The rotation that turns z into `axis` (unit) by the shorter way.
Quaternion from_z(const Vec3d& axis) {
  if (axis.z < -0.9999) return {0, 1, 0, 0};
  return Quaternion{1 + axis.z, -axis.y, axis.x, 0}.normalized();
}

/// First distance along a ray to the box around a body, in its own frame; negative when it passes.
double distance_to_body(const AimedRay& ray, const contact::BodyState& body) {
  const contact::Shape& shape = body.shape;
  const double reach = contact::reach_m(shape);
  const double half[3] = {shape.kind == contact::ShapeKind::box ? shape.half_extents_m.x : shape.radius_m > 0 ? shape.radius_m : reach,
                          shape.kind == contact::ShapeKind::box ? shape.half_extents_m.y : shape.radius_m > 0 ? shape.radius_m : reach,
                          shape.kind == contact::ShapeKind::box        ? shape.half_extents_m.z
                          : shape.kind == contact::ShapeKind::cylinder ? shape.half_length_m
                                                                       : reach};
  const Rotation to_body = Rotation::from(body.q_world_body).transposed();
  const Vec3d o = to_body * (ray.origin_world_m - body.position_world_m), d = to_body * ray.direction_world;
  const double origin[3] = {o.x, o.y, o.z}, direction[3] = {d.x, d.y, d.z};
  double near = 0, far = 1e9;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) < 1e-12) {
      if (std::abs(origin[i]) > half[i]) return -1;
      continue;
    }
    const double a = (-half[i] - origin[i]) / direction[i], b = (half[i] - origin[i]) / direction[i];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near <= far ? near : -1;
}

}  // namespace

/// A piece of the room that was struck.
struct Game::Surface {
  Vec3d position_world_m, normal_world;
  MaterialDistribution materials{};         // all 0: nothing is known
  MaterialId material = kUnknownMaterial;   // most likely
  float probability = 0;
  Rgb8 color;

  void set_materials(const MaterialDistribution& posterior) {
    materials = posterior;
    material = most_likely(posterior);
    probability = posterior[material];
  }
};

std::size_t Game::bytes_needed(const GameConfig& config) {
  return ThingCatalogue::bytes_needed() + rt::bytes_of<Tag>(config.bodies_capacity) +
         rt::bytes_of<GameEvent>(config.events_capacity) + rt::bytes_of<Mark>(config.marks_capacity) +
         rt::bytes_of<SoundCue>(config.cues_capacity) + Walkers::bytes_needed();
}

rt::Result<void> Game::bind(rt::Slice slice, const GameConfig& config, Script script,
                            const contact::MaterialTable& materials, const contact::DistanceField& room) {
  TACTUS_ASSERT(events_.empty());
  config_ = config;
  materials_ = materials;
  if (auto bound = catalogue_.bind(slice); !bound) return bound.error();
  tags_ = slice.take<Tag>(config.bodies_capacity);
  events_ = slice.take<GameEvent>(config.events_capacity);
  marks_ = slice.take<Mark>(config.marks_capacity);
  cues_ = slice.take<SoundCue>(config.cues_capacity);
  room_ = room;
  walkers_.bind(slice, script.walkers, room, config.gravity_world_m_per_s2);
  schedule_ = Schedule(std::move(script));
  return {};
}

const Game::Tag* Game::tag_of(contact::BodyId id) const {
  if (!id.is_body() || id.index >= tags_.size() || tags_[id.index].generation != id.generation) return nullptr;
  return &tags_[id.index];
}

const contact::BodyState* Game::state_of(contact::BodyId id) const {
  for (const contact::BodyState& state : world_->bodies())
    if (state.id == id) return &state;
  return nullptr;
}

Game::Surface Game::surface_at(const Vec3d& position, const Vec3d& normal) const {
  Surface surface;
  surface.position_world_m = position;
  surface.normal_world = normal;
  surface.color = kUnknownColor;
  MaterialDistribution materials;
  if (room_.materials(position, materials)) surface.set_materials(materials);
  map::SurfacePoint point;
  if (room_.raycast(position + normal * kSurfaceProbeM, -normal, 2 * kSurfaceProbeM, point)) {
    surface.position_world_m = point.position_world_m.cast<double>();
    surface.normal_world = point.normal_world.cast<double>();
    surface.color = point.color;
  }
  return surface;
}

rt::Status Game::step(const View& view, bool is_tracked, const hal::FrameHeader& frame, rt::Duration duration,
                      contact::World& world) noexcept {
  // Rounds may be shorter than frames, and frames may be dropped.
  if (frames_ == 0) first_sequence_ = frame.sequence;
  frames_ = frame.sequence - first_sequence_ + 1;
  frame_ = frame;
  world_ = &world;
  cues_count_ = 0;
  in_round_ = {};
  since_tracking_ = since_tracking_ + duration;
  remove_expired();
  if (is_tracked) {
    view_ = view;
    has_view_ = true;
    std::array<DueThrow, 8> throws;
    const std::size_t throws_count =
        schedule_.due_throws(frames_, since_tracking_, view, config_.gravity_world_m_per_s2, aimed_at(), throws);
    for (const DueThrow& due : std::span(throws).first(throws_count))
      (void)launch(schedule_.throw_at(due.index), due.start, static_cast<std::int32_t>(due.index));  // counted there
    std::array<std::size_t, 8> shots;
    const std::size_t shots_count = schedule_.due_shots(frames_, since_tracking_, shots);
    for (const std::size_t index : std::span(shots).first(shots_count))
      (void)fire(schedule_.shot_at(index), static_cast<std::int32_t>(index));
  }

  rt::Status status = rt::Status::ok;
  for (rt::Duration left = duration; left.ns > 0;) {
    const rt::Duration part{std::min(left.ns, kSingleStep.ns)};
    std::array<contact::ContactEvent, 64> impacts;
    contact::ContactSink sink{impacts};
    if (world.step(part, sink) == rt::Status::full) status = rt::Status::full;
    counters_.events_dropped += sink.dropped;
    in_round_ = in_round_ + part;
    for (const contact::ContactEvent& impact : std::span(impacts).first(sink.count)) react(impact);
    left = left - part;
  }
  if (is_tracked) walk(duration);
  time_ = time_ + duration;
  return status;
}

void Game::walk(rt::Duration duration) noexcept {
  std::array<WalkerNews, 2 * kWalkersMax> news;
  const std::size_t count = walkers_.step(frames_, since_tracking_, duration, view_, world_->bodies(), news);
  for (const WalkerNews& one : std::span(news).first(count)) {
    const Agent& agent = walkers_.agents()[one.index];
    const AgentPose& pose = agent.pose();
    GameEvent event;
    event.kind = GameEventKind::walk;
    event.order_index = static_cast<std::int32_t>(one.index);
    event.walker_state = one.state;
    event.walked_m = pose.walked_m;
    event.position_world_m = pose.position_world_m;
    event.normal_world = pose.heading_world;
    const Surface ground = surface_at(pose.position_world_m, agent.frame().up);
    event.material = ground.material;
    event.probability = ground.probability;
    log(event);
  }
}

bool Game::spawn(const contact::BodySpec& spec, const Tag& tag, contact::BodyId& id) noexcept {
  rt::Status status = world_->spawn(spec, id);
  if (status == rt::Status::full && make_room()) status = world_->spawn(spec, id);
  if (status != rt::Status::ok) return false;
  tags_[id.index] = tag;
  tags_[id.index].generation = id.generation;
  return true;
}

/// Takes the debris that would go first.
bool Game::make_room() noexcept {
  contact::BodyId oldest;
  rt::Duration expires{};
  for (const contact::BodyState& body : world_->bodies()) {
    const Tag* tag = tag_of(body.id);
    if (tag == nullptr || !tag->is_debris) continue;
    if (oldest.is_body() && tag->expires >= expires) continue;
    oldest = body.id;
    expires = tag->expires;
  }
  if (!oldest.is_body()) return false;
  ++counters_.debris_recycled;
  return world_->remove(oldest) == rt::Status::ok;
}

void Game::remove_expired() noexcept {
  std::array<contact::BodyId, 64> gone;
  std::size_t count = 0;
  for (const contact::BodyState& body : world_->bodies()) {
    const Tag* tag = tag_of(body.id);
    if (tag != nullptr && tag->expires.ns > 0 && tag->expires <= time_ && count < gone.size()) gone[count++] = body.id;
  }
  for (const contact::BodyId id : std::span(gone).first(count)) (void)world_->remove(id);
}

rt::Status Game::throw_now(const Throw& what, contact::World& world) noexcept {
  if (!has_view_) {
    ++counters_.orders_refused;
    return rt::Status::lost;
  }
  world_ = &world;
  const auto start = start_of(what, view_, config_.gravity_world_m_per_s2, aimed_at());
  if (start) return launch(what, *start, -1);
  ++counters_.orders_refused;
  return rt::Status::lost;
}

rt::Status Game::shoot_now(const Shot& shot, contact::World& world) noexcept {
  if (!has_view_) {
    ++counters_.orders_refused;
    return rt::Status::lost;
  }
  world_ = &world;
  return fire(shot, -1);
}

rt::Status Game::launch(const Throw& what, const Start& start, std::int32_t order_index) noexcept {
  const Thing& thing = catalogue_.of(what.thing);
  const bool is_plain = what.thing == ThingKind::plain;
  contact::BodySpec spec;
  spec.shape = is_plain ? what.shape : thing.shape;
  spec.material = is_plain ? what.material : thing.material;
  spec.position_world_m = start.position_world_m;
  spec.velocity_world_m_per_s = start.velocity_world_m_per_s;
  spec.angular_velocity_world_rad_per_s = what.spin_world_rad_per_s;
  Tag tag;
  tag.thing = what.thing;
  tag.order_index = order_index;
  if (!is_plain) {
    spec.mass_kg = thing.build.volume_m3 * materials_.of(thing.material).density_kg_per_m3;
    // A plate flies flat, a little raised in front, and spins about its axis as it leaves a hand; a cup stands up.
    const Vec3d up = -config_.gravity_world_m_per_s2.normalized();
    const Vec3d forward = view_.T_world_picture.rotation * Vec3d{0, 0, 1};
    const Vec3d axis = what.thing == ThingKind::plate ? (up - forward * 0.35).normalized() : up;
    spec.q_world_body = from_z(axis == Vec3d{} ? Vec3d{0, 1, 0} : axis);
    spec.angular_velocity_world_rad_per_s += axis * (what.thing == ThingKind::plate ? 9.0 : 2.0);
  }
  if (what.thing == ThingKind::cup) {
    tag.color = kCupColor;
    tag.has_color = true;
  }
  contact::BodyId id;
  if (!spawn(spec, tag, id)) {
    ++counters_.orders_refused;
    return rt::Status::full;
  }
  ++counters_.throws;
  GameEvent event;
  event.kind = GameEventKind::thrown;
  event.order_index = order_index;
  event.body_index = id.index;
  event.body_material = spec.material;
  event.position_world_m = start.position_world_m;
  event.normal_world = start.velocity_world_m_per_s.normalized();
  event.impact_speed_m_per_s = start.velocity_world_m_per_s.norm();
  log(event);
  return rt::Status::ok;
}

rt::Status Game::fire(const Shot& shot, std::int32_t order_index) noexcept {
  const AimedRay ray = aimed_ray(shot.aim, view_);
  ++counters_.shots;
  GameEvent event;
  event.kind = GameEventKind::shot;
  event.order_index = order_index;
  event.position_world_m = ray.origin_world_m;
  event.normal_world = ray.direction_world;
  event.energy_j = shot.energy_j;
  log(event);
  if (shot.projectile_m_per_s > 0) {
    contact::BodySpec spec;
    spec.shape = contact::Shape::sphere(kBulletRadiusM);
    spec.material = material_from_name("metal");
    spec.mass_kg = kBulletKg;
    spec.position_world_m = ray.origin_world_m + ray.direction_world * 0.15;
    spec.velocity_world_m_per_s = ray.direction_world * shot.projectile_m_per_s;
    Tag tag;
    tag.bullet_energy_j = shot.energy_j;
    tag.order_index = order_index;
    tag.expires = time_ + kBulletLife;
    contact::BodyId id;
    if (spawn(spec, tag, id)) return rt::Status::ok;
    ++counters_.orders_refused;
    return rt::Status::full;
  }
  map::SurfacePoint point;
  const bool is_hit = room_.raycast(ray.origin_world_m, ray.direction_world, kShotRangeM, point);
  const double range_m =
      is_hit ? (point.position_world_m.cast<double>() - ray.origin_world_m).norm() : kShotRangeM;
  if (shoot_bodies(ray, range_m, shot, order_index)) return rt::Status::ok;
  if (!is_hit) {
    ++counters_.misses;
    return rt::Status::ok;
  }
  Surface surface;
  surface.position_world_m = point.position_world_m.cast<double>();
  surface.normal_world = point.normal_world.cast<double>();
  surface.color = point.color;
  if (point.material != kUnknownMaterial) surface.set_materials(point.materials);
  bullet_hit(surface, shot.energy_j, std::sqrt(2 * shot.energy_j / kBulletKg), order_index);
  return rt::Status::ok;
}

/// The nearest virtual thing in front of what is real takes the shot.
bool Game::shoot_bodies(const AimedRay& ray, double range_m, const Shot& shot, std::int32_t order_index) noexcept {
  const contact::BodyState* struck = nullptr;
  for (const contact::BodyState& body : world_->bodies()) {
    const Tag* tag = tag_of(body.id);
    if (tag != nullptr && tag->is_debris) continue;
    const double distance_m = distance_to_body(ray, body);
    if (distance_m < 0 || distance_m >= range_m) continue;
    struck = &body;
    range_m = distance_m;
  }
  if (struck == nullptr) return false;
  const contact::BodyState body = *struck;
  const Tag* tag = tag_of(body.id);
  GameEvent event;
  event.kind = GameEventKind::hit;
  event.order_index = order_index;
  event.body_index = body.id.index;
  event.position_world_m = ray.origin_world_m + ray.direction_world * range_m;
  event.normal_world = -ray.direction_world;
  event.material = body.material;
  event.probability = 1;
  event.body_material = material_from_name("metal");
  event.energy_j = shot.energy_j;
  cue({in_round_, event.position_world_m, event.normal_world, shot.energy_j, std::sqrt(2 * kBulletKg * shot.energy_j), 0,
       event.body_material, body.material, 2 * kBulletRadiusM, 2 * contact::reach_m(body.shape)});
  if (tag != nullptr && !catalogue_.of(tag->thing).pieces.empty()) {
    event.outcome = contact::Outcome::broke;
    log(event);
    break_body(body, *tag, -ray.direction_world);
    return true;
  }
  log(event);
  (void)world_->push(body.id, ray.direction_world * std::sqrt(2 * kBulletKg * shot.energy_j), event.position_world_m);
  return true;
}

void Game::react(const contact::ContactEvent& event) noexcept {
  // Either may be gone by what an earlier impact of the same step did.
  if (state_of(event.body) == nullptr) return;
  judge(event, event.body, event.other, event.normal_world);
  if (event.other.is_body() && state_of(event.other) != nullptr)
    judge(event, event.other, event.body, -event.normal_world);
}

void Game::judge(const contact::ContactEvent& impact, contact::BodyId id, contact::BodyId other_id,
                 const Vec3d& normal) noexcept {
  const contact::BodyState* found = state_of(id);
  if (found == nullptr) return;
  const contact::BodyState body = *found;
  const contact::BodyState* other = state_of(other_id);
  const Tag untagged;
  const Tag tag = tag_of(id) != nullptr ? *tag_of(id) : untagged;

  if (tag.bullet_energy_j > 0) {
    if (!other_id.is_body())
      bullet_hit(surface_at(impact.position_world_m, normal), tag.bullet_energy_j, impact.impact_speed_m_per_s,
                 tag.order_index);
    (void)world_->remove(id);
    return;
  }

  Surface surface;
  if (other_id.is_body()) {
    surface.position_world_m = impact.position_world_m;
    surface.normal_world = normal;
    if (other != nullptr && other->material < kMaterialCount) {
      MaterialDistribution certain{};
      certain[other->material] = 1;
      surface.set_materials(certain);
      surface.color = look_of(*other).color;
    }
  } else {
    surface = surface_at(impact.position_world_m, normal);
  }
  const Tag* other_tag = tag_of(other_id);
  const bool is_shot = other_tag != nullptr && other_tag->bullet_energy_j > 0;
  const double energy =
      is_shot ? other_tag->bullet_energy_j
              : contact::impact_energy_j(body.mass_kg, impact.impact_speed_m_per_s, other != nullptr ? other->mass_kg : 0);
  // A pair is heard once.
  if (id == impact.body)
    cue({in_round_, impact.position_world_m, normal, energy, impact.impulse_n_s, impact.impact_speed_m_per_s, body.material,
         surface.material, 2 * contact::reach_m(body.shape), other != nullptr ? 2 * contact::reach_m(other->shape) : 0});
  if (tag.is_debris) return;

  const Thing& thing = catalogue_.of(tag.thing);
  contact::ImpactVerdict verdict =
      contact::judge_impact(thing.build, body.material, materials_.of(body.material), surface.materials, energy, materials_);
  if (is_shot && !thing.pieces.empty()) verdict.outcome = contact::Outcome::broke;
  const bool breaks =
      verdict.outcome == contact::Outcome::broke || verdict.outcome == contact::Outcome::broke_with_chips;
  GameEvent event;
  event.kind = breaks ? GameEventKind::broke : GameEventKind::contact;
  event.order_index = tag.order_index;
  event.body_index = id.index;
  event.other_body_index = other_id.is_body() ? static_cast<std::int32_t>(other_id.index) : -1;
  event.position_world_m = impact.position_world_m;
  event.normal_world = normal;
  event.body_material = body.material;
  event.material = surface.material;
  event.probability = surface.probability;
  event.impulse_n_s = impact.impulse_n_s;
  event.impact_speed_m_per_s = impact.impact_speed_m_per_s;
  event.energy_j = energy;
  event.outcome = verdict.outcome;
  if (verdict.outcome == contact::Outcome::broke_with_chips && !other_id.is_body()) {
    scatter_chips(surface, verdict.chips_count, energy, event);
    event.mark_index = add_mark(surface, energy);
  }
  log(event);
  if (breaks) break_body(body, tag, normal);
}

void Game::bullet_hit(const Surface& surface, double energy_j, double speed, std::int32_t order_index) noexcept {
  const MaterialId lead = material_from_name("metal");
  const contact::ImpactVerdict verdict =
      contact::judge_impact({}, lead, materials_.of(lead), surface.materials, energy_j, materials_);
  GameEvent event;
  event.kind = GameEventKind::hit;
  event.order_index = order_index;
  event.position_world_m = surface.position_world_m;
  event.normal_world = surface.normal_world;
  event.body_material = lead;
  event.material = surface.material;
  event.probability = surface.probability;
  event.impact_speed_m_per_s = speed;
  event.impulse_n_s = std::sqrt(2 * kBulletKg * energy_j);
  event.energy_j = energy_j;
  event.outcome = verdict.outcome;
  scatter_chips(surface, verdict.chips_count, verdict.surface_energy_j, event);
  event.mark_index = add_mark(surface, verdict.surface_energy_j);
  cue({in_round_, surface.position_world_m, surface.normal_world, energy_j, event.impulse_n_s, speed, lead, surface.material,
       2 * kBulletRadiusM, 0});
  log(event);
}

void Game::break_body(const contact::BodyState& body, const Tag& tag, const Vec3d& normal) noexcept {
  const Thing& thing = catalogue_.of(tag.thing);
  (void)world_->remove(body.id);
  ++counters_.broken;
  const Rotation R_world_body = Rotation::from(body.q_world_body);
  double volume = 0;
  for (const Piece& piece : thing.pieces) volume += piece.hull->volume_m3;
  int heard = 0;
  for (const Piece& piece : thing.pieces) {
    const Vec3d arm = R_world_body * piece.offset_m;
    contact::BodySpec spec;
    spec.shape = contact::Shape::convex(*piece.hull);
    spec.material = body.material;
    spec.mass_kg = body.mass_kg * piece.hull->volume_m3 / volume;
    // A piece that lay against the surface starts in front of it: behind it nothing would hold it.
    spec.position_world_m = body.position_world_m + arm;
    map::DistanceSample place;
    if (room_.sample(spec.position_world_m, place) && static_cast<double>(place.distance_m) < kPieceClearM)
      spec.position_world_m += normal * (kPieceClearM - static_cast<double>(place.distance_m));
    spec.q_world_body = body.q_world_body;
    // The pieces go on as they went, but not into what was struck; what the cracks did not take drives them apart.
    spec.velocity_world_m_per_s = body.velocity_world_m_per_s * 0.7 + body.angular_velocity_world_rad_per_s.cross(arm) +
                                  arm.normalized() * dice_.between(0.2, 0.7);
    spec.velocity_world_m_per_s += normal * (dice_.between(0.1, 0.6) - std::min(0.0, spec.velocity_world_m_per_s.dot(normal)));
    spec.angular_velocity_world_rad_per_s =
        body.angular_velocity_world_rad_per_s +
        Vec3d{dice_.between(-8, 8), dice_.between(-8, 8), dice_.between(-8, 8)};
    spec.is_debris = true;
    Tag shard;
    shard.is_debris = true;
    shard.color = tag.color;
    shard.has_color = tag.has_color;
    shard.expires = time_ + kPieceLife;
    contact::BodyId id;
    if (!spawn(spec, shard, id)) break;
    if (heard++ < kBreakCues)
      cue({in_round_ + rt::Duration{static_cast<std::int64_t>(dice_.between(0, 2.5e7))}, spec.position_world_m,
           normal, 0.3 * contact::breaking_energy_j(thing.build, thing.material, materials_) / kBreakCues, 0, 2, body.material,
           body.material, 2 * piece.hull->radius_m, 2 * piece.hull->radius_m});
  }
}

void Game::scatter_chips(const Surface& surface, int count, double energy_j, GameEvent& event) noexcept {
  const contact::BreakPattern pattern = materials_.fracture_of(surface.material).pattern;
  for (int i = 0; i < count; ++i) {
    const Vec3d direction = dice_.above(surface.normal_world);
    const double speed = dice_.between(0.6, 1.6) * std::min(3.0, 1 + 0.4 * std::sqrt(energy_j));
    contact::BodySpec spec;
    spec.shape = contact::Shape::convex(catalogue_.chip(pattern));
    spec.material = surface.material < kMaterialCount ? surface.material : material_from_name("other");
    spec.position_world_m = surface.position_world_m + surface.normal_world * 0.012 + direction * 0.01;
    spec.velocity_world_m_per_s = (direction + surface.normal_world * 0.6) * speed;
    spec.angular_velocity_world_rad_per_s = {dice_.between(-30, 30), dice_.between(-30, 30), dice_.between(-30, 30)};
    spec.is_debris = true;
    Tag tag;
    tag.is_debris = true;
    tag.has_color = true;
    tag.color = surface.color;
    tag.expires = time_ + kChipLife;
    contact::BodyId id;
    if (!spawn(spec, tag, id)) break;
    ++counters_.chips;
    ++event.chips_count;
    event.chips_mass_kg += contact::volume_m3(spec.shape) * materials_.of(spec.material).density_kg_per_m3;
    event.chips_speed_m_per_s += spec.velocity_world_m_per_s.norm();
  }
  if (event.chips_count > 0) event.chips_speed_m_per_s /= event.chips_count;
}

std::int32_t Game::add_mark(const Surface& surface, double energy_j) noexcept {
  const contact::FractureProperties& fracture = materials_.fracture_of(surface.material);
  if (fracture.decal == DecalKind::none || marks_.empty() || !(energy_j > 0)) return -1;
  const auto index = static_cast<std::int32_t>(counters_.marks);
  Mark& mark = marks_[static_cast<std::size_t>(counters_.marks++ % marks_.size())];
  mark.kind = fracture.decal;
  mark.position_world_m = surface.position_world_m;
  mark.normal_world = surface.normal_world.cast<float>();
  mark.radius_m = static_cast<float>(fracture.decal_radius_m * cube_root(std::min(energy_j, 1000.0)));
  mark.color = surface.color;
  mark.seed = dice_.next();
  return index;
}

void Game::log(GameEvent event) noexcept {
  if (events_count_ == events_.size()) {
    ++counters_.events_dropped;
    return;
  }
  event.frame = frame_;
  events_[events_count_++] = event;
}

void Game::cue(const SoundCue& sound) noexcept {
  if (cues_count_ < cues_.size())
    cues_[cues_count_++] = sound;
  else
    ++counters_.cues_dropped;
}

BodyLook Game::look_of(const contact::BodyState& body) const {
  const Tag* tag = tag_of(body.id);
  BodyLook look;
  look.color = tag != nullptr && tag->has_color ? tag->color : material_color(body.material);
  if (body.shape.kind == contact::ShapeKind::hull) look.hull_index = catalogue_.index_of(*body.shape.hull);
  return look;
}

}  // namespace tactus::interact
