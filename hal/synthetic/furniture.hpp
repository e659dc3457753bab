// Furniture that both rooms use. Every function makes one object, standing at `place` with its front along
// the place's +z.
#pragma once

#include <span>
#include <string>

#include "hal/synthetic/scene_builder.hpp"

namespace tactus::hal::synthetic {

/// Surfaces that both rooms share.
struct Palette {
  FinishId white_paint, oak, walnut, pine, brass, steel, black_metal, ivory_paper, white_plastic,
      black_plastic, white_ceramic, clear_glass, mirror, sky, leaf, soil, shade_cloth, granite;
};
Palette make_palette(SceneBuilder& builder);

/// A wall along local x with a rectangular hole; local z is its thickness, the inside face at z = 0.
struct WallWithHole {
  double width_m, height_m;
  double hole_left_m, hole_right_m, hole_bottom_m, hole_top_m;  // left and right from the wall's middle
};
void add_wall_with_hole(SceneBuilder& builder, FinishId finish, const WallWithHole& wall);

/// Two sashes, the right one swung open into the room, sill, frame and a sky outside; fills a WallWithHole.
void add_window(SceneBuilder& builder, const Palette& palette, const Place& place, const WallWithHole& wall);
/// One length of cloth hanging in folds along local x.
void add_curtain(SceneBuilder& builder, FinishId cloth, const Place& place, double width_m, double height_m);
void add_table_lamp(SceneBuilder& builder, const Palette& palette, FinishId base, const Place& place);
void add_floor_lamp(SceneBuilder& builder, const Palette& palette, const Place& place);
void add_pot_plant(SceneBuilder& builder, const Palette& palette, FinishId pot, const Place& place,
                   double height_m);
/// Books side by side along local x, spines to the front.
void add_books(SceneBuilder& builder, std::span<const FinishId> covers, const Place& place, int books_count,
               std::uint32_t seed);
/// Books lying on each other.
void add_book_stack(SceneBuilder& builder, std::span<const FinishId> covers, FinishId pages,
                    const Place& place, int books_count);
void add_mug(SceneBuilder& builder, FinishId finish, FinishId content, const Place& place);
void add_fruit_bowl(SceneBuilder& builder, FinishId bowl, FinishId apple, FinishId banana,
                    const Place& place);
void add_framed_picture(SceneBuilder& builder, FinishId frame, FinishId picture, const Place& place,
                        double width_m, double height_m);
void add_waste_bin(SceneBuilder& builder, FinishId finish, FinishId content, const Place& place);
/// A pressed-metal radiator of round ribs.
void add_radiator(SceneBuilder& builder, FinishId finish, FinishId pipe, const Place& place, double width_m);
void add_chair(SceneBuilder& builder, FinishId wood, FinishId seat, const Place& place);
void add_wall_clock(SceneBuilder& builder, const Palette& palette, const Place& place);

}  // namespace tactus::hal::synthetic
