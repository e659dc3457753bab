// Every type that travels on an edge.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/camera.hpp"
#include "pipeline/segment/material_scores.hpp"
#include "rt/frame_pool.hpp"
#include "rt/status.hpp"

namespace tactus {

/// capture -> spine -> present, by FrameId. One sensor moment: depth, colour when there is any, exact labels
/// when the source knows them and they are asked for. Images are the sensor's own, in its units.
struct SensorFrame {
  hal::FrameHeader header;
  rt::HostTime captured;  // when the sensor handed it over
  std::span<std::uint16_t> raw_depth;
  std::span<std::uint8_t> rgb;
  std::span<std::uint8_t> labels;  // material ids; empty unless labels are taken from the source
  bool has_rgb = false;
  bool has_labels = false;
};

/// What the spine made of a frame; lies beside the frame's slot and is written before its id goes on.
struct FrameVerdict {
  rt::Status status = rt::Status::lost;
  std::uint32_t frame_index = 0;
  T_WorldDepth T_world_depth;
};

/// spine -> segment -> spine, by slot number. Holds what fusing needs from the moment the keyframe was taken.
struct Keyframe {
  std::uint32_t frame_index = 0;
  rt::SensorTime time;
  T_WorldDepth T_world_depth;  // of that moment: labels are fused with it, however late they come
  std::span<float> half_depth_m;
  std::span<std::uint64_t> pane_bits;  // of its pixels, PaneFiller::pane_bits(); empty when panes are not looked for
  std::span<std::uint8_t> rgb;  // empty when labels are taken from the source
  std::span<std::uint8_t> labels;
  segment::MaterialScores scores;  // segment's answer
  bool is_segmented = false;
};

using FrameRef = rt::FramePool<SensorFrame>::Ref;
using FrameLease = rt::FramePool<SensorFrame>::Lease;
using KeyframeSlot = std::uint32_t;

/// refine -> spine, by value. The spine takes all that wait once a frame, refine makes a few hundred a frame at most.
inline constexpr std::size_t kRefinedBlocksWaiting = 512;

/// application -> spine, by value: a person corrects one surface at a time.
inline constexpr std::size_t kPinsWaiting = 8;

/// present -> sound, by value: of two rounds of the games, which have 64 each, and as many again for a late sound thread.
inline constexpr std::size_t kCuesWaiting = 256;

inline constexpr std::size_t kKeyframeSlots = 4;  // segment 1 + waiting 1 + answered 1 + being filled 1

}  // namespace tactus
