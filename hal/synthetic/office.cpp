// An office, 4.8 x 4.2 x 2.6 m: desk under a brick wall, window to the left, a seated visitor, shelves, a
// kitchenette to the right; the camera walks in from the door side.
#include <array>

#include "hal/synthetic/deterministic_math.hpp"
#include "hal/synthetic/furniture.hpp"
#include "hal/synthetic/rooms.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr double kHalfWidth = 2.4, kHalfDepth = 2.1, kHeight = 2.6, kWall = 0.1;

struct OfficeFinishes {
  FinishId carpet, brick, grey_paint, panel, screen, key, paper, poster, leather, skin, hair, shirt, trousers,
      shoe, tile, water, apple, banana, bread, cardboard, red_paint, cupboard, stone, coat, binder_blue,
      binder_red, binder_grey, board, globe, bottle_glass, cork, orange_ceramic, screen2, tile_floor;
};

OfficeFinishes make_finishes(SceneBuilder& b) {
  OfficeFinishes f;
  f.carpet = b.finish(Material::carpet, {Pattern::weave, {84, 94, 114}, {136, 142, 156}, 12, 0.8, 0.7, 61});
  f.brick = b.finish(Material::brick, {Pattern::bricks, {172, 104, 78}, {200, 194, 184}, 10, 0.75, 0.5, 62});
  f.grey_paint =
      b.finish(Material::painted, {Pattern::plain, {206, 208, 204}, {178, 182, 182}, 4, 1.1, 0.3, 63});
  f.panel =
      b.finish(Material::plastic, {Pattern::tiles, {250, 250, 244}, {226, 226, 222}, 2, 0.6, 0.1, 64}, 0.9F);
  f.screen =
      b.finish(Material::other, {Pattern::print, {34, 42, 58}, {150, 200, 170}, 22, 0.44, 0.3, 65}, 0.8F);
  f.screen2 =
      b.finish(Material::other, {Pattern::picture, {60, 90, 140}, {200, 150, 90}, 4, 0.5, 0.3, 66}, 0.7F);
  f.key = b.finish(Material::plastic, {Pattern::tiles, {54, 54, 58}, {20, 20, 22}, 16, 0.32, 0.3, 67});
  f.paper = b.finish(Material::paper, {Pattern::print, {244, 242, 236}, {40, 40, 60}, 24, 0.3, 0.2, 68});
  f.poster = b.finish(Material::paper, {Pattern::picture, {220, 200, 150}, {60, 110, 120}, 4, 0.8, 0.3, 69});
  f.leather = b.finish(Material::leather, {Pattern::noise, {50, 46, 46}, {82, 74, 70}, 12, 0.4, 0.4, 70});
  f.skin = b.finish(Material::skin, {Pattern::noise, {226, 178, 148}, {206, 150, 120}, 5, 0.3, 0.3, 71});
  f.hair = b.finish(Material::hair, {Pattern::stripes, {78, 50, 32}, {112, 76, 48}, 12, 0.16, 0.6, 72});
  f.shirt = b.finish(Material::fabric, {Pattern::checks, {150, 54, 58}, {220, 200, 180}, 8, 0.24, 0.3, 73});
  f.trousers = b.finish(Material::fabric, {Pattern::weave, {54, 68, 104}, {90, 106, 140}, 10, 0.25, 0.5, 74});
  f.shoe = b.finish(Material::leather, {Pattern::noise, {104, 62, 34}, {74, 42, 22}, 8, 0.2, 0.4, 75});
  f.tile = b.finish(Material::tile, {Pattern::tiles, {226, 228, 222}, {120, 130, 130}, 4, 0.5, 0.25, 76});
  f.tile_floor = b.finish(Material::tile, {Pattern::checks, {190, 184, 172}, {96, 92, 92}, 4, 0.8, 0.3, 77});
  f.water = b.finish(Material::water, {Pattern::noise, {96, 150, 176}, {176, 210, 220}, 4, 0.3, 0.3, 78});
  f.apple = b.finish(Material::food, {Pattern::noise, {124, 168, 52}, {196, 190, 80}, 5, 0.12, 0.4, 79});
  f.banana = b.finish(Material::food, {Pattern::noise, {226, 190, 60}, {180, 140, 40}, 6, 0.15, 0.4, 80});
  f.bread = b.finish(Material::food, {Pattern::noise, {196, 140, 78}, {140, 88, 42}, 6, 0.14, 0.4, 81});
  f.cardboard =
      b.finish(Material::paper, {Pattern::stripes, {184, 142, 96}, {170, 128, 82}, 16, 0.4, 0.4, 82});
  f.red_paint = b.finish(Material::painted, {Pattern::plain, {196, 30, 30}, {150, 20, 22}, 4, 0.3, 0.4, 83});
  f.cupboard =
      b.finish(Material::painted, {Pattern::plain, {96, 132, 126}, {76, 110, 106}, 4, 0.8, 0.35, 84});
  f.stone = b.finish(Material::stone, {Pattern::speckle, {168, 160, 144}, {110, 104, 96}, 4, 0.35, 0.6, 85});
  f.coat = b.finish(Material::fabric, {Pattern::weave, {96, 84, 60}, {140, 126, 92}, 12, 0.4, 0.5, 86});
  f.binder_blue =
      b.finish(Material::plastic, {Pattern::stripes, {40, 70, 140}, {230, 230, 236}, 2, 0.5, 0.25, 87});
  f.binder_red =
      b.finish(Material::plastic, {Pattern::stripes, {150, 36, 40}, {236, 232, 226}, 2, 0.45, 0.25, 88});
  f.binder_grey =
      b.finish(Material::paper, {Pattern::speckle, {110, 112, 116}, {160, 160, 164}, 3, 0.4, 0.4, 89});
  f.board = b.finish(Material::plastic, {Pattern::print, {244, 246, 246}, {60, 80, 170}, 9, 1.3, 0.2, 90});
  f.globe = b.finish(Material::plastic, {Pattern::noise, {50, 104, 168}, {190, 176, 110}, 4, 0.3, 0.4, 91});
  f.bottle_glass =
      b.finish(Material::glass, {Pattern::noise, {40, 104, 62}, {86, 150, 104}, 3, 0.2, 0.3, 92});
  f.cork = b.finish(Material::wood, {Pattern::speckle, {190, 150, 104}, {130, 94, 58}, 5, 0.3, 0.5, 93});
  f.orange_ceramic =
      b.finish(Material::ceramic, {Pattern::stripes, {224, 122, 50}, {244, 226, 196}, 6, 0.2, 0.2, 94});
  return f;
}

