// What a small walker thinks of each of the 23 materials as ground, and of a cell that may be any of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pipeline/label/material.hpp"

namespace tactus::interact {

/// Costs are in sixteenths of what the same way costs on carpet, in integers: sums of a path are exact, so
/// that equal paths compare equal on every machine.
inline constexpr std::uint16_t kCostUnit = 16;

struct Walkability {
  std::string_view material;
  double cost;      // per length, carpet = 1
  bool is_avoided;  // no ground; `cost` then weighs the chance that it is this after all
  std::string_view why;
};

/// In the order of kMaterialNames.
inline constexpr std::array<Walkability, kMaterialCount> kWalkability{{
    {"brick", 1.3, false, "hard, with joints"},
    {"carpet", 1.0, false, "made to walk on"},
    {"ceramic", 2.0, false, "glazed, mostly crockery: slippery and breaks"},
    {"fabric", 2.0, false, "gives way and wrinkles"},
    {"foliage", 10, true, "leaves carry nobody"},
    {"food", 10, true, "one does not walk on it"},
    {"glass", 10, true, "breaks, and where it seems to be may be air"},
    {"hair", 10, true, "somebody's"},
    {"leather", 2.0, false, "an upholstered seat gives way"},
    {"metal", 1.5, false, "smooth and cold"},
    {"mirror", 10, true, "what is seen in it is not there"},
    {"other", 2.0, false, "nobody knows what it is"},
    {"painted", 1.2, false, "boards and walls, firm"},
    {"paper", 1.5, false, "slides away underfoot"},
    {"plastic", 1.2, false, "firm"},
    {"polishedstone", 1.5, false, "slippery"},
    {"skin", 10, true, "somebody's"},
    {"sky", 10, true, "no ground at all"},
    {"stone", 1.1, false, "firm, uneven"},
    {"tile", 1.1, false, "made to walk on, smooth"},
    {"wallpaper", 1.5, false, "as paper"},
    {"water", 10, true, "wet"},
    {"wood", 1.0, false, "made to walk on"},
}};

/// Ground that nothing has labelled yet.
inline constexpr double kUnlabelledCost = 1.5;
/// More than this chance of avoided materials blocks a cell.
inline constexpr float kAvoidedShareMax = 0.5F;

struct GroundCost {
  std::uint16_t cost = 0;   // expected, in 1 / kCostUnit; at least kCostUnit; 0 when blocked
  float avoided_share = 0;  // probability of all avoided materials together
};

/// The expected cost over the posterior; blocked where the avoided materials are the likelier. `best` is
/// kUnknownMaterial where nothing was labelled: then the distribution says nothing. Any phase, wait-free.
GroundCost ground_cost(const MaterialDistribution& posterior, MaterialId best) noexcept;

}  // namespace tactus::interact
