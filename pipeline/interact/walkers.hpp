// The walkers of a script: puts each onto the floor when its moment has come, and lets it walk.
//
//   inputs    the newest frame's view, the room under the condition that bodies touch it by, virtual bodies
//   outputs   poses; what happened: put down, arrived, stuck
//   budget    0.3 ms a round for one: an agent's step (agent.hpp), or kPlacesPerRound places looked at
//   memory    one planned slice, 0.34 MB a walker
//   late      as an agent
//   lost      the caller leaves the round out: everyone stands where they are
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "pipeline/contact/world.hpp"
#include "pipeline/interact/agent.hpp"
#include "pipeline/interact/schedule.hpp"
#include "pipeline/interact/script.hpp"
#include "pipeline/interact/surroundings.hpp"
#include "rt/slice.hpp"

namespace tactus::interact {

/// What became of a walker: waiting: it was put down; arrived; stuck.
struct WalkerNews {
  std::size_t index = 0;  // in its script
  AgentState state = AgentState::waiting;
};

struct WalkerCounters {
  std::uint64_t placed = 0, arrivals = 0, stuck = 0;
  std::uint64_t places_tried = 0;  // until the map knew a fitting one
};

/// Thread-bound.
class Walkers {
 public:
  static std::size_t bytes_needed();
  /// Boot. The room's context outlives this; `gravity_world` must not be zero.
  void bind(rt::Slice& slice, std::span<const Walker> script, const contact::DistanceField& room,
            const Vec3d& gravity_world);

  /// One round with a view that can be believed. As long as the map knows no place for a walker the search
  /// goes on, from where the view is then: on the floor, the lowest level ground met, where it can be seen;
  /// from the fourth search on anywhere that fits, on the lowest. Returns how many news were written. Step;
  /// no heap, bounded.
  std::size_t step(std::uint64_t frames_since_tracking, rt::Duration since_tracking, rt::Duration duration,
                   const View& view, std::span<const contact::BodyState> bodies,
                   std::span<WalkerNews, 2 * kWalkersMax> news) noexcept;

  /// As many as the script has; one that was not put down yet is not placed.
  [[nodiscard]] std::span<const Agent> agents() const { return std::span(agents_).first(count_); }
  [[nodiscard]] const WalkerCounters& counters() const { return counters_; }
  /// Of all together.
  [[nodiscard]] double walked_m() const;

  static constexpr std::size_t kPlacesPerRound = 8;

 private:
  /// A search for the nearest place around a point, some places a round.
  struct Search {
    bool is_begun = false, is_found = false, is_done = false;
    int searches = 0;                     // begun
    double u_m = 0, v_m = 0, from_m = 0;  // rays go down from there
    double way_u = 1, way_v = 0;          // to the next place
    std::size_t next = 0;
    double lowest_m = 0, best_height_m = 0;  // of all level ground met; of the best place
    CellCoord best;
  };
  void look_around(std::size_t index, const Vec3d& middle_world_m,
                   std::span<const contact::BodyState> bodies) noexcept;
  bool find_place(std::size_t index, const View& view) noexcept;
  [[nodiscard]] std::optional<double> ground_below(std::size_t index, CellCoord cell,
                                                   double from_m) const noexcept;
  [[nodiscard]] bool fits(std::size_t index, CellCoord cell, double height_m) const noexcept;
  [[nodiscard]] bool is_in_view(std::size_t index, CellCoord cell, double height_m,
                                const View& view) const noexcept;

  std::array<Walker, kWalkersMax> script_{};
  std::array<Agent, kWalkersMax> agents_;
  std::array<Surroundings, kWalkersMax> surroundings_;
  std::array<Search, kWalkersMax> searches_{};
  std::size_t count_ = 0;
  WalkerCounters counters_;
};

}  // namespace tactus::interact