void add_shell_of_room(SceneBuilder& b, const Palette& p, const OfficeFinishes& f,
                       const WallWithHole& window_wall, const Place& window) {
  b.begin("floor");
  b.box(f.carpet, {0, -kWall, 0}, {kHalfWidth + 0.3, kWall, kHalfDepth + 0.3});
  b.begin("kitchen floor");
  b.box(f.tile_floor, {1.85, 0.004, -0.55}, {0.62, 0.004, 1.15});
  b.begin("ceiling");
  b.box(f.grey_paint, {0, kHeight + kWall, 0}, {kHalfWidth + 0.3, kWall, kHalfDepth + 0.3});
  b.begin("back wall");
  b.box(f.brick, {0, kHeight / 2, -kHalfDepth - kWall}, {kHalfWidth + 0.3, kHeight / 2, kWall});
  b.begin("front wall");
  b.box(f.grey_paint, {0, kHeight / 2, kHalfDepth + kWall}, {kHalfWidth + 0.3, kHeight / 2, kWall});
  b.begin("right wall");
  b.box(f.grey_paint, {kHalfWidth + kWall, kHeight / 2, 0}, {kWall, kHeight / 2, kHalfDepth});
  b.begin("window wall", window);
  add_wall_with_hole(b, f.grey_paint, window_wall);
  b.begin("ceiling lights");
  for (const double x : {-1.0, 1.0}) {
    b.box(f.panel, {x, kHeight - 0.03, -0.7}, {0.30, 0.03, 0.60}, 0.01);
    b.box(p.steel, {x, kHeight - 0.02, -0.7}, {0.32, 0.02, 0.62});
  }
  b.begin("cable duct");
  b.box(p.white_plastic, {0.2, 0.16, -kHalfDepth + 0.02}, {2.0, 0.035, 0.02}, 0.004);
  for (const double x : {-1.7, -0.3, 0.35}) {
    b.box(p.white_plastic, {x, 0.16, -kHalfDepth + 0.043}, {0.04, 0.03, 0.004});
    b.sphere(p.black_plastic, {x, 0.16, -kHalfDepth + 0.043}, 0.012);
  }
}

