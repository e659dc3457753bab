// THE latency table, and who gives way when late.
//
// Late means skip, never catch up. Who gives way first: segment (a keyframe that comes while the network is
// busy replaces the one waiting) and refine (a fixed share of work a frame, on
// the lowest priority), then fuse (labels wait a frame), then render (a picture is dropped), then
// integrate (every second frame). Register, track and predict never: the pose and what it is tracked against
// come first.
#pragma once

#include <array>
#include <cstdint>

#include "rt/runner.hpp"
#include "rt/time.hpp"

namespace tactus {

enum class Stage : std::uint8_t {
  capture,
  register_frame,
  track,
  integrate,
  predict,
  fuse,
  segment,
  refine,
  contact,
  render,
  sound
};
inline constexpr std::size_t kStagesCount = 11;

struct StageBudget {
  Stage stage;
  const char* name;  // in summary.json, the trace and the report
  const char* thread;
  rt::Duration p99, max;  // one 3.4 GHz core, 640x480, 1 cm; zero: none
  rt::WhenLate when_late;
};

using rt::operator""_ms;
using rt::operator""_us;

inline constexpr std::array<StageBudget, kStagesCount> kBudgets = {{
    {Stage::capture, "capture", "capture", 8_ms, 20_ms, rt::WhenLate::run},
    {Stage::register_frame, "register", "spine", 1_ms, 2_ms, rt::WhenLate::run},
    {Stage::track, "track", "spine", 4_ms, 60_ms,
     rt::WhenLate::run},  // max: a search of all proposals when lost
    {Stage::integrate, "integrate", "spine", 6_ms, 10_ms, rt::WhenLate::skip},
    {Stage::predict, "predict", "spine", 4_ms, 6_ms, rt::WhenLate::run},
    {Stage::fuse, "fuse", "spine", 4_ms, 6_ms, rt::WhenLate::skip},
    {Stage::segment, "segment", "segment", 300_ms, 400_ms, rt::WhenLate::run},
    {Stage::refine, "refine", "refine", 30_ms, 60_ms,
     rt::WhenLate::run},  // 2 ms a frame on average; p99: one lattice of a region
    {Stage::contact, "contact", "present", 2_ms, 4_ms, rt::WhenLate::run},
    {Stage::render, "render", "present", 16_ms, 33_ms, rt::WhenLate::skip},
    {Stage::sound, "sound", "sound", 8_ms, 20_ms, rt::WhenLate::run},  // one video frame's worth of samples
}};

constexpr const StageBudget& budget_of(Stage stage) { return kBudgets[static_cast<std::size_t>(stage)]; }

namespace detail {
constexpr bool budgets_are_in_order() {
  for (std::size_t i = 0; i < kStagesCount; ++i)
    if (static_cast<std::size_t>(kBudgets[i].stage) != i) return false;
  return true;
}
}  // namespace detail
static_assert(detail::budgets_are_in_order());

/// Sensor to drawn pose at 30 Hz: a frame is done before the next one comes.
inline constexpr rt::Duration kFrameBudget = 33_ms;

}  // namespace tactus
