// The games stage: throws and shoots what a script or a hand asks for, and makes of each impact what its materials say:
// things break into pieces, bullets leave marks, chips fly. And the script's walkers go about in between (walkers.hpp).
//
//   inputs    the newest frame's view, the room (distance, materials, rays), orders of a hand, a duration
//   outputs   events, marks on surfaces, sound cues, walkers; bodies in contact::World
//   budget    with the physics below 2 ms a round; a round that breaks four plates 0.2 ms more than one that breaks none
//   memory    one planned slice: things with their pieces, a tag a body, marks, events, cues, walkers
//   late      time is the caller's; nothing is caught up here
//   full      no slot for a new body: the oldest debris goes first, then the order is refused and counted; the oldest mark
//             gives way to the newest; events and cues beyond the plan are counted
//   lost      without a pose nothing is thrown or shot and walkers stand; what flies goes on flying
#pragma once

#include <cstdint>
#include <span>

#include "hal/camera.hpp"
#include "pipeline/contact/fracture.hpp"
#include "pipeline/contact/world.hpp"
#include "pipeline/interact/dice.hpp"
#include "pipeline/interact/schedule.hpp"
#include "pipeline/interact/things.hpp"
#include "pipeline/interact/walkers.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::interact {

struct GameConfig {
  std::size_t bodies_capacity = 64;
  std::size_t events_capacity = 1024;
  std::size_t marks_capacity = 128;
  std::size_t cues_capacity = 64;  // of one round
  Vec3d gravity_world_m_per_s2{0, -9.81, 0};
};

enum class GameEventKind : std::uint8_t { thrown, shot, contact, broke, hit, walk };
inline constexpr std::array<std::string_view, 6> kGameEventNames = {"throw", "shot", "contact", "break", "hit", "walk"};

/// Something that happened. Debris makes none, but for what tore it off.
struct GameEvent {
  GameEventKind kind = GameEventKind::contact;
  hal::FrameHeader frame;              // shown with it
  std::int32_t order_index = -1;       // of the throw, shot or walker that began it, in its script; -1: a hand's
  std::uint16_t body_index = 0;        // slot in World
  std::int32_t other_body_index = -1;  // of a contact, the slot of what was met; -1: a real surface
  Vec3d position_world_m, normal_world;  // of a throw and a shot: from where, and the direction, unit
  MaterialId body_material = kUnknownMaterial;
  MaterialId material = kUnknownMaterial;  // of the surface, most likely one; of the other body
  float probability = 0;                   // of that material
  double impulse_n_s = 0, impact_speed_m_per_s = 0, energy_j = 0;
  contact::Outcome outcome = contact::Outcome::intact;
  std::int32_t chips_count = 0;
  double chips_mass_kg = 0, chips_speed_m_per_s = 0;  // all together; their mean
  std::int32_t mark_index = -1;                       // counts up from 0 over the session; -1: none
  // Of a walker; `material` is that of the ground it stands on, the normal is its heading.
  AgentState walker_state = AgentState::waiting;      // waiting: it was put down
  double walked_m = 0;
};

/// A mark on a real surface.
struct Mark {
  DecalKind kind = DecalKind::none;
  Vec3d position_world_m;
  Vec3f normal_world;
  float radius_m = 0;
  Rgb8 color;  // of the surface around it
  std::uint32_t seed = 0;
};

/// An impact to be heard.
struct SoundCue {
  rt::Duration delay;  // from the beginning of the round
  Vec3d position_world_m, normal_world;  // zero: unknown
  double energy_j = 0, impulse_n_s = 0, impact_speed_m_per_s = 0;
  MaterialId body_material = kUnknownMaterial, surface_material = kUnknownMaterial;
  double body_size_m = 0.1, other_size_m = 0;  // longest way through; other_size_m 0: the room
};

struct GameCounters {
  std::uint64_t throws = 0, shots = 0, misses = 0;    // a miss: the shot met nothing
  std::uint64_t orders_refused = 0;                   // no slot, or no pose
  std::uint64_t broken = 0, chips = 0, marks = 0;
  std::uint64_t debris_recycled = 0;                  // before its time, to make room
  std::uint64_t events_dropped = 0, cues_dropped = 0;
};

/// How a body is to be drawn, beyond its shape and material.
struct BodyLook {
  Rgb8 color;
  std::size_t hull_index = 0;  // in catalogue().hulls(), for hulls
};

/// Thread-bound: the present thread's.
class Game {
 public:
  Game() = default;
  Game(const Game&) = delete;
  Game& operator=(const Game&) = delete;

