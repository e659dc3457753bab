#include "pipeline/sound/room_sound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "pipeline/contact/map_field.hpp"
#include "pipeline/label/label_cell.hpp"
#include "tests/pipeline/map/analytic_map.hpp"
#include "tests/pipeline/sound/shoebox.hpp"
#include "tests/pipeline/sound/signal.hpp"
#include "tests/pipeline/sound/sounding_materials.hpp"

namespace tactus::sound {
namespace {

using test::Shoebox;

constexpr double kRangeM = 10;

struct Found {
  std::array<Reflection, 8> reflections{};
  int count = 0;

  [[nodiscard]] std::span<const Reflection> all() const {
    return std::span(reflections).first(static_cast<std::size_t>(count));
  }
  [[nodiscard]] const Reflection* nearest_to(const Vec3d& place) const {
    const Reflection* best = nullptr;
    for (const Reflection& r : all())
      if (best == nullptr || (r.image_world_m - place).norm() < (best->image_world_m - place).norm())
        best = &r;
    return best;
  }
};

Found found_in(const contact::DistanceField& rays, const SoundPath& path) {
  Found found;
  found.count = find_reflections(rays, test::sounding_materials(), path, kRangeM, found.reflections);
  return found;
}

/// The six images by definition.
std::array<Vec3d, 6> images_in(const Shoebox& room, const Vec3d& source_world) {
  const Vec3d s = room.turn.transposed() * source_world;
  const std::array<Vec3d, 6> in_room = {
      Vec3d{2 * room.low_m.x - s.x, s.y, s.z}, {2 * room.high_m.x - s.x, s.y, s.z},
      {s.x, 2 * room.low_m.y - s.y, s.z},      {s.x, 2 * room.high_m.y - s.y, s.z},
      {s.x, s.y, 2 * room.low_m.z - s.z},      {s.x, s.y, 2 * room.high_m.z - s.z}};
  std::array<Vec3d, 6> images;
  for (std::size_t i = 0; i < 6; ++i) images[i] = room.turn * in_room[i];
  return images;
}

TEST(RoomSound, EmptyShoebox_SixImagesAtTheirPlaces) {
  std::mt19937 random(1);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  for (int i = 0; i < 50; ++i) {
    Shoebox room;
    const double half_angle = uniform(0, std::numbers::pi / 2);
    room.turn = Rotation::from({std::cos(half_angle), 0, std::sin(half_angle), 0});
    SoundPath path;
    path.source_world_m = room.turn * Vec3d{uniform(-1.7, 1.7), uniform(0.3, 2.2), uniform(-2.7, 2.7)};
    path.listener_world_m = room.turn * Vec3d{uniform(-1.7, 1.7), uniform(0.3, 2.2), uniform(-2.7, 2.7)};
    if ((path.listener_world_m - path.source_world_m).norm() < 0.3) continue;
    const Found found = found_in(room.rays(), path);
    ASSERT_EQ(found.count, 6) << i;
    for (const Vec3d& image : images_in(room, path.source_world_m)) {
      const Reflection& reflection = *found.nearest_to(image);
      EXPECT_LT((reflection.image_world_m - image).norm(), 0.001) << i;
      EXPECT_NEAR(reflection.path_m, (image - path.listener_world_m).norm(), 0.001);
      const double by_the_point = (reflection.point_world_m - path.source_world_m).norm() +
                                  (path.listener_world_m - reflection.point_world_m).norm();
      EXPECT_NEAR(reflection.path_m, by_the_point, 0.001) << "mirrored, so both ways are as long";
    }
    EXPECT_TRUE(std::is_sorted(found.all().begin(), found.all().end(),
                               [](const Reflection& a, const Reflection& b) { return a.path_m < b.path_m; }));
  }
}

TEST(RoomSound, GainIsWhatTheWallDoesNotAbsorb) {
  Shoebox room;
  room.materials[1] = test::id_of("carpet");
  const SoundPath path{{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}};
  const Found found = found_in(room.rays(), path);
  const auto images = images_in(room, path.source_world_m);
  for (std::size_t wall = 0; wall < 6; ++wall) {
    const auto absorption = test::sounding_materials().sound_of(room.materials[wall]).absorption;
    for (std::size_t band = 0; band < kBands; ++band)
      EXPECT_NEAR(found.nearest_to(images[wall])->gain[band], std::sqrt(1 - absorption[band]), 1e-6) << wall;
  }
}

TEST(RoomSound, UncertainWall_AbsorbsAsExpectedOverItsPosterior) {
  struct Mixed {
    Shoebox room;
    [[nodiscard]] contact::DistanceField rays() const {
      return contact::rays_only(this, [](const void* context, const Vec3f& o, const Vec3f& d, float range_m,
                       map::SurfacePoint& out) noexcept {
                const bool hit = static_cast<const Mixed*>(context)->room.cast(
                    o.cast<double>(), d.cast<double>(), static_cast<double>(range_m), out);
                out.materials.fill(0);
                out.materials[material_from_name("glass")] = 0.75F;
                out.materials[material_from_name("fabric")] = 0.25F;
                return hit;
              });
    }
  };
  const Mixed room;
  const Found found = found_in(room.rays(), {{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}});
  ASSERT_EQ(found.count, 6);
  EXPECT_NEAR(found.all()[0].gain[1], std::sqrt(1 - (0.75 * 0.12 + 0.25 * 0.5)), 1e-6);
}

TEST(RoomSound, UnlabelledWall_AbsorbsAsOther) {
  const Shoebox room(kUnknownMaterial);
  contact::MaterialTable table;
  table.sound[test::id_of("other")].absorption = {0.2, 0.3, 0.4};
  std::array<Reflection, 8> reflections;
  ASSERT_EQ(find_reflections(room.rays(), table, {{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}}, kRangeM, reflections),
            6);
  EXPECT_NEAR(reflections[0].gain[2], std::sqrt(0.6), 1e-6);
}

TEST(RoomSound, UnmappedWalls_NoImageFromThem) {
  Shoebox room;
  const SoundPath path{{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}};
  room.is_mapped = {true, false, true, false, true, true};
  const Found found = found_in(room.rays(), path);
  EXPECT_EQ(found.count, 4);
  for (const std::size_t wall : {1U, 3U}) {
    const Vec3d image = images_in(room, path.source_world_m)[wall];
    EXPECT_GT((found.nearest_to(image)->image_world_m - image).norm(), 0.5) << wall;
  }
  room.is_mapped.fill(false);
  EXPECT_EQ(found_in(room.rays(), path).count, 0);
  EXPECT_EQ(found_in(contact::DistanceField{}, path).count, 0) << "no room at all";
}

TEST(RoomSound, SourceOnTheFloor_FloorItselfGivesNoImage) {
  const Shoebox room;
  const SoundPath path{{0.5, 0, 0.4}, {0, 1, 0}, {-0.5, 1.5, -1}};
  const Found found = found_in(room.rays(), path);
  EXPECT_EQ(found.count, 5);
  for (const Reflection& reflection : found.all()) EXPECT_GT(reflection.point_world_m.y, 0.01);
}

TEST(RoomSound, FewWanted_ShortestKept) {
  const Shoebox room;
  const SoundPath path{{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}};
  const Found all = found_in(room.rays(), path);
  std::array<Reflection, 2> two;
  ASSERT_EQ(find_reflections(room.rays(), test::sounding_materials(), path, kRangeM, two), 2);
  EXPECT_EQ(two[0].path_m, all.all()[0].path_m);
  EXPECT_EQ(two[1].path_m, all.all()[1].path_m);
}

/// A shoebox with a screen at x = 1.5 that begins `low_m` above the floor.
struct Screened {
  Shoebox room;
  double low_m = 0;