void add_desk(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("desk", place);
  b.box(p.oak, {0, 0.725, 0}, {0.85, 0.015, 0.40}, 0.005);
  for (const double x : {-0.78, 0.78}) {
    b.box(p.steel, {x, 0.36, -0.30}, {0.025, 0.35, 0.025});
    b.box(p.steel, {x, 0.36, 0.30}, {0.025, 0.35, 0.025});
    b.box(p.steel, {x, 0.69, 0}, {0.02, 0.02, 0.30});
  }
  b.box(p.steel, {0, 0.55, -0.33}, {0.76, 0.12, 0.008});
}

void add_monitor(SceneBuilder& b, const Palette& p, FinishId screen, const Place& place) {
  b.begin("monitor", place);
  b.box(p.black_plastic, {0, 0.30, 0}, {0.27, 0.17, 0.022}, 0.008);
  b.box(screen, {0, 0.305, 0.020}, {0.25, 0.148, 0.005});
  b.box(p.black_plastic, {0, 0.14, -0.03}, {0.03, 0.13, 0.015}, 0.004);
  b.box(p.black_plastic, {0, 0.008, -0.01}, {0.13, 0.008, 0.09}, 0.006);
}

void add_desk_things(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("keyboard", place);
  b.box(p.black_plastic, {0.02, 0.010, 0.20}, {0.22, 0.010, 0.07}, 0.006);
  b.box(f.key, {0.02, 0.021, 0.20}, {0.21, 0.005, 0.06}, 0.003);
  b.begin("computer mouse", place);
  b.box(p.black_plastic, {0.34, 0.016, 0.21}, {0.03, 0.016, 0.05}, 0.015);
  b.rod(p.black_plastic, {0.34, 0.006, 0.16}, {0.28, 0.006, -0.20}, 0.005);
  b.begin("sheets of paper", place);
  b.box(f.paper, {-0.46, 0.005, 0.18}, {0.105, 0.005, 0.148}, 0, {12, 0, 0});
  b.box(f.paper, {-0.38, 0.013, 0.22}, {0.105, 0.004, 0.148}, 0, {-20, 0, 0});
  b.begin("pen pot", place);
  b.shell(p.steel, {0.62, 0, -0.10}, 0.04, 0.042, 0.10, 0.010);
  b.cylinder(p.steel, {0.62, 0, -0.10}, 0.038, 0.02);
  b.rod(f.red_paint, {0.61, 0.02, -0.10}, {0.65, 0.17, -0.11}, 0.005);
  b.rod(p.pine, {0.63, 0.02, -0.11}, {0.60, 0.18, -0.13}, 0.005);
  b.rod(p.black_plastic, {0.62, 0.02, -0.09}, {0.64, 0.16, -0.06}, 0.005);
  b.begin("telephone", place);
  b.box(p.black_plastic, {-0.70, 0.03, 0.08}, {0.09, 0.025, 0.10}, 0.012, {20, 12, 0});
  b.rod(p.black_plastic, {-0.76, 0.075, 0.00}, {-0.74, 0.075, 0.14}, 0.018);
  b.sphere(p.black_plastic, {-0.76, 0.065, 0.00}, 0.026);
  b.sphere(p.black_plastic, {-0.74, 0.060, 0.14}, 0.026);
  b.begin("desk lamp", place);
  b.frustum(p.brass, {0.72, 0, 0.12}, 0.09, 0.075, 0.025);
  b.rod(p.brass, {0.72, 0.025, 0.12}, {0.80, 0.28, 0.02}, 0.009);
  b.rod(p.brass, {0.80, 0.28, 0.02}, {0.62, 0.45, 0.12}, 0.008);
  b.sphere(p.brass, {0.80, 0.28, 0.02}, 0.018);
  b.shell(p.brass, {0.60, 0.35, 0.13}, 0.085, 0.035, 0.11, 0.010);
  b.sphere(p.shade_cloth, {0.60, 0.39, 0.13}, 0.032);
  b.begin("globe", place);
  b.frustum(p.walnut, {-0.70, 0, -0.22}, 0.075, 0.05, 0.025);
  b.cylinder(p.brass, {-0.70, 0.025, -0.22}, 0.010, 0.07);
  b.sphere(f.globe, {-0.70, 0.21, -0.22}, 0.115);
  b.torus(p.brass, {-0.70, 0.21, -0.22}, 0.128, 0.006, {0, 90, 20});
}

