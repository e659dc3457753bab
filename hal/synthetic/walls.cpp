// Scenes in which tracking is degenerate: one flat wall, and three planes that meet in a corner.
#include "hal/synthetic/rooms.hpp"
#include "hal/synthetic/scene_builder.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr LoopSpec kLoop{.center_world_m = {0, 1.25, 0},
                         .yaw_degrees = 0,
                         .pitch_degrees = 0,
                         .right_m = 0.40,
                         .up_m = 0.10,
                         .forward_m = 0.20,
                         .yaw_sweep_degrees = 12,
                         .pitch_sweep_degrees = 4,
                         .roll_sweep_degrees = 4};

}  // namespace

Scene::Parts make_wall() {
  SceneBuilder b;
  const FinishId paper =
      b.finish(Material::wallpaper, {Pattern::picture, {196, 160, 120}, {70, 90, 130}, 7, 0.8, 0.4, 3});
  b.room({-5, -2, -1.5}, {5, 5, 1.5});
  b.begin("wall");
  b.box(paper, {0, 1.25, -1.6}, {12, 12, 0.1});
  b.light({0, 2.2, 0.3}, 0.9F);
  b.loop(kLoop);
  return b.take();
}

Scene::Parts make_corner() {
  SceneBuilder b;
  const FinishId floor =
      b.finish(Material::wood, {Pattern::planks, {176, 128, 82}, {112, 74, 42}, 8, 1.12, 0.5, 1});
  const FinishId left =
      b.finish(Material::wallpaper, {Pattern::damask, {206, 190, 160}, {130, 92, 82}, 3, 0.66, 0.3, 2});
  const FinishId right =
      b.finish(Material::brick, {Pattern::bricks, {164, 78, 56}, {186, 178, 164}, 8, 0.6, 0.5, 3});
  b.room({-3, 0, -3}, {3, 4, 3});
  b.begin("floor");
  b.box(floor, {0, -0.1, 0}, {6, 0.1, 6});
  // The walls stand at 45 degrees to the view and meet in front of the camera at z = -2.2.
  b.begin("left wall", {{0, 0, -2.2}, 45});
  b.box(left, {-3, 2, -0.1}, {3, 2, 0.1});
  b.begin("right wall", {{0, 0, -2.2}, -45});
  b.box(right, {3, 2, -0.1}, {3, 2, 0.1});
  b.light({0, 2.6, 0.2}, 1.0F);
  LoopSpec loop = kLoop;
  loop.pitch_degrees = -16;
  b.loop(loop);
  return b.take();
}

}  // namespace tactus::hal::synthetic