  [[nodiscard]] contact::DistanceField rays() const {
    return contact::rays_only(this, [](const void* context, const Vec3f& o, const Vec3f& d, float range_m,
                     map::SurfacePoint& out) noexcept {
              const auto& self = *static_cast<const Screened*>(context);
              const Vec3d from = o.cast<double>(), way = d.cast<double>().normalized();
              const double s = (1.5 - from.x) / way.x;
              const Vec3d at = from + way * s;
              if (way.x > 0 && s > 0 && s < static_cast<double>(range_m) && at.y > self.low_m && at.y < 2.5 &&
                  std::abs(at.z) < 3) {
                out = {};
                out.position_world_m = at.cast<float>();
                out.normal_world = {-1, 0, 0};
                return true;
              }
              return self.room.cast(from, way, static_cast<double>(range_m), out);
            });
  }
};

TEST(RoomSound, ScreenAcross_HidesTheWallAndAnswersItself) {
  const Screened screened;
  const SoundPath path{{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}};
  const Found found = found_in(screened.rays(), path);
  const Vec3d behind = images_in(screened.room, path.source_world_m)[1];
  EXPECT_GT((found.nearest_to(behind)->image_world_m - behind).norm(), 0.5);
  const Vec3d on_screen{2.5, 1, 0.4};
  EXPECT_LT((found.nearest_to(on_screen)->image_world_m - on_screen).norm(), 0.001);
}

TEST(RoomSound, ScreenThatHidesTheWallFromTheListenerAlone_DullsIt) {
  // The way there crosses x = 1.5 at 1.10 to 1.15 m, the way back at 1.27 m: a screen from 1.2 m up blocks
  // one.
  Screened screened;
  screened.low_m = 1.2;
  const SoundPath path{{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}};
  const Vec3d wall = images_in(screened.room, path.source_world_m)[1];
  const Found found = found_in(screened.rays(), path), clear = found_in(screened.room.rays(), path);
  const Reflection &dull = *found.nearest_to(wall), &bright = *clear.nearest_to(wall);
  ASSERT_LT((dull.image_world_m - wall).norm(), 0.001);
  for (std::size_t band = 0; band < kBands; ++band) {
    const double detour_waves = 2 * 0.05 * std::array{250.0, 1000.0, 4000.0}[band] / 343;
    EXPECT_NEAR(20 * std::log10(dull.gain[band] / bright.gain[band]), -10 * std::log10(3 + 20 * detour_waves),
                0.2);
  }
}

TEST(RoomSound, RealMapOfAShoebox_ImagesWithinTwoCentimetres) {
  const Vec3d low{-0.913, 0.013, -1.217}, high{0.931, 1.523, 1.134};
  map::MapConfig config;
  config.blocks_capacity = 8192;
  map::test::OwnedMap owned(config);
  // Half a millimetre of noise in each voxel, as fusing many frames leaves: gradients are 2 degrees off.
  std::mt19937 random(5);
  const auto distance = [&](const Vec3d& p) {
    const double noise_m = 0.0005 * (static_cast<double>(random()) / 2147483648.0 - 1) * std::sqrt(3.0);
    return noise_m +
           std::min({p.x - low.x, high.x - p.x, p.y - low.y, high.y - p.y, p.z - low.z, high.z - p.z});
  };
  const Vec3d margin{0.05, 0.05, 0.05};
  map::test::fill(owned.map, low - margin, high + margin, distance);
  // Carpet on the floor, nothing known of the rest.
  MaterialDistribution carpet{};
  carpet[test::id_of("carpet")] = 1;
  std::array<map::LabelWord, map::kBlockCells> words;
  words.fill(label::encode(carpet, 5));
  for (int z = -20; z < 20; ++z)
    for (int x = -20; x < 20; ++x) {
      const map::BlockIndex block = owned.map.find_or_allocate(map::key_of({x, 0, z}));
      if (block != map::kNoBlock) owned.map.publish_labels(block, words, 1);
    }
  const map::Reader reader(owned.map);
  const SoundPath path{{0.2, 0.6, 0.3}, {}, {-0.4, 1.1, -0.5}};
  const Found found = found_in(contact::field_of(reader), path);
  ASSERT_EQ(found.count, 6);
  Shoebox room;
  room.low_m = low;
  room.high_m = high;
  double worst_m = 0;
  for (const Vec3d& image : images_in(room, path.source_world_m)) {
    const Reflection& reflection = *found.nearest_to(image);
    worst_m = std::max(worst_m, (reflection.image_world_m - image).norm());
    EXPECT_NEAR(reflection.path_m, (image - path.listener_world_m).norm(), 0.02);
  }
  std::printf("images on a map of 1 cm voxels: at most %.1f mm off\n", 1000 * worst_m);
  EXPECT_LT(worst_m, 0.02);
  const Reflection& floor = *found.nearest_to(images_in(room, path.source_world_m)[2]);
  EXPECT_NEAR(floor.gain[2], std::sqrt(1 - 0.65), 0.02);
}

TEST(ApplyBands, AllOnes_TheClipItself) {
  std::vector<float> clip(1000), out(1000);
  for (std::size_t i = 0; i < clip.size(); ++i)
    clip[i] = static_cast<float>(std::sin(0.1 * static_cast<double>(i)));
  apply_bands({1, 1, 1}, clip, out);
  for (std::size_t i = 0; i < clip.size(); ++i) EXPECT_NEAR(out[i], clip[i], 1e-6F);
  apply_bands({0.5, 0.5, 0.5}, clip, out);
  for (std::size_t i = 0; i < clip.size(); ++i) EXPECT_NEAR(out[i], 0.5F * clip[i], 1e-6F);
}

TEST(ApplyBands, EachBandFollowsItsGain) {
  std::vector<float> clip(9600), out(9600);
  const auto level_db = [&](double frequency_hz, const std::array<double, kBands>& gain) {
    for (std::size_t i = 0; i < clip.size(); ++i)
      clip[i] = static_cast<float>(
          std::sin(2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / test::kRateHz));
    apply_bands(gain, clip, out);
    return 20 * std::log10(test::magnitude_at(out, frequency_hz) / test::magnitude_at(clip, frequency_hz));
  };
  // A carpet takes treble and leaves bass.
  const std::array<double, kBands> carpet{0.95, 0.77, 0.59};
  EXPECT_NEAR(level_db(60, carpet), 20 * std::log10(0.95), 0.3);
  EXPECT_NEAR(level_db(250, carpet), 20 * std::log10(0.95), 1);
  EXPECT_NEAR(level_db(1000, carpet), 20 * std::log10(0.77), 1);
  EXPECT_NEAR(level_db(4000, carpet), 20 * std::log10(0.59), 1);
  EXPECT_NEAR(level_db(15000, carpet), 20 * std::log10(0.59), 0.5);
}

}  // namespace
}  // namespace tactus::sound
