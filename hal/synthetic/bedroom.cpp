// A bedroom, 4.6 x 4.0 x 2.5 m: bed under a papered wall, window and radiator to the left, fireplace and
// wardrobe to the right; the camera walks at the foot of the bed.
#include <array>

#include "hal/synthetic/furniture.hpp"
#include "hal/synthetic/rooms.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr double kHalfWidth = 2.3, kHalfDepth = 2.0, kHeight = 2.5, kWall = 0.1;

struct BedroomFinishes {
  FinishId floor, wallpaper, sage_paint, rug, rug_fringe, linen, duvet, blanket, cushion, curtain, leather,
      brick, hearth, marble, blue_ceramic, terracotta, red_cover, green_cover, blue_cover, painting,
      landscape, apple, banana, bread, wicker, ball, log, tea, tile, bear, water, petal;
};

BedroomFinishes make_finishes(SceneBuilder& b) {
  BedroomFinishes f;
  f.floor = b.finish(Material::wood, {Pattern::planks, {176, 128, 82}, {112, 74, 42}, 8, 1.12, 0.5, 21});
  f.wallpaper =
      b.finish(Material::wallpaper, {Pattern::damask, {206, 190, 160}, {150, 112, 92}, 3, 0.66, 0.2, 22});
  f.sage_paint =
      b.finish(Material::painted, {Pattern::plain, {176, 190, 170}, {150, 166, 148}, 4, 1.0, 0.28, 23});
  f.rug = b.finish(Material::carpet, {Pattern::damask, {150, 44, 44}, {226, 190, 130}, 4, 0.9, 0.35, 24});
  f.rug_fringe =
      b.finish(Material::carpet, {Pattern::weave, {220, 196, 150}, {150, 120, 90}, 8, 0.3, 0.5, 25});
  f.linen = b.finish(Material::fabric, {Pattern::weave, {238, 234, 226}, {198, 198, 204}, 6, 0.35, 0.4, 26});
  f.duvet = b.finish(Material::fabric, {Pattern::checks, {72, 102, 150}, {206, 212, 222}, 8, 0.96, 0.3, 27});
  f.blanket =
      b.finish(Material::fabric, {Pattern::stripes, {170, 96, 60}, {226, 200, 160}, 8, 0.5, 0.35, 28});
  f.cushion =
      b.finish(Material::fabric, {Pattern::damask, {206, 150, 54}, {246, 224, 168}, 4, 0.36, 0.3, 29});
  f.curtain =
      b.finish(Material::fabric, {Pattern::stripes, {126, 62, 78}, {176, 104, 112}, 6, 0.42, 0.4, 30});
  f.leather = b.finish(Material::leather, {Pattern::noise, {122, 70, 36}, {88, 46, 22}, 10, 0.4, 0.4, 31});
  f.brick = b.finish(Material::brick, {Pattern::bricks, {164, 78, 56}, {186, 178, 164}, 8, 0.6, 0.5, 32});
  f.hearth = b.finish(Material::stone, {Pattern::speckle, {136, 130, 118}, {96, 92, 86}, 4, 0.5, 0.6, 33});
  f.marble =
      b.finish(Material::polishedstone, {Pattern::noise, {222, 220, 214}, {150, 148, 150}, 3, 0.6, 0.4, 34});
  f.blue_ceramic =
      b.finish(Material::ceramic, {Pattern::damask, {228, 232, 238}, {42, 78, 150}, 5, 0.3, 0.2, 35});
  f.terracotta = b.finish(Material::ceramic, {Pattern::noise, {186, 98, 62}, {150, 72, 44}, 5, 0.3, 0.3, 36});
  f.red_cover =
      b.finish(Material::paper, {Pattern::stripes, {160, 40, 38}, {210, 180, 90}, 3, 0.21, 0.3, 37});
  f.green_cover =
      b.finish(Material::paper, {Pattern::stripes, {40, 96, 70}, {206, 196, 160}, 3, 0.19, 0.3, 38});
  f.blue_cover =
      b.finish(Material::paper, {Pattern::stripes, {44, 66, 124}, {190, 200, 214}, 3, 0.23, 0.3, 39});
  f.painting = b.finish(Material::paper, {Pattern::picture, {200, 120, 60}, {60, 80, 140}, 5, 0.7, 0.3, 40});
  f.landscape =
      b.finish(Material::paper, {Pattern::picture, {80, 130, 90}, {170, 200, 220}, 6, 0.5, 0.3, 41});
  f.apple = b.finish(Material::food, {Pattern::noise, {186, 44, 36}, {206, 160, 56}, 5, 0.12, 0.4, 42});
  f.banana = b.finish(Material::food, {Pattern::noise, {226, 190, 60}, {180, 140, 40}, 6, 0.15, 0.4, 43});
  f.bread = b.finish(Material::food, {Pattern::noise, {196, 140, 78}, {140, 88, 42}, 6, 0.14, 0.4, 44});
  f.wicker = b.finish(Material::wood, {Pattern::checks, {186, 144, 90}, {120, 84, 46}, 12, 0.4, 0.4, 45});
  f.ball = b.finish(Material::plastic, {Pattern::stripes, {214, 54, 60}, {240, 236, 226}, 3, 0.3, 0.2, 46});
  f.log = b.finish(Material::wood, {Pattern::noise, {104, 76, 52}, {58, 40, 28}, 12, 0.25, 0.6, 47});
  f.tea = b.finish(Material::water, {Pattern::plain, {120, 70, 30}, {96, 52, 20}, 4, 0.2, 0.3, 48});
  f.tile = b.finish(Material::tile, {Pattern::tiles, {88, 128, 140}, {214, 210, 200}, 4, 0.4, 0.4, 49});
  f.bear = b.finish(Material::fabric, {Pattern::noise, {160, 112, 66}, {122, 80, 44}, 16, 0.2, 0.5, 50});
  f.water = b.finish(Material::water, {Pattern::noise, {84, 134, 156}, {170, 206, 214}, 3, 0.3, 0.3, 51});
  f.petal = b.finish(Material::foliage, {Pattern::noise, {196, 50, 70}, {236, 120, 130}, 6, 0.1, 0.4, 52});
  return f;
}

