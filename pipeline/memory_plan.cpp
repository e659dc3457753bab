#include "pipeline/memory_plan.hpp"

#include <array>

#include "pipeline/map/pin_surface.hpp"
#include "pipeline/messages.hpp"
#include "pipeline/render/light_estimate.hpp"
#include "pipeline/render/renderer.hpp"
#include "pipeline/sound/sound_stage.hpp"
#include "rt/trace.hpp"

namespace tactus {
namespace {

rt::MemoryRow row(const char* name, std::initializer_list<rt::Holder> holders, std::size_t bytes_each,
                  const char* owner, const char* why) {
  rt::MemoryRow r;
  r.name = name;
  for (const rt::Holder& holder : holders) r.holders.push_back(holder);
  r.bytes_each = bytes_each;
  r.owner = owner;
  r.why = why;
  return r;
}

std::size_t pixels_count(const hal::Intrinsics& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

void plan_memory(const Profile& profile, const hal::RigCalibration& rig, const PlanOptions& options,
                 rt::MemoryPlan& plan) {
  const std::size_t n = pixels_count(rig.depth), half = n / 4;
  const std::size_t rgb = rig.has_color ? pixels_count(rig.color) * 3 : 0;
  const std::size_t labels = options.labels_from_source ? n : 0;
  const bool has_labels = options.scores_width > 0;
  const std::size_t map = map::Map::bytes_needed(profile.spine.map);
  plan.add(row("map", {{"blocks", 1}}, map, "map",
               "blocks x (voxels 1536 + colours 256 + labels 512 + refined labels 192 + header 32) + hash 16 "
               "a block"));
  plan.add(row("pins", {{"flood", 1}}, map::SurfacePinner::bytes_needed(profile.spine.map), "spine",
               "per block its key, its surface cells and those taken (20 B); the flood's edge"));
  plan.add(row("spine", {{"images", 1}}, Spine::bytes_needed(rig, profile.spine), "spine",
               "depth 2 B a pixel, tangent planes 4 B, half-resolution depth, colour and model view, "
               "brightness keyframes, keyframe store, panes"));
  plan.add(row(
      "frames",
      {{"capture", 1},
       {"waiting for spine", kFramesWaiting},
       {"spine", 1},
       {"waiting for present", 1},
       {"present", 1}},
      rt::bytes_of<std::uint16_t>(n) + rt::bytes_of<std::uint8_t>(rgb) + rt::bytes_of<std::uint8_t>(labels),
      "capture", "raw depth, colour and, when taken from the source, labels"));
  plan.add(row("frame pool", {{"slots", 1}}, rt::FramePool<SensorFrame>::bytes_needed(kFramesCount),
               "capture", "states and views of the frames"));
  if (has_labels) {
    const std::size_t scores =
        segment::MaterialScores::bytes_needed(options.scores_width, options.scores_height);
    plan.add(row(
        "keyframes", {{"segment", 1}, {"waiting", 1}, {"answered", 1}, {"being filled", 1}},
        rt::bytes_of<float>(half) +
            (profile.spine.closes_panes ? rt::bytes_of<std::uint64_t>(PaneFiller::pane_words_count(rig.depth)) : 0) +
            (options.labels_from_source ? rt::bytes_of<std::uint8_t>(n) : rt::bytes_of<std::uint8_t>(rgb)) +
            scores,
        "segment", "half-resolution depth, colour or labels, 23 probabilities per score pixel"));
  }
  if (options.network_bytes > 0)
    plan.add(row("network", {{"weights and activations", 1}}, options.network_bytes, "segment",
                 "XNNPACK's pool; not counted in the profile's limit"));
  plan.add(row("contact", {{"bodies and ODE", 1}}, contact::World::bytes_needed(world_config(profile)), "contact",
               "ODE's heap and step memory, fenced in"));
  plan.add(row("interact", {{"games", 1}}, interact::Game::bytes_needed(game_config(profile)), "present",
               "hulls of pieces and chips, a tag a body, events, marks, sound cues; grids and searches of two walkers"));
  if (options.has_sound)
    plan.add(row("sound", {{"clips", 1}}, sound::SoundStage::bytes_needed({}), "sound",
                 "clips of impacts of up to a second; OpenAL's own memory cannot be fenced in"));
  if (options.has_render) {
    render::RenderConfig config;
    config.camera = rig.has_color ? rig.color : rig.depth;
    const std::array<render::HullMesh, interact::ThingCatalogue::kHullsCount> hulls{};  // their number is what counts
    config.hulls = hulls;
    plan.add(row("render", {{"instances and rows", 1}}, render::Renderer::bytes_needed(config), "render",
                 "the driver's own memory cannot be fenced in: see mesa"));
    plan.add(row("light", {{"samples", 1}}, render::LightEstimate::bytes_needed(config.camera), "render",
                 "a normal and a colour of every 64th pixel"));
    const std::size_t pixels = pixels_count(config.camera);
    plan.add(row("picture", {{"depth, labels and colours", 1}},
                 rt::bytes_of<float>(pixels) + rt::bytes_of<MaterialId>(pixels) +
                     rt::bytes_of<std::uint8_t>(3 * pixels) + kFramesCount * rt::bytes_of<std::uint16_t>(half),
                 "render",
                 "the drawn camera's view of the real: metres, material ids; the picture read back; the model's half-size "
                 "depth beside each frame"));
  }
  plan.add(row("trace", {{"spine", 1}, {"present", 1}, {"segment", 1}, {"capture", 1}, {"refine", 1}, {"sound", 1}},
               rt::TraceRing::bytes_needed(profile.trace_records_count), "runner",
               "newest records of each thread"));
  if (has_labels && profile.refines_labels) {  // the last: it takes what is left
    const std::size_t used = plan.total_bytes() - options.network_bytes;
    const std::size_t left = profile.memory_bytes_max > used ? profile.memory_bytes_max - used : 0;
    const std::uint32_t blocks = profile.spine.map.blocks_capacity;
    plan.add(row("refine", {{"region", 1}},
                 map::LabelRefiner::bytes_needed(refine_within(profile.refine, blocks, left), blocks),
                 "refine",
                 "cells of a region with costs and marginals (24 columns), lattices of the three kernels"));
  }
  const auto add_outside = [&](const char* name, const char* holder, std::size_t bytes, const char* owner, const char* why) {
    if (bytes == 0) return;
    rt::MemoryRow outside = row(name, {{holder, 1}}, bytes, owner, why);
    outside.is_outside_arena = true;
    plan.add(outside);
  };
  add_outside("camera buffers", "frames", options.camera_buffers_bytes, "hal",
              "the device's own frames, or those of a recording decoded ahead; not counted in the profile's limit");
  add_outside("trajectory", "poses", options.poses_bytes, "spine",
              "an hour of a device at 30 Hz for trajectory.txt; not counted in the profile's limit");
}

map::RefineConfig refine_within(const map::RefineConfig& wanted, std::uint32_t blocks_capacity,
                                std::size_t bytes_max) {
  constexpr std::size_t kStep = 1024;
  map::RefineConfig config = wanted;
  for (std::size_t cells = wanted.crf.points_max / kStep * kStep; cells > kStep; cells -= kStep) {
    config.crf = map::RefineConfig::for_cells(cells, wanted.parameters).crf;
    if (map::LabelRefiner::bytes_needed(config, blocks_capacity) <= bytes_max) return config;
  }
  config.crf = map::RefineConfig::for_cells(kStep, wanted.parameters).crf;
  return config;
}

}  // namespace tactus