  static std::size_t bytes_needed(const GameConfig& config);
  /// Boot. The table is copied; the room's context outlives the game.
  rt::Result<void> bind(rt::Slice slice, const GameConfig& config, Script script, const contact::MaterialTable& materials,
                        const contact::DistanceField& room);

  /// One round: what is due is thrown and shot, the world goes on by `duration` in single steps, each step's impacts are
  /// dealt with before the next. `is_tracked`: the view can be believed. Cues of the round before are gone. Step; no heap.
  /// ok | full (World's work memory).
  rt::Status step(const View& view, bool is_tracked, const hal::FrameHeader& frame, rt::Duration duration,
                  contact::World& world) noexcept;

  /// A hand's order, done at once; `when` is not looked at. ok | full | lost (no pose yet). Step.
  rt::Status throw_now(const Throw& what, contact::World& world) noexcept;
  rt::Status shoot_now(const Shot& shot, contact::World& world) noexcept;

  [[nodiscard]] std::span<const GameEvent> events() const { return events_.first(events_count_); }
  /// Newest last, up to marks_capacity; in ring order, which does not matter to who draws them.
  [[nodiscard]] std::span<const Mark> marks() const { return marks_.first(std::min<std::size_t>(counters_.marks, marks_.size())); }
  /// Of the last round.
  [[nodiscard]] std::span<const SoundCue> cues() const { return cues_.first(cues_count_); }
  [[nodiscard]] BodyLook look_of(const contact::BodyState& body) const;
  [[nodiscard]] const ThingCatalogue& catalogue() const { return catalogue_; }
  [[nodiscard]] const GameCounters& counters() const { return counters_; }
  [[nodiscard]] const Walkers& walkers() const { return walkers_; }
  [[nodiscard]] std::size_t orders_left() const { return schedule_.left(); }

 private:
  /// What is known of a body besides its physics, by its slot.
  struct Tag {
    std::uint16_t generation = 0;
    ThingKind thing = ThingKind::plain;
    bool is_debris = false, has_color = false;
    double bullet_energy_j = 0;  // > 0: a flying bullet
    Rgb8 color;
    std::int32_t order_index = -1;
    rt::Duration expires{};  // 0: never
  };
  struct Surface;

  [[nodiscard]] const contact::DistanceField& aimed_at() const {
    return view_.seen.sample_fn != nullptr ? view_.seen : room_;
  }
  [[nodiscard]] const Tag* tag_of(contact::BodyId id) const;
  [[nodiscard]] const contact::BodyState* state_of(contact::BodyId id) const;
  [[nodiscard]] Surface surface_at(const Vec3d& position_world_m, const Vec3d& normal_world) const;
  rt::Status launch(const Throw& what, const Start& start, std::int32_t order_index) noexcept;
  rt::Status fire(const Shot& shot, std::int32_t order_index) noexcept;
  bool spawn(const contact::BodySpec& spec, const Tag& tag, contact::BodyId& id) noexcept;
  bool make_room() noexcept;
  void remove_expired() noexcept;
  void walk(rt::Duration duration) noexcept;
  void react(const contact::ContactEvent& event) noexcept;
  void judge(const contact::ContactEvent& event, contact::BodyId body, contact::BodyId other, const Vec3d& normal) noexcept;
  void bullet_hit(const Surface& surface, double energy_j, double speed_m_per_s, std::int32_t order_index) noexcept;
  bool shoot_bodies(const AimedRay& ray, double range_m, const Shot& shot, std::int32_t order_index) noexcept;
  void break_body(const contact::BodyState& body, const Tag& tag, const Vec3d& normal_world) noexcept;
  void scatter_chips(const Surface& surface, int count, double energy_j, GameEvent& event) noexcept;
  std::int32_t add_mark(const Surface& surface, double energy_j) noexcept;
  void log(GameEvent event) noexcept;
  void cue(const SoundCue& cue) noexcept;

  GameConfig config_;
  contact::MaterialTable materials_;
  ThingCatalogue catalogue_;
  Schedule schedule_;
  Walkers walkers_;
  contact::DistanceField room_;
  std::span<Tag> tags_;
  std::span<GameEvent> events_;
  std::span<Mark> marks_;
  std::span<SoundCue> cues_;
  std::size_t events_count_ = 0, cues_count_ = 0;

  // Of the round.
  View view_;
  bool has_view_ = false;
  hal::FrameHeader frame_;
  contact::World* world_ = nullptr;
  rt::Duration in_round_{};

  std::uint64_t frames_ = 0;       // that the sensor took since the first that was seen, that one included
  std::uint64_t first_sequence_ = 0;
  rt::Duration since_tracking_{};
  rt::Duration time_{};
  Dice dice_{1};
  GameCounters counters_;
};

}  // namespace tactus::interact