void add_shell_of_room(SceneBuilder& b, const Palette& p, const BedroomFinishes& f,
                       const WallWithHole& window_wall, const Place& window) {
  b.begin("floor");
  b.box(f.floor, {0, -kWall, 0}, {kHalfWidth + 0.3, kWall, kHalfDepth + 0.3});
  b.begin("ceiling");
  b.box(p.white_paint, {0, kHeight + kWall, 0}, {kHalfWidth + 0.3, kWall, kHalfDepth + 0.3});
  b.begin("back wall");
  b.box(f.wallpaper, {0, kHeight / 2, -kHalfDepth - kWall}, {kHalfWidth + 0.3, kHeight / 2, kWall});
  b.begin("front wall");
  b.box(f.sage_paint, {0, kHeight / 2, kHalfDepth + kWall}, {kHalfWidth + 0.3, kHeight / 2, kWall});
  b.begin("right wall");
  b.box(f.sage_paint, {kHalfWidth + kWall, kHeight / 2, 0}, {kWall, kHeight / 2, kHalfDepth});
  b.begin("window wall", window);
  add_wall_with_hole(b, f.sage_paint, window_wall);
  b.begin("skirting boards");
  b.box(p.white_paint, {0, 0.045, -kHalfDepth + 0.008}, {kHalfWidth, 0.045, 0.008});
  b.box(p.white_paint, {-kHalfWidth + 0.008, 0.045, 0}, {0.008, 0.045, kHalfDepth});
  b.box(p.white_paint, {kHalfWidth - 0.008, 0.045, 0.3}, {0.008, 0.045, kHalfDepth - 0.3});
  b.begin("picture rail");
  b.box(p.white_paint, {0, 2.25, -kHalfDepth + 0.012}, {kHalfWidth, 0.02, 0.012}, 0.004);
}