void add_office_chair(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("office chair", place);
  for (int i = 0; i < 5; ++i) {
    const auto [s, c] = sin_cos_turns(0.2 * i + 0.05);
    b.rod(p.black_plastic, {0, 0.11, 0}, {0.28 * c, 0.075, 0.28 * s}, 0.020);
    b.sphere(p.black_plastic, {0.28 * c, 0.032, 0.28 * s}, 0.032);
  }
  b.cylinder(p.steel, {0, 0.10, 0}, 0.026, 0.32);
  b.box(f.leather, {0, 0.46, 0}, {0.25, 0.05, 0.24}, 0.045);
  b.rod(p.black_plastic, {0, 0.42, -0.20}, {0, 0.66, -0.29}, 0.022);
  b.box(f.leather, {0, 0.82, -0.25}, {0.23, 0.28, 0.05}, 0.045, {0, -8, 0});
  for (const double x : {-0.28, 0.28}) {
    b.rod(p.black_plastic, {x, 0.46, -0.02}, {x, 0.66, -0.02}, 0.015);
    b.box(f.leather, {x, 0.68, 0.02}, {0.035, 0.02, 0.13}, 0.018);
  }
}

/// Sits on a chair (seat at 0.50 m), hands on the knees, looking along +z.
void add_visitor(SceneBuilder& b, const OfficeFinishes& f, const Place& place) {
  b.begin("visitor", place);
  b.rod(f.trousers, {-0.07, 0.60, -0.06}, {0.07, 0.60, -0.06}, 0.125);
  b.rod(f.shirt, {0, 0.70, -0.06}, {0, 0.90, -0.07}, 0.145);
  b.rod(f.shirt, {-0.12, 0.97, -0.07}, {0.12, 0.97, -0.07}, 0.085);
  for (const double side : {-1.0, 1.0}) {
    b.rod(f.shirt, {side * 0.19, 0.97, -0.06}, {side * 0.25, 0.72, 0.04}, 0.052);
    b.rod(f.skin, {side * 0.25, 0.72, 0.05}, {side * 0.13, 0.68, 0.27}, 0.038);
    b.sphere(f.skin, {side * 0.12, 0.68, 0.31}, 0.048);
    b.rod(f.trousers, {side * 0.10, 0.58, -0.02}, {side * 0.12, 0.56, 0.38}, 0.078);
    b.rod(f.trousers, {side * 0.12, 0.54, 0.39}, {side * 0.12, 0.14, 0.41}, 0.060);
    b.box(f.shoe, {side * 0.12, 0.045, 0.46}, {0.048, 0.045, 0.13}, 0.04);
    b.sphere(f.skin, {side * 0.108, 1.225, -0.04}, 0.026);
    b.sphere(f.hair, {side * 0.040, 1.255, 0.068}, 0.012);
  }
  b.cylinder(f.skin, {0, 1.03, -0.06}, 0.052, 0.10);
  b.sphere(f.skin, {0, 1.24, -0.03}, 0.112);
  b.sphere(f.skin, {0, 1.175, -0.005}, 0.078);
  b.sphere(f.skin, {0, 1.215, 0.085}, 0.018);
  b.sphere(f.hair, {0, 1.272, -0.062}, 0.122);
  b.rod(f.hair, {-0.075, 1.25, -0.11}, {-0.06, 1.08, -0.13}, 0.06);
  b.rod(f.hair, {0.075, 1.25, -0.11}, {0.06, 1.08, -0.13}, 0.06);
}

void add_bookcase(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("bookcase", place);
  for (const double x : {-0.44, 0.44}) b.box(p.walnut, {x, 0.95, 0.15}, {0.012, 0.95, 0.15});
  b.box(p.walnut, {0, 0.95, 0.006}, {0.44, 0.95, 0.006});
  for (const double y : {0.05, 0.42, 0.79, 1.16, 1.53, 1.888})
    b.box(p.walnut, {0, y, 0.15}, {0.43, 0.012, 0.148});
}

