// What became of each order of a script: the log of the games read from one order's side.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pipeline/interact/game.hpp"

namespace tactus::firmware {

/// The pointers lead into the log.
struct FollowedOrder {
  std::size_t index = 0;                        // in the script, of its kind
  const interact::GameEvent* begun = nullptr;   // the throw or the shot
  const interact::GameEvent* impact = nullptr;  // the first on a real surface; null: there was none
  bool met_body_first = false;                  // another virtual thing, before that

  [[nodiscard]] contact::Outcome outcome() const {
    return impact != nullptr ? impact->outcome : contact::Outcome::through;
  }
};

/// Throws of a script that have left the hand, in its order. Pure; allocates.
std::vector<FollowedOrder> follow_throws(std::span<const interact::GameEvent> log);
/// Shots; a bullet that flies is followed to where it arrives.
std::vector<FollowedOrder> follow_shots(std::span<const interact::GameEvent> log);

}  // namespace tactus::firmware