void add_bed(SceneBuilder& b, const Palette& p, const BedroomFinishes& f, const Place& place) {
  // Local z runs from the headboard to the foot.
  b.begin("bed", place);
  b.box(p.walnut, {0, 0.24, 1.02}, {0.82, 0.09, 1.0}, 0.02);
  for (const double x : {-0.78, 0.78})
    for (const double z : {0.10, 1.95}) b.frustum(p.walnut, {x, 0, z}, 0.028, 0.045, 0.16);
  b.box(p.walnut, {0, 0.72, 0.035}, {0.86, 0.36, 0.03}, 0.02);
  for (const double x : {-0.86, 0.86}) {
    b.cylinder(p.walnut, {x, 0, 0.035}, 0.04, 1.12);
    b.sphere(p.brass, {x, 1.16, 0.035}, 0.048);
    b.cylinder(p.walnut, {x, 0, 2.05}, 0.035, 0.60);
    b.sphere(p.brass, {x, 0.635, 2.05}, 0.042);
  }
  b.rod(p.walnut, {-0.86, 0.52, 2.05}, {0.86, 0.52, 2.05}, 0.022);
  b.rod(p.walnut, {-0.86, 0.40, 2.05}, {0.86, 0.40, 2.05}, 0.016);
  b.begin("mattress", place);
  b.box(f.linen, {0, 0.42, 1.03}, {0.79, 0.11, 0.98}, 0.05);
  b.begin("duvet", place);
  b.box(f.duvet, {0, 0.53, 1.28}, {0.84, 0.055, 0.73}, 0.05);
  b.box(f.duvet, {-0.82, 0.43, 1.28}, {0.035, 0.15, 0.72}, 0.034);
  b.box(f.duvet, {0.82, 0.43, 1.28}, {0.035, 0.15, 0.72}, 0.034);
  b.box(f.linen, {0, 0.575, 0.62}, {0.83, 0.035, 0.12}, 0.034);
  b.begin("blanket", place);
  b.box(f.blanket, {0, 0.59, 1.72}, {0.87, 0.022, 0.22}, 0.02);
  b.box(f.blanket, {-0.86, 0.43, 1.72}, {0.022, 0.18, 0.22}, 0.02);
  b.box(f.blanket, {0.86, 0.43, 1.72}, {0.022, 0.18, 0.22}, 0.02);
  b.begin("pillows", place);
  b.box(f.linen, {-0.40, 0.63, 0.29}, {0.33, 0.075, 0.20}, 0.07, {4, -24, 0});
  b.box(f.linen, {0.40, 0.63, 0.29}, {0.33, 0.075, 0.20}, 0.07, {-5, -24, 0});
  b.begin("cushion", place);
  b.box(f.cushion, {0.06, 0.74, 0.52}, {0.19, 0.19, 0.06}, 0.055, {10, -26, 0});
  b.begin("teddy bear", place);
  b.sphere(f.bear, {-0.42, 0.70, 0.62}, 0.10);
  b.sphere(f.bear, {-0.42, 0.85, 0.61}, 0.075);
  for (const double side : {-1.0, 1.0}) {
    b.sphere(f.bear, {-0.42 + side * 0.06, 0.915, 0.60}, 0.028);
    b.rod(f.bear, {-0.42 + side * 0.07, 0.75, 0.64}, {-0.42 + side * 0.14, 0.68, 0.72}, 0.032);
    b.rod(f.bear, {-0.42 + side * 0.05, 0.64, 0.68}, {-0.42 + side * 0.09, 0.63, 0.80}, 0.038);
  }
  b.sphere(f.linen, {-0.42, 0.835, 0.675}, 0.032);
  b.sphere(p.black_plastic, {-0.42, 0.845, 0.705}, 0.011);
}

