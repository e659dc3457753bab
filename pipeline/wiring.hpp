// The wiring as a table for people: which stage runs on which thread, what travels between them, how much may
// wait and what full means. pipeline.hpp holds the same edges as members; both take their depths from the
// same constants, and tests/bench holds the table to the stages of budgets.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "pipeline/budgets.hpp"
#include "pipeline/memory_plan.hpp"
#include "pipeline/messages.hpp"

namespace tactus {

/// A thread of the realtime runner, in falling priority. Lockstep runs their rounds one after the other on
/// one thread: capture, spine, segment, refine, present, sound.
struct WiringThread {
  const char* name;      // as in StageBudget::thread
  const char* schedule;  // where the system allows it; else normal
  const char* round;     // what starts one
};

inline constexpr std::array<WiringThread, 6> kWiringThreads = {{
    {"capture", "FIFO 70", "the sensor has a frame"},
    {"spine", "FIFO 60", "a frame waits"},
    {"present", "FIFO 50", "every contact period"},
    {"segment", "normal", "a keyframe waits"},
    {"refine", "normal", "a frame was integrated"},
    {"sound", "normal", "a frame was presented"},
}};

/// Something that one stage leaves for another.
struct WiringEdge {
  std::optional<Stage> from, to;  // nothing: anyone who asks
  const char* type;               // in rt/, or what else holds it
  const char* carries;
  std::size_t depth;  // items that may wait; 0: a state, read where it is
  const char* when_full;
};

inline constexpr std::array<WiringEdge, 19> kWiringEdges = {{
    {Stage::capture, Stage::register_frame, "DropOldestRing", "FrameId", kFramesWaiting,
     "the oldest frame is dropped and counted"},
    {Stage::register_frame, Stage::track, "call", "depth, half-resolution depth and colour", 0, "cannot be"},
    {Stage::track, Stage::integrate, "call", "pose, status", 0, "cannot be"},
    {Stage::integrate, Stage::predict, "call", "map", 0,
     "the map evicts far blocks long unseen; when none is, allocation is refused; both are counted"},
    {Stage::predict, Stage::track, "call", "model view, for the next frame", 0, "cannot be"},
    {Stage::predict, Stage::segment, "DropOldestRing", "KeyframeSlot, one frame in 12 or by need", 1,
     "the waiting keyframe is replaced and counted"},
    {Stage::segment, Stage::fuse, "SpscRing", "KeyframeSlot with scores", kKeyframeSlots,
     "cannot be: it holds every slot there is"},
    {Stage::fuse, Stage::refine, "map", "blocks whose labels changed, copied whole", 0,
     "a torn or recycled block is read again, or waits for the next round"},
    {Stage::refine, Stage::fuse, "SpscRing", "RefinedBlock", kRefinedBlocksWaiting,
     "the refiner keeps it and goes on when there is room"},
    {std::nullopt, Stage::fuse, "SpscRing", "SurfacePin", kPinsWaiting, "the caller is told"},
    {Stage::fuse, Stage::contact, "DropOldestRing", "FrameId with its verdict", 1,
     "the frame before is dropped: the newest is drawn"},
    {Stage::track, std::nullopt, "Seqlock", "PoseSample", 0, "overwritten"},
    {Stage::integrate, Stage::contact, "map::Reader", "distances and materials near bodies", 0,
     "a torn or recycled block is read again, or is unknown"},
    {Stage::fuse, Stage::render, "map::Reader", "materials for the overlay", 0,
     "a torn or recycled block is read again, or is unknown"},
    {Stage::contact, Stage::render, "call", "bodies, marks, newest frame", 0, "cannot be"},
    {Stage::contact, Stage::sound, "SpscRing", "SoundCue, one an impact", kCuesWaiting, "the sound is left out and counted"},
    {Stage::track, Stage::render, "Seqlock", "PoseSample, latched when drawing begins", 0, "overwritten"},
    {Stage::track, Stage::sound, "Seqlock", "PoseSample: where the ears are", 0, "overwritten"},
    {Stage::integrate, Stage::sound, "map::Reader", "walls that throw sound back", 0,
     "a torn or recycled block is read again, or is unknown"},
}};

namespace detail {
constexpr bool is_on_an_edge(Stage stage) {
  for (const WiringEdge& edge : kWiringEdges)
    if (edge.from == stage || edge.to == stage) return true;
  return false;
}
constexpr bool every_stage_is_wired() {
  for (const StageBudget& budget : kBudgets)
    if (!is_on_an_edge(budget.stage)) return false;
  return true;
}
}  // namespace detail
static_assert(detail::every_stage_is_wired());

}  // namespace tactus