void add_kitchenette(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  // Local x runs along the wall, +z into the room; the sink is a hole between pieces of the worktop.
  b.begin("kitchen cupboards", place);
  b.box(p.black_plastic, {0, 0.05, 0.25}, {0.95, 0.05, 0.25});
  b.box(f.cupboard, {0, 0.40, 0.28}, {0.95, 0.30, 0.28});
  for (int i = 0; i < 4; ++i) {
    const double x = -0.7125 + 0.475 * i;
    b.box(f.cupboard, {x, 0.46, 0.57}, {0.228, 0.35, 0.010}, 0.004);
    b.rod(p.steel, {x - 0.06, 0.74, 0.60}, {x + 0.06, 0.74, 0.60}, 0.008);
  }
  b.begin("worktop", place);
  b.box(p.granite, {-0.60, 0.86, 0.30}, {0.38, 0.020, 0.31}, 0.006);
  b.box(p.granite, {0.62, 0.86, 0.30}, {0.36, 0.020, 0.31}, 0.006);
  b.box(p.granite, {0.02, 0.86, 0.07}, {0.25, 0.020, 0.08});
  b.box(p.granite, {0.02, 0.86, 0.56}, {0.25, 0.020, 0.05});
  b.begin("sink", place);
  b.box(p.steel, {-0.23, 0.81, 0.33}, {0.012, 0.075, 0.19}, 0.005);
  b.box(p.steel, {0.27, 0.81, 0.33}, {0.012, 0.075, 0.19}, 0.005);
  b.box(p.steel, {0.02, 0.81, 0.145}, {0.26, 0.075, 0.012}, 0.005);
  b.box(p.steel, {0.02, 0.81, 0.515}, {0.26, 0.075, 0.012}, 0.005);
  b.begin("water in the sink", place);
  b.box(f.water, {0.02, 0.78, 0.33}, {0.245, 0.070, 0.185});
  b.begin("tap", place);
  b.cylinder(p.steel, {0.02, 0.88, 0.08}, 0.022, 0.05);
  b.rod(p.steel, {0.02, 0.92, 0.08}, {0.02, 1.12, 0.08}, 0.012);
  b.rod(p.steel, {0.02, 1.12, 0.08}, {0.02, 1.15, 0.15}, 0.012);
  b.rod(p.steel, {0.02, 1.15, 0.15}, {0.02, 1.10, 0.22}, 0.012);
  b.rod(p.steel, {0.05, 0.93, 0.08}, {0.10, 0.97, 0.08}, 0.008);
  b.begin("splashback", place);
  b.box(f.tile, {0, 1.15, 0.006}, {0.95, 0.27, 0.006});
  b.begin("wall cupboards", place);
  b.box(f.cupboard, {-0.50, 1.85, 0.16}, {0.45, 0.34, 0.16}, 0.004);
  for (const double x : {-0.73, -0.27}) {
    b.box(f.cupboard, {x, 1.85, 0.325}, {0.215, 0.33, 0.008}, 0.004);
    b.sphere(p.steel, {x + (x < -0.5 ? 0.17 : -0.17), 1.60, 0.345}, 0.014);
  }
  b.box(p.oak, {0.50, 1.60, 0.11}, {0.42, 0.012, 0.11}, 0.004);
  b.begin("kettle", place);
  b.frustum(p.steel, {-0.72, 0.88, 0.28}, 0.095, 0.06, 0.17);
  b.sphere(p.black_plastic, {-0.72, 1.06, 0.28}, 0.02);
  b.torus(p.black_plastic, {-0.72, 1.06, 0.28}, 0.075, 0.010, {90, 90, 0});
  b.rod(p.steel, {-0.66, 0.97, 0.28}, {-0.59, 1.03, 0.28}, 0.016);
  b.begin("bottle", place);
  b.cylinder(f.bottle_glass, {0.86, 0.88, 0.14}, 0.038, 0.18);
  b.frustum(f.bottle_glass, {0.86, 1.06, 0.14}, 0.038, 0.014, 0.06);
  b.cylinder(f.bottle_glass, {0.86, 1.12, 0.14}, 0.014, 0.06);
  b.cylinder(f.cork, {0.86, 1.18, 0.14}, 0.011, 0.02);
  b.begin("plates on the shelf", place);
  for (int i = 0; i < 4; ++i) b.cylinder(p.white_ceramic, {0.30, 1.615 + 0.014 * i, 0.11}, 0.10, 0.011);
  b.begin("bread on a board", place);
  b.box(p.pine, {-0.42, 0.888, 0.38}, {0.16, 0.008, 0.11}, 0.006, {-12, 0, 0});
  b.rod(f.bread, {-0.50, 0.944, 0.36}, {-0.36, 0.944, 0.40}, 0.05);
}