void add_nightstand(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("nightstand", place);
  b.box(p.walnut, {0, 0.30, 0}, {0.22, 0.20, 0.18}, 0.008);
  b.box(p.walnut, {0, 0.51, 0}, {0.24, 0.014, 0.20}, 0.006);
  for (const double x : {-0.19, 0.19})
    for (const double z : {-0.15, 0.15}) b.cylinder(p.walnut, {x, 0, z}, 0.018, 0.11);
  for (const double y : {0.21, 0.39}) {
    b.box(p.oak, {0, y, 0.182}, {0.20, 0.08, 0.008}, 0.003);
    b.sphere(p.brass, {0, y, 0.205}, 0.018);
  }
}

void add_wardrobe(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("wardrobe", place);
  b.box(p.oak, {0, 1.02, 0}, {0.70, 0.98, 0.29});
  b.box(p.oak, {0, 2.025, 0.01}, {0.74, 0.03, 0.32}, 0.012);
  b.box(p.walnut, {0, 0.03, 0}, {0.68, 0.03, 0.27});
  b.box(p.oak, {0.35, 1.03, 0.30}, {0.33, 0.92, 0.012}, 0.005);
  for (const double y : {0.60, 1.45}) b.box(p.walnut, {0.35, y, 0.314}, {0.25, 0.36, 0.006}, 0.004);
  b.box(p.oak, {-0.35, 1.03, 0.30}, {0.33, 0.92, 0.012}, 0.005);
  b.rod(p.brass, {0.06, 0.98, 0.34}, {0.06, 1.16, 0.34}, 0.010);
  b.rod(p.brass, {-0.06, 0.98, 0.34}, {-0.06, 1.16, 0.34}, 0.010);
  b.begin("wardrobe mirror", place);
  b.box(p.mirror, {-0.36, 1.05, 0.316}, {0.25, 0.80, 0.006});
}

void add_fireplace(SceneBuilder& b, const Palette& p, const BedroomFinishes& f, const Place& place) {
  b.begin("chimney breast", place);
  b.box(f.brick, {-0.47, 0.50, 0.14}, {0.19, 0.50, 0.14});
  b.box(f.brick, {0.47, 0.50, 0.14}, {0.19, 0.50, 0.14});
  b.box(f.brick, {0, 0.87, 0.14}, {0.28, 0.13, 0.14});
  b.box(f.brick, {0, 1.75, 0.11}, {0.60, 0.75, 0.11});
  b.box(f.hearth, {0, 0.37, 0.02}, {0.28, 0.37, 0.02});
  b.begin("hearth", place);
  b.box(f.hearth, {0, 0.025, 0.30}, {0.74, 0.025, 0.32}, 0.01);
  b.begin("hearth tiles", place);
  b.box(f.tile, {-0.47, 0.45, 0.286}, {0.13, 0.38, 0.006});
  b.box(f.tile, {0.47, 0.45, 0.286}, {0.13, 0.38, 0.006});
  b.begin("mantelpiece", place);
  b.box(f.marble, {0, 1.03, 0.17}, {0.74, 0.03, 0.19}, 0.01);
  b.begin("firewood", place);
  for (int i = 0; i < 3; ++i)
    b.rod(f.log, {-0.20, 0.10 + 0.002 * i, 0.10 + 0.09 * i}, {0.20, 0.11, 0.12 + 0.08 * i}, 0.045);
  b.rod(f.log, {-0.16, 0.19, 0.14}, {0.18, 0.20, 0.22}, 0.042);
  b.begin("fire tongs", place);
  b.rod(p.black_metal, {0.80, 0.012, 0.24}, {0.76, 0.66, 0.02}, 0.010);
  b.rod(p.black_metal, {0.86, 0.012, 0.22}, {0.83, 0.60, 0.02}, 0.010);
  b.torus(p.black_metal, {0.83, 0.64, 0.015}, 0.035, 0.008, {0, 80, 0});
}

