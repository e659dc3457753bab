#include "hal/synthetic/furniture.hpp"

#include <algorithm>

#include "hal/synthetic/deterministic_math.hpp"

namespace tactus::hal::synthetic {

Palette make_palette(SceneBuilder& b) {
  Palette p;
  p.white_paint =
      b.finish(Material::painted, {Pattern::plain, {222, 218, 208}, {200, 194, 182}, 4, 0.9, 0.22, 1});
  p.oak = b.finish(Material::wood, {Pattern::grain, {190, 142, 88}, {138, 92, 48}, 6, 0.5, 0.6, 2});
  p.walnut = b.finish(Material::wood, {Pattern::grain, {120, 78, 48}, {66, 40, 24}, 7, 0.45, 0.6, 3});
  p.pine = b.finish(Material::wood, {Pattern::grain, {214, 178, 122}, {176, 128, 74}, 5, 0.4, 0.6, 4});
  p.brass = b.finish(Material::metal, {Pattern::noise, {196, 160, 84}, {140, 108, 48}, 6, 0.3, 0.3, 5});
  p.steel = b.finish(Material::metal, {Pattern::stripes, {158, 162, 168}, {132, 136, 142}, 12, 0.3, 0.3, 6});
  p.black_metal = b.finish(Material::metal, {Pattern::noise, {58, 58, 62}, {32, 32, 36}, 6, 0.3, 0.3, 7});
  p.ivory_paper = b.finish(Material::paper, {Pattern::print, {240, 236, 220}, {50, 50, 60}, 18, 0.3, 0.2, 8});
  p.white_plastic =
      b.finish(Material::plastic, {Pattern::plain, {226, 226, 224}, {196, 198, 202}, 4, 0.5, 0.25, 9});
  p.black_plastic =
      b.finish(Material::plastic, {Pattern::speckle, {46, 46, 50}, {70, 70, 76}, 4, 0.4, 0.3, 10});
  p.white_ceramic =
      b.finish(Material::ceramic, {Pattern::plain, {236, 234, 230}, {206, 208, 212}, 4, 0.3, 0.2, 11});
  p.clear_glass =
      b.finish(Material::glass, {Pattern::clouds, {176, 208, 222}, {214, 232, 238}, 3, 1.1, 0.2, 12}, 0.7F);
  p.mirror =
      b.finish(Material::mirror, {Pattern::clouds, {150, 164, 172}, {206, 214, 216}, 3, 1.6, 0.2, 13}, 0.4F);
  p.sky = b.finish(Material::sky, {Pattern::clouds, {120, 176, 232}, {240, 244, 250}, 3, 6.0, 0.2, 14}, 1.0F);
  p.leaf = b.finish(Material::foliage, {Pattern::leaves, {52, 112, 44}, {116, 160, 74}, 6, 0.25, 0.5, 15});
  p.soil = b.finish(Material::other, {Pattern::speckle, {72, 52, 38}, {112, 88, 66}, 4, 0.25, 0.5, 16});
  p.shade_cloth =
      b.finish(Material::fabric, {Pattern::weave, {246, 226, 184}, {214, 184, 134}, 10, 0.3, 0.4, 17}, 0.75F);
  p.granite = b.finish(Material::polishedstone,
                       {Pattern::speckle, {112, 108, 108}, {182, 172, 164}, 4, 0.4, 0.5, 18});
  return p;
}

void add_wall_with_hole(SceneBuilder& b, FinishId finish, const WallWithHole& w) {
  constexpr double kHalfThickness_m = 0.08;
  const double middle_y = w.height_m / 2;
  const double left = (w.hole_left_m + w.width_m / 2) / 2, right = (w.width_m / 2 - w.hole_right_m) / 2;
  b.box(finish, {-w.width_m / 2 + left, middle_y, -kHalfThickness_m}, {left, middle_y, kHalfThickness_m});
  b.box(finish, {w.width_m / 2 - right, middle_y, -kHalfThickness_m}, {right, middle_y, kHalfThickness_m});
  const double hole_middle = (w.hole_left_m + w.hole_right_m) / 2,
               hole_half = (w.hole_right_m - w.hole_left_m) / 2;
  b.box(finish, {hole_middle, w.hole_bottom_m / 2, -kHalfThickness_m},
        {hole_half, w.hole_bottom_m / 2, kHalfThickness_m});
  b.box(finish, {hole_middle, (w.hole_top_m + w.height_m) / 2, -kHalfThickness_m},
        {hole_half, (w.height_m - w.hole_top_m) / 2, kHalfThickness_m});
}

void add_window(SceneBuilder& b, const Palette& p, const Place& place, const WallWithHole& w) {
  b.begin("window", place);
  const double half = (w.hole_right_m - w.hole_left_m) / 2, height = w.hole_top_m - w.hole_bottom_m;
  const double x = (w.hole_left_m + w.hole_right_m) / 2, y = (w.hole_bottom_m + w.hole_top_m) / 2;
  constexpr double kBar = 0.025, kDepth = -0.05;
  b.box(p.white_paint, {x, w.hole_bottom_m + kBar, kDepth}, {half, kBar, 0.035});
  b.box(p.white_paint, {x, w.hole_top_m - kBar, kDepth}, {half, kBar, 0.035});
  b.box(p.white_paint, {w.hole_left_m + kBar, y, kDepth}, {kBar, height / 2, 0.035});
  b.box(p.white_paint, {w.hole_right_m - kBar, y, kDepth}, {kBar, height / 2, 0.035});
  b.box(p.white_paint, {x, y, kDepth}, {kBar, height / 2, 0.035});
  const double pane_half = half / 2 - kBar * 1.5, pane_height = height / 2 - 2 * kBar;
  b.box(p.clear_glass, {x - half / 2, y, kDepth}, {pane_half, pane_height, 0.005});

  b.begin("window sill", place);
  b.box(p.granite, {x, w.hole_bottom_m - 0.015, 0.07}, {half + 0.08, 0.018, 0.12}, 0.006);

  // The open sash, turned on its hinge at the right jamb.
  b.begin("open sash", place);
  constexpr double kOpen_degrees = 72;
  const auto [s, c] = sin_cos_degrees(kOpen_degrees);
  const double hinge_x = w.hole_right_m - kBar, hinge_z = 0.02, reach = pane_half + kBar;
  const Tilt open{kOpen_degrees, 0, 0};
  const auto at = [&](double along, double up) {
    return Vec3d{hinge_x - along * c, up, hinge_z + along * s};
  };
  b.box(p.clear_glass, at(reach, y), {pane_half, pane_height, 0.005}, 0, open);
  b.box(p.white_paint, at(kBar, y), {kBar, height / 2 - kBar, 0.02}, 0, open);
  b.box(p.white_paint, at(2 * reach - kBar, y), {kBar, height / 2 - kBar, 0.02}, 0, open);
  b.box(p.white_paint, at(reach, y + pane_height), {reach, kBar, 0.02}, 0, open);
  b.box(p.white_paint, at(reach, y - pane_height), {reach, kBar, 0.02}, 0, open);

  // Farther than the sensor reaches, as the sky is.
  b.begin("sky outside", place);
  b.box(p.sky, {0, 2.0, -9.0}, {14, 9, 0.2});
}

void add_curtain(SceneBuilder& b, FinishId cloth, const Place& place, double width_m, double height_m) {
  b.begin("curtain", place);
  const int folds_count = static_cast<int>(width_m / 0.07);
  for (int i = 0; i < folds_count; ++i) {
    const double x = -width_m / 2 + width_m * (i + 0.5) / folds_count;
    const double z = i % 2 == 0 ? 0.0 : 0.035;
    b.cylinder(cloth, {x, 0, z}, 0.043, height_m);
  }
}

void add_table_lamp(SceneBuilder& b, const Palette& p, FinishId base, const Place& place) {
  b.begin("table lamp", place);
  b.frustum(base, {0, 0, 0}, 0.075, 0.06, 0.025);
  b.sphere(base, {0, 0.09, 0}, 0.068);
  b.rod(p.brass, {0, 0.15, 0}, {0, 0.30, 0}, 0.010);
  b.sphere(p.shade_cloth, {0, 0.31, 0}, 0.03);
  b.shell(p.shade_cloth, {0, 0.24, 0}, 0.15, 0.10, 0.19, 0.012);
}

void add_floor_lamp(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("floor lamp", place);
  b.frustum(p.black_metal, {0, 0, 0}, 0.15, 0.12, 0.03);
  b.cylinder(p.black_metal, {0, 0.03, 0}, 0.012, 1.40);
  b.sphere(p.shade_cloth, {0, 1.50, 0}, 0.045);
  b.shell(p.shade_cloth, {0, 1.38, 0}, 0.21, 0.15, 0.27, 0.012);
}

void add_pot_plant(SceneBuilder& b, const Palette& p, FinishId pot, const Place& place, double height_m) {
  b.begin("pot plant", place);
  const double pot_height = 0.32 * height_m, radius = 0.17 * height_m;
  b.shell(pot, {0, 0, 0}, radius * 0.72, radius, pot_height, 0.02);
  b.frustum(p.soil, {0, 0.01, 0}, radius * 0.70, radius * 0.93, pot_height - 0.03);
  constexpr int kStems = 9;
  for (int i = 0; i < kStems; ++i) {
    const double turn = i * 0.381966;  // the golden angle: leaves stand in each other's gaps
    const auto [s, c] = sin_cos_turns(turn);
    const double rise = 0.45 + 0.055 * ((i * 5) % kStems), reach = 0.16 + 0.015 * ((i * 4) % kStems);
    const Vec3d foot{c * 0.02, pot_height - 0.03, s * 0.02};
    const Vec3d tip{c * reach * height_m, pot_height + rise * 0.68 * height_m, s * reach * height_m};
    b.rod(p.leaf, foot, tip, 0.008);
    const double yaw = -360 * turn + 90;
    b.box(p.leaf, tip + Vec3d{c, -0.15, s} * (0.07 * height_m), {0.055 * height_m, 0.006, 0.13 * height_m},
          0.006, {yaw, 22.0 + 4 * (i % 4), 0});
    b.box(p.leaf, (foot + tip) * 0.5 + Vec3d{c, 0.1, s} * (0.07 * height_m),
          {0.045 * height_m, 0.006, 0.10 * height_m}, 0.006, {yaw + 40, 10.0 + 5 * (i % 3), 12});
  }
}

void add_books(SceneBuilder& b, std::span<const FinishId> covers, const Place& place, int books_count,
               std::uint32_t seed) {
  b.begin("row of books", place);
  double x = 0;
  for (int i = 0; i < books_count; ++i) {
    const std::uint64_t bits = hash64(std::uint64_t{seed} * 1000 + static_cast<std::uint64_t>(i));
    const double half_width = 0.012 + 0.014 * static_cast<double>(uniform01(bits));
    const double half_height = 0.09 + 0.05 * static_cast<double>(uniform01(hash64(bits)));
    const double half_depth = 0.07 + 0.025 * static_cast<double>(uniform01(hash64(bits + 1)));
    const FinishId cover = covers[(bits >> 8) % covers.size()];
    // Every sixth leans a little.
    const double lean = i % 6 == 5 ? -6.0 : 0.0;
    b.box(cover, {x + half_width + (lean != 0 ? 0.012 : 0), half_height, half_depth},
          {half_width, half_height, half_depth}, 0.002, {0, 0, lean});
    x += 2 * half_width + 0.002 + (lean != 0 ? 0.02 : 0);
  }
}

void add_book_stack(SceneBuilder& b, std::span<const FinishId> covers, FinishId pages, const Place& place,
                    int books_count) {
  b.begin("stack of books", place);
  double y = 0;
  for (int i = 0; i < books_count; ++i) {
    const double half = 0.014 + 0.006 * (i % 3);
    const double yaw = (i * 37) % 23 - 11.0;
    const double shrink = 1 - 0.06 * i;
    b.box(pages, {0, y + half, 0}, {0.092 * shrink, half - 0.003, 0.126 * shrink}, 0, {yaw, 0, 0});
    const FinishId cover = covers[static_cast<std::size_t>(i) % covers.size()];
    b.box(cover, {0, y + 2 * half - 0.003, 0}, {0.10 * shrink, 0.005, 0.13 * shrink}, 0.002, {yaw, 0, 0});
    b.box(cover, {0, y + 0.005, 0}, {0.10 * shrink, 0.005, 0.13 * shrink}, 0.002, {yaw, 0, 0});
    y += 2 * half + 0.002;
  }
}

void add_mug(SceneBuilder& b, FinishId finish, FinishId content, const Place& place) {
  b.begin("mug", place);
  b.shell(finish, {0, 0, 0}, 0.036, 0.038, 0.10, 0.010);
  b.cylinder(content, {0, 0.004, 0}, 0.034, 0.076);
  b.torus(finish, {0.052, 0.05, 0}, 0.024, 0.006, {0, 90, 0});
}

void add_fruit_bowl(SceneBuilder& b, FinishId bowl, FinishId apple, FinishId banana, const Place& place) {
  b.begin("fruit bowl", place);
  b.frustum(bowl, {0, 0, 0}, 0.06, 0.075, 0.02);
  b.shell(bowl, {0, 0.015, 0}, 0.07, 0.15, 0.075, 0.012);
  const std::pair<Vec3d, double> apples[] = {{{-0.055, 0.075, 0.02}, 0.043},
                                             {{0.045, 0.075, 0.045}, 0.042},
                                             {{0.0, 0.078, -0.06}, 0.044},
                                             {{0.0, 0.135, 0.005}, 0.041}};
  for (const auto& [center, radius] : apples) b.sphere(apple, center, radius);
  for (int i = 0; i < 2; ++i) {
    const double z = 0.035 * i;
    b.rod(banana, {0.03, 0.10, -0.09 + z}, {0.09, 0.12, -0.04 + z}, 0.017);
    b.rod(banana, {0.09, 0.12, -0.04 + z}, {0.11, 0.155, 0.03 + z}, 0.016);
  }
}

void add_framed_picture(SceneBuilder& b, FinishId frame, FinishId picture, const Place& place, double width_m,
                        double height_m) {
  b.begin("framed picture", place);
  const double w = width_m / 2, h = height_m / 2;
  constexpr double kBar = 0.018;
  b.box(picture, {0, 0, 0.008}, {w, h, 0.008});
  b.box(frame, {0, h, 0.014}, {w + kBar, kBar, 0.014}, 0.004);
  b.box(frame, {0, -h, 0.014}, {w + kBar, kBar, 0.014}, 0.004);
  b.box(frame, {-w, 0, 0.014}, {kBar, h, 0.014}, 0.004);
  b.box(frame, {w, 0, 0.014}, {kBar, h, 0.014}, 0.004);
}

void add_waste_bin(SceneBuilder& b, FinishId finish, FinishId content, const Place& place) {
  b.begin("waste bin", place);
  b.cylinder(finish, {0, 0, 0}, 0.11, 0.015);
  b.shell(finish, {0, 0, 0}, 0.11, 0.14, 0.30, 0.012);
  b.torus(finish, {0, 0.296, 0}, 0.142, 0.010);
  b.sphere(content, {0.02, 0.22, 0.02}, 0.06);
  b.box(content, {-0.04, 0.21, -0.02}, {0.05, 0.035, 0.04}, 0.01, {30, 20, 15});
  b.cylinder(content, {0, 0.015, 0}, 0.105, 0.16);
}

void add_radiator(SceneBuilder& b, FinishId finish, FinishId pipe, const Place& place, double width_m) {
  b.begin("radiator", place);
  const int ribs_count = static_cast<int>(width_m / 0.09);
  for (int i = 0; i < ribs_count; ++i) {
    const double x = -width_m / 2 + width_m * (i + 0.5) / ribs_count;
    b.rod(finish, {x, 0.14, 0.06}, {x, 0.56, 0.06}, 0.034);
  }
  b.rod(finish, {-width_m / 2, 0.14, 0.06}, {width_m / 2, 0.14, 0.06}, 0.022);
  b.rod(finish, {-width_m / 2, 0.56, 0.06}, {width_m / 2, 0.56, 0.06}, 0.022);
  b.rod(pipe, {width_m / 2, 0.14, 0.06}, {width_m / 2 + 0.05, 0.14, 0.06}, 0.014);
  b.rod(pipe, {width_m / 2 + 0.05, 0.14, 0.06}, {width_m / 2 + 0.05, 0.0, 0.06}, 0.012);
  b.cylinder(pipe, {width_m / 2 + 0.05, 0.16, 0.06}, 0.02, 0.05);
}

void add_chair(SceneBuilder& b, FinishId wood, FinishId seat, const Place& place) {
  b.begin("chair", place);
  for (const double x : {-0.19, 0.19}) {
    b.rod(wood, {x, 0.017, 0.19}, {x * 0.95, 0.43, 0.18}, 0.017);
    b.rod(wood, {x, 0.017, -0.20}, {x * 0.97, 0.45, -0.19}, 0.017);
    b.rod(wood, {x * 0.97, 0.45, -0.19}, {x * 0.92, 0.90, -0.26}, 0.016);
    b.rod(wood, {x, 0.16, 0.185}, {x, 0.16, -0.195}, 0.010);
  }
  b.box(wood, {0, 0.44, 0}, {0.215, 0.015, 0.215}, 0.008);
  b.box(seat, {0, 0.475, 0.005}, {0.20, 0.026, 0.20}, 0.024);
  for (int i = 0; i < 3; ++i)
    b.box(wood, {0, 0.62 + 0.11 * i, -0.215 - 0.0165 * i}, {0.18, 0.028, 0.009}, 0.006, {0, -9, 0});
}

void add_wall_clock(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("wall clock", place);
  b.cylinder(p.ivory_paper, {0, 0, 0}, 0.135, 0.02, {0, 90, 0});
  b.torus(p.black_plastic, {0, 0, 0.02}, 0.14, 0.015, {0, 90, 0});
  b.rod(p.black_metal, {0, 0, 0.03}, {0.05, 0.045, 0.03}, 0.006);
  b.rod(p.black_metal, {0, 0, 0.03}, {-0.03, 0.09, 0.03}, 0.005);
}

}  // namespace tactus::hal::synthetic