void add_water_cooler(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("water cooler", place);
  b.box(p.white_plastic, {0, 0.46, 0}, {0.16, 0.46, 0.16}, 0.03);
  b.box(p.black_plastic, {0, 0.70, 0.155}, {0.10, 0.10, 0.012}, 0.004);
  b.rod(p.steel, {0, 0.74, 0.16}, {0, 0.74, 0.20}, 0.010);
  b.begin("water bottle", place);
  b.frustum(f.water, {0, 0.92, 0}, 0.07, 0.135, 0.10);
  b.cylinder(f.water, {0, 1.02, 0}, 0.135, 0.26);
  b.torus(f.water, {0, 1.10, 0}, 0.132, 0.012);
  b.torus(f.water, {0, 1.20, 0}, 0.132, 0.012);
}

void add_filing_cabinet(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("filing cabinet", place);
  b.box(p.steel, {0, 0.52, 0}, {0.23, 0.52, 0.28}, 0.004);
  for (int i = 0; i < 3; ++i) {
    const double y = 0.20 + 0.33 * i;
    b.box(p.steel, {0, y, 0.285}, {0.21, 0.15, 0.010}, 0.004);
    b.rod(p.black_metal, {-0.06, y + 0.06, 0.315}, {0.06, y + 0.06, 0.315}, 0.009);
    b.box(f.paper, {0, y + 0.11, 0.293}, {0.05, 0.018, 0.005});
  }
}

void add_sculpture(SceneBuilder& b, const OfficeFinishes& f, const Place& place) {
  b.begin("stone sculpture", place);
  b.box(f.stone, {0, 0.03, 0}, {0.10, 0.03, 0.08}, 0.008);
  b.rod(f.stone, {-0.04, 0.07, 0}, {0.03, 0.20, 0.01}, 0.045);
  b.torus(f.stone, {0.02, 0.30, 0}, 0.075, 0.032, {25, 80, 0});
}

void add_coat_stand(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("coat stand", place);
  b.frustum(p.black_metal, {0, 0, 0}, 0.18, 0.14, 0.025);
  b.cylinder(p.black_metal, {0, 0.02, 0}, 0.018, 1.72);
  for (int i = 0; i < 4; ++i) {
    const auto [s, c] = sin_cos_turns(0.25 * i + 0.1);
    b.rod(p.black_metal, {0, 1.62, 0}, {0.13 * c, 1.72, 0.13 * s}, 0.009);
    b.sphere(p.black_metal, {0.13 * c, 1.72, 0.13 * s}, 0.016);
  }
  b.begin("coat", place);
  b.rod(f.coat, {0.10, 1.56, 0.08}, {0.16, 0.86, 0.12}, 0.10);
  b.rod(f.coat, {0.04, 1.50, 0.14}, {0.03, 0.90, 0.20}, 0.075);
  b.rod(f.coat, {0.18, 1.48, 0.02}, {0.24, 0.98, 0.02}, 0.055);
  b.begin("hat", place);
  b.cylinder(f.trousers, {-0.02, 1.745, -0.02}, 0.15, 0.012);
  b.frustum(f.trousers, {-0.02, 1.755, -0.02}, 0.095, 0.075, 0.10);
}

void add_round_table(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("glass table", place);
  b.cylinder(p.clear_glass, {0, 0.46, 0}, 0.36, 0.012);
  b.torus(p.steel, {0, 0.466, 0}, 0.362, 0.011);
  for (int i = 0; i < 3; ++i) {
    const auto [s, c] = sin_cos_turns(i / 3.0 + 0.08);
    b.rod(p.steel, {0.10 * c, 0.44, 0.10 * s}, {0.30 * c, 0.013, 0.30 * s}, 0.012);
  }
  b.torus(p.steel, {0, 0.44, 0}, 0.11, 0.010);
}