void add_armchair(SceneBuilder& b, const Palette& p, const BedroomFinishes& f, const Place& place) {
  b.begin("armchair", place);
  b.box(f.leather, {0, 0.27, 0}, {0.36, 0.12, 0.36}, 0.04);
  b.box(f.leather, {0, 0.42, 0.04}, {0.27, 0.07, 0.31}, 0.06);
  b.box(f.leather, {0, 0.64, -0.29}, {0.35, 0.32, 0.10}, 0.09, {0, -10, 0});
  for (const double x : {-0.34, 0.34}) {
    b.box(f.leather, {x, 0.42, 0.02}, {0.08, 0.17, 0.34}, 0.06);
    b.rod(f.leather, {x, 0.58, -0.22}, {x, 0.58, 0.30}, 0.085);
    for (const double z : {-0.28, 0.28}) b.frustum(p.walnut, {x * 0.85, 0, z}, 0.018, 0.03, 0.16);
  }
  b.begin("throw cushion", place);
  b.box(f.blanket, {0.04, 0.60, -0.10}, {0.18, 0.18, 0.055}, 0.05, {8, -18, 12});
}

void add_dresser(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("dresser", place);
  b.box(p.pine, {0, 0.42, 0}, {0.45, 0.36, 0.22}, 0.006);
  b.box(p.pine, {0, 0.79, 0}, {0.48, 0.015, 0.25}, 0.006);
  for (const double x : {-0.40, 0.40})
    for (const double z : {-0.17, 0.17}) b.frustum(p.pine, {x, 0, z}, 0.018, 0.028, 0.07);
  for (int row = 0; row < 3; ++row)
    for (const double x : {-0.215, 0.215}) {
      const double y = 0.19 + 0.225 * row;
      b.box(p.oak, {x, y, 0.222}, {0.20, 0.10, 0.009}, 0.004);
      b.sphere(p.brass, {x, y, 0.245}, 0.015);
    }
}

void add_vase(SceneBuilder& b, const Palette& p, const BedroomFinishes& f, const Place& place) {
  b.begin("vase with twigs", place);
  b.frustum(f.blue_ceramic, {0, 0, 0}, 0.045, 0.06, 0.03);
  b.sphere(f.blue_ceramic, {0, 0.10, 0}, 0.085);
  b.shell(f.blue_ceramic, {0, 0.16, 0}, 0.035, 0.055, 0.09, 0.012);
  const std::array<Vec3d, 5> tips = {{{0.13, 0.50, 0.03},
                                      {-0.10, 0.55, 0.06},
                                      {0.02, 0.60, -0.06},
                                      {-0.05, 0.46, -0.10},
                                      {0.08, 0.53, 0.10}}};
  for (const Vec3d& tip : tips) {
    b.rod(p.leaf, {0, 0.20, 0}, tip, 0.006);
    b.sphere(f.petal, tip, 0.032);
    b.box(p.leaf, tip * 0.78, {0.05, 0.006, 0.022}, 0.006, {tip.x * 700, 15, 20});
  }
}

void add_tray_stool(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("stool", place);
  b.cylinder(p.pine, {0, 0.42, 0}, 0.20, 0.03);
  for (int i = 0; i < 3; ++i) {
    const double x = i == 0 ? 0.12 : -0.06, z = i == 0 ? 0.0 : (i == 1 ? 0.104 : -0.104);
    b.rod(p.pine, {x, 0.43, z}, {x * 1.45, 0.015, z * 1.45}, 0.015);
  }
  b.torus(p.pine, {0, 0.18, 0}, 0.155, 0.010);
}

void add_wash_bowl(SceneBuilder& b, const BedroomFinishes& f, const Place& place) {
  b.begin("wash bowl", place);
  b.frustum(f.blue_ceramic, {0, 0, 0}, 0.06, 0.08, 0.02);
  b.shell(f.blue_ceramic, {0, 0.012, 0}, 0.08, 0.16, 0.10, 0.012);
  b.frustum(f.water, {0, 0.018, 0}, 0.08, 0.136, 0.068);
}

void add_wall_shelf(SceneBuilder& b, const Palette& p, const Place& place) {
  b.begin("wall shelf", place);
  b.box(p.walnut, {0, 0, 0.10}, {0.45, 0.012, 0.10}, 0.003);
  for (const double x : {-0.36, 0.36}) {
    b.box(p.black_metal, {x, -0.09, 0.008}, {0.012, 0.08, 0.008});
    b.rod(p.black_metal, {x, -0.15, 0.016}, {x, -0.02, 0.15}, 0.006);
  }
}

}  // namespace

Scene::Parts make_bedroom() {
  SceneBuilder b;
  const Palette p = make_palette(b);
  const BedroomFinishes f = make_finishes(b);
  b.room({-kHalfWidth, 0, -kHalfDepth}, {kHalfWidth, kHeight, kHalfDepth});

  const Place window{{-kHalfWidth, 0, -0.1}, 90};
  const WallWithHole window_wall{2 * kHalfDepth + 0.4, kHeight, -0.62, 0.62, 0.92, 2.12};
  add_shell_of_room(b, p, f, window_wall, window);
  add_window(b, p, window, window_wall);
  add_curtain(b, f.curtain, {{-kHalfWidth + 0.11, 0.06, 0.82}, 90}, 0.42, 2.20);
  add_curtain(b, f.curtain, {{-kHalfWidth + 0.11, 0.06, -1.02}, 90}, 0.42, 2.20);
  b.begin("curtain rail", window);
  b.rod(p.brass, {-1.25, 2.30, 0.13}, {1.25, 2.30, 0.13}, 0.014);
  for (const double x : {-1.28, 1.28}) b.sphere(p.brass, {x, 2.30, 0.13}, 0.03);
  for (const double x : {-1.0, 0.0, 1.0}) b.torus(p.brass, {x, 2.29, 0.13}, 0.025, 0.006, {0, 0, 90});
  add_radiator(b, p.white_paint, p.brass, {{-kHalfWidth, 0.02, -0.1}, 90}, 1.0);

  const Place bed{{-0.45, 0, -kHalfDepth + 0.02}, 0};
  add_bed(b, p, f, bed);
  add_nightstand(b, p, {{-1.62, 0, -1.72}, 0});
  add_table_lamp(b, p, f.blue_ceramic, {{-1.70, 0.525, -1.78}, 0});
  const std::array<FinishId, 3> covers = {f.red_cover, f.green_cover, f.blue_cover};
  add_book_stack(b, covers, p.ivory_paper, {{-1.52, 0.525, -1.66}, 15}, 3);
  add_nightstand(b, p, {{0.72, 0, -1.72}, 0});
  add_table_lamp(b, p, f.blue_ceramic, {{0.78, 0.525, -1.78}, 0});
  add_mug(b, f.terracotta, f.tea, {{0.62, 0.525, -1.62}, 30});

  add_fireplace(b, p, f, {{kHalfWidth, 0, -0.95}, -90});
  b.begin("carriage clock", {{kHalfWidth - 0.18, 1.06, -0.95}, -90});
  b.box(p.brass, {0, 0.09, 0}, {0.06, 0.09, 0.045}, 0.01);
  b.cylinder(p.ivory_paper, {0, 0.10, 0.043}, 0.042, 0.008, {0, 90, 0});
  b.torus(p.brass, {0, 0.19, 0}, 0.028, 0.007, {0, 90, 0});
  add_pot_plant(b, p, f.terracotta, {{kHalfWidth - 0.20, 1.06, -0.50}, 0}, 0.36);
  add_framed_picture(b, p.brass, f.landscape, {{kHalfWidth - 0.22, 1.62, -0.95}, -90}, 0.62, 0.46);

  add_wardrobe(b, p, {{kHalfWidth - 0.31, 0, 0.78}, -90});
  add_dresser(b, p, {{1.53, 0, -1.74}, 0});
  add_vase(b, p, f, {{1.34, 0.805, -1.78}, 0});
  add_wash_bowl(b, f, {{1.66, 0.805, -1.66}, 0});
  add_framed_picture(b, p.walnut, f.painting, {{-0.45, 1.62, -kHalfDepth}, 0}, 0.85, 0.55);
  add_framed_picture(b, p.pine, f.landscape, {{1.52, 1.72, -kHalfDepth}, 0}, 0.34, 0.44);
  add_wall_clock(b, p, {{0.72, 1.86, -kHalfDepth}, 0});
  add_wall_shelf(b, p, {{-1.68, 1.42, -kHalfDepth}, 0});
  add_books(b, covers, {{-2.08, 1.432, -kHalfDepth + 0.01}, 0}, 11, 5);

  add_armchair(b, p, f, {{1.28, 0, -0.62}, -125 + 90});
  add_floor_lamp(b, p, {{-2.02, 0, -1.35}, 0});
  add_pot_plant(b, p, f.terracotta, {{-1.98, 0, 0.68}, 0}, 1.05);
  add_tray_stool(b, p, {{-1.35, 0, -0.15}, 0});
  add_fruit_bowl(b, p.white_ceramic, f.apple, f.banana, {{-1.39, 0.45, -0.17}, 20});
  b.begin("loaf", {{-1.22, 0.45, -0.06}, 35});
  b.rod(f.bread, {-0.05, 0.036, 0}, {0.05, 0.036, 0}, 0.036);
  b.begin("rug");
  b.box(f.rug, {0.62, 0.006, 0.12}, {0.80, 0.006, 0.55}, 0.005);
  b.box(f.rug_fringe, {-0.20, 0.005, 0.12}, {0.04, 0.005, 0.55}, 0.004);
  b.box(f.rug_fringe, {1.44, 0.005, 0.12}, {0.04, 0.005, 0.55}, 0.004);
  b.begin("beach ball");
  b.sphere(f.ball, {0.72, 0.012 + 0.13, 0.02}, 0.13);
  b.begin("slippers", {{0.42, 0.012, -0.28}, 20});
  for (const double x : {-0.06, 0.06}) {
    b.box(f.bear, {x, 0.012, 0}, {0.042, 0.012, 0.12}, 0.011);
    b.rod(f.bear, {x, 0.042, -0.06}, {x, 0.036, -0.02}, 0.036);
  }
  b.begin("laundry basket", {{-1.78, 0, -0.86}, 0});
  b.shell(f.wicker, {0, 0, 0}, 0.16, 0.20, 0.46, 0.016);
  b.torus(f.wicker, {0, 0.455, 0}, 0.202, 0.014);
  b.cylinder(f.wicker, {0, 0, 0}, 0.15, 0.30);
  b.sphere(f.linen, {0.03, 0.32, 0.02}, 0.13);
  b.sphere(f.cushion, {-0.06, 0.34, -0.05}, 0.10);
  b.begin("pendant lamp");
  b.rod(p.black_metal, {0.2, 2.5, -0.7}, {0.2, 2.22, -0.7}, 0.006);
  b.shell(p.shade_cloth, {0.2, 2.02, -0.7}, 0.22, 0.12, 0.18, 0.012);
  b.sphere(p.shade_cloth, {0.2, 2.10, -0.7}, 0.05);
  add_waste_bin(b, p.black_plastic, p.ivory_paper, {{1.98, 0, -1.70}, 0});
  b.begin("light switch");
  b.box(p.white_plastic, {1.12, 1.10, -kHalfDepth + 0.006}, {0.042, 0.042, 0.006}, 0.004);

  b.light({0.2, 1.95, -0.6}, 0.62F);
  b.light({-2.0, 1.6, -0.1}, 0.48F);
  b.light({0.4, 2.2, 1.4}, 0.25F);
  b.loop({.center_world_m = {-0.05, 1.42, 1.28},
          .yaw_degrees = 0,
          .pitch_degrees = -17,
          .right_m = 0.42,
          .up_m = 0.09,
          .forward_m = 0.18,
          .yaw_sweep_degrees = 40,
          .pitch_sweep_degrees = 6,
          .roll_sweep_degrees = 4});
  return b.take();
}

}  // namespace tactus::hal::synthetic