void add_extinguisher(SceneBuilder& b, const Palette& p, const OfficeFinishes& f, const Place& place) {
  b.begin("fire extinguisher", place);
  b.cylinder(f.red_paint, {0, 0, 0.09}, 0.075, 0.38);
  b.sphere(f.red_paint, {0, 0.38, 0.09}, 0.075);
  b.cylinder(p.black_metal, {0, 0.44, 0.09}, 0.02, 0.05);
  b.rod(p.black_metal, {0, 0.49, 0.06}, {0, 0.51, 0.16}, 0.010);
  b.rod(p.black_plastic, {0.03, 0.46, 0.09}, {0.10, 0.30, 0.09}, 0.010);
  b.rod(p.black_plastic, {0.10, 0.30, 0.09}, {0.085, 0.12, 0.10}, 0.012);
}

void add_desk_fan(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("fan", place);
  b.frustum(p.white_plastic, {0, 0, 0}, 0.09, 0.07, 0.03);
  b.rod(p.white_plastic, {0, 0.03, -0.02}, {0, 0.22, -0.02}, 0.015);
  b.rod(p.white_plastic, {0, 0.24, -0.05}, {0, 0.24, 0.0}, 0.035);
  for (const double z : {-0.02, 0.06}) b.torus(p.steel, {0, 0.24, z}, 0.13, 0.006, {0, 90, 0});
  for (int i = 0; i < 4; ++i)
    b.box(p.black_plastic, {0, 0.24, 0.02}, {0.115, 0.028, 0.005}, 0.005, {0, 18, 45.0 * i});
}

void add_door(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("door", place);
  b.box(p.pine, {0, 1.01, 0.02}, {0.42, 1.01, 0.02}, 0.004);
  for (const double y : {0.55, 1.45}) b.box(p.oak, {0, y, 0.042}, {0.28, 0.32, 0.008}, 0.005);
  b.box(p.white_paint, {-0.47, 1.04, 0.03}, {0.045, 1.04, 0.03}, 0.004);
  b.box(p.white_paint, {0.47, 1.04, 0.03}, {0.045, 1.04, 0.03}, 0.004);
  b.box(p.white_paint, {0, 2.08, 0.03}, {0.515, 0.045, 0.03}, 0.004);
  b.rod(p.brass, {-0.34, 1.02, 0.04}, {-0.34, 1.02, 0.09}, 0.011);
  b.rod(p.brass, {-0.34, 1.02, 0.09}, {-0.23, 1.02, 0.09}, 0.011);
}

}  // namespace

Scene::Parts make_office() {
  SceneBuilder b;
  const Palette p = make_palette(b);
  const OfficeFinishes f = make_finishes(b);
  b.room({-kHalfWidth, 0, -kHalfDepth}, {kHalfWidth, kHeight, kHalfDepth});

  const Place window{{-kHalfWidth, 0, -0.3}, 90};
  const WallWithHole window_wall{2 * kHalfDepth + 0.9, kHeight, -0.75, 0.75, 0.95, 2.20};
  add_shell_of_room(b, p, f, window_wall, window);
  add_window(b, p, window, window_wall);
  add_radiator(b, p.white_paint, p.steel, {{-kHalfWidth, 0.02, -0.3}, 90}, 1.2);
  add_pot_plant(b, p, f.orange_ceramic, {{-kHalfWidth + 0.10, 0.953, -0.62}, 0}, 0.30);

  const Place desk{{-1.05, 0, -kHalfDepth + 0.45}, 0};
  add_desk(b, p, desk);
  const double top_y = 0.74;
  add_monitor(b, p, f.screen, {{-1.32, top_y, -kHalfDepth + 0.32}, 12});
  add_monitor(b, p, f.screen2, {{-0.74, top_y, -kHalfDepth + 0.32}, -12});
  add_desk_things(b, p, f, {{-1.05, top_y, -kHalfDepth + 0.45}, 0});
  add_mug(b, f.orange_ceramic, f.water, {{-0.62, top_y, -kHalfDepth + 0.66}, 40});
  add_office_chair(b, p, f, {{-0.95, 0, -0.72}, 200});
  add_framed_picture(b, p.black_metal, f.poster, {{-1.62, 1.72, -kHalfDepth}, 0}, 0.52, 0.72);
  b.begin("whiteboard", {{-0.62, 1.66, -kHalfDepth}, 0});
  b.box(f.board, {0, 0, 0.012}, {0.55, 0.36, 0.012});
  for (const double y : {-0.37, 0.37}) b.box(p.steel, {0, y, 0.016}, {0.57, 0.012, 0.016}, 0.004);
  for (const double x : {-0.56, 0.56}) b.box(p.steel, {x, 0, 0.016}, {0.012, 0.36, 0.016}, 0.004);
  b.box(p.steel, {0, -0.39, 0.04}, {0.40, 0.006, 0.03}, 0.004);
  b.rod(f.red_paint, {-0.1, -0.375, 0.045}, {0.01, -0.375, 0.045}, 0.009);

  add_bookcase(b, p, {{0.66, 0, -kHalfDepth + 0.01}, 0});
  const std::array<FinishId, 4> spines = {f.binder_blue, f.binder_red, f.binder_grey, p.walnut};
  add_books(b, spines, {{0.25, 1.172, -kHalfDepth + 0.05}, 0}, 15, 11);
  add_books(b, spines, {{0.25, 0.802, -kHalfDepth + 0.05}, 0}, 11, 12);
  add_books(b, spines, {{0.25, 1.542, -kHalfDepth + 0.05}, 0}, 8, 13);
  add_books(b, spines, {{0.25, 0.432, -kHalfDepth + 0.05}, 0}, 13, 14);
  b.begin("storage box", {{0.90, 1.675, -kHalfDepth + 0.17}, 0});
  b.box(f.cardboard, {0, 0, 0}, {0.14, 0.125, 0.13});
  b.box(f.cardboard, {0, 0.10, 0}, {0.15, 0.032, 0.14});
  add_desk_fan(b, p, {{0.44, 1.90, -kHalfDepth + 0.18}, 10});
  add_sculpture(b, f, {{0.88, 1.90, -kHalfDepth + 0.16}, 0});

  add_filing_cabinet(b, p, f, {{-2.14, 0, -kHalfDepth + 0.30}, 0});
  add_pot_plant(b, p, p.white_ceramic, {{-2.14, 1.04, -kHalfDepth + 0.28}, 0}, 0.55);
  add_water_cooler(b, p, f, {{1.36, 0, -kHalfDepth + 0.20}, -10});
  add_chair(b, p.oak, f.coat, {{0.62, 0, -1.02}, -6});
  add_visitor(b, f, {{0.62, 0, -1.02}, -6});
  add_round_table(b, p, {{0.02, 0, -0.55}, 0});
  const std::array<FinishId, 2> magazines = {f.poster, f.binder_blue};
  add_book_stack(b, magazines, p.ivory_paper, {{-0.06, 0.477, -0.60}, 30}, 2);

  const Place kitchen{{kHalfWidth, 0, -0.62}, -90};
  add_kitchenette(b, p, f, kitchen);
  add_fruit_bowl(b, p.white_ceramic, f.apple, f.banana, {{1.98, 0.88, -0.05}, 60});
  add_mug(b, f.orange_ceramic, p.soil, {{2.02, 0.88, -1.28}, 200});
  add_mug(b, p.white_ceramic, p.soil, {{2.29, 1.612, -0.06}, 130});
  add_door(b, p, {{kHalfWidth, 0, 1.05}, -90});
  add_extinguisher(b, p, f, {{kHalfWidth, 0.55, 0.48}, -90});
  add_coat_stand(b, p, f, {{-2.02, 0, 0.78}, 30});
  add_waste_bin(b, p.black_plastic, f.paper, {{-1.72, 0, -1.20}, 0});
  b.begin("cardboard box", {{-1.92, 0, -0.55}, 24});
  b.box(f.cardboard, {0, 0.16, 0}, {0.22, 0.16, 0.17});
  b.box(f.cardboard, {0.26, 0.30, 0}, {0.09, 0.006, 0.17}, 0, {0, 0, -38});
  b.box(f.cardboard, {-0.27, 0.31, 0}, {0.09, 0.006, 0.17}, 0, {0, 0, 30});
  add_wall_clock(b, p, {{0.22, 2.28, -kHalfDepth}, 0});

  b.light({-0.4, 2.3, -0.5}, 0.66F);
  b.light({-2.1, 1.7, -0.3}, 0.42F);
  b.light({1.2, 2.3, 0.9}, 0.42F);
  b.loop({.center_world_m = {0.05, 1.50, 1.32},
          .yaw_degrees = 0,
          .pitch_degrees = -17,
          .right_m = 0.42,
          .up_m = 0.09,
          .forward_m = 0.18,
          .yaw_sweep_degrees = 41,
          .pitch_sweep_degrees = 6,
          .roll_sweep_degrees = -4});
  return b.take();
}

}  // namespace tactus::hal::synthetic
