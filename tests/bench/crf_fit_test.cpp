#include "tests/bench/crf_fit.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::bench {
namespace {

LabelledPoints corner_room(std::uint32_t seed) {
  const label::test::Cloud cloud = label::test::corner_cloud(seed, 14, 0.05, 0.35, 0.3);
  return {cloud.position_m, cloud.normal, cloud.color, cloud.unary_nat, cloud.truth};
}

struct File {
  explicit File(const char* name) : path((std::filesystem::temp_directory_path() / name).string()) {}
  ~File() { std::filesystem::remove(path); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  std::string path;
};

TEST(CrfPointsFile, WrittenPointsAreReadBackTheSame) {
  const LabelledPoints room = corner_room(1);
  const File file("tactus_crf_points_round_trip.points");
  ASSERT_TRUE(write_points(file.path, room));
  const auto sut = read_points(file.path);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(std::filesystem::file_size(file.path), 16 + 120 * room.size());
  EXPECT_EQ(sut->position_m, room.position_m);
  EXPECT_EQ(sut->normal, room.normal);
  EXPECT_EQ(sut->color, room.color);
  EXPECT_EQ(sut->truth, room.truth);
  EXPECT_EQ(sut->unary_nat, room.unary_nat);
}

TEST(CrfPointsFile, DamagedFilesAreRefusedWithASentence) {
  LabelledPoints room = corner_room(2);
  const File file("tactus_crf_points_damaged.points");
  ASSERT_TRUE(write_points(file.path, room));
  std::string good;
  {
    std::ifstream in(file.path, std::ios::binary);
    good.assign(std::istreambuf_iterator<char>(in), {});
  }
  struct Case {
    const char* what;
    std::string bytes;
    const char* expected;
  };
  std::string magic = good, short_by_one = good.substr(0, good.size() - 1), materials = good, truth = good,
              nan = good;
  magic[0] = 'X';
  materials[12] = 22;
  truth[16 + 27] = 23;
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(&nan[16 + 120 + 28], &not_a_number, 4);
  const Case cases[] = {{"empty", "", "does not begin with TACTCRF1"},
                        {"magic", magic, "does not begin with TACTCRF1"},
                        {"one byte short", short_by_one, "points need"},
                        {"one byte long", good + "x", "points need"},
                        {"materials", materials, "22 materials instead of 23"},
                        {"truth", truth, "point 0 is of material 23"},
                        {"nan", nan, "not finite"}};
  for (const Case& c : cases) {
    std::ofstream(file.path, std::ios::binary | std::ios::trunc) << c.bytes;
    const auto sut = read_points(file.path);
    ASSERT_FALSE(sut) << c.what;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
    EXPECT_NE(sut.error().message.find(c.expected), std::string::npos) << sut.error().message;
    EXPECT_TRUE(sut.error().message.starts_with(file.path)) << sut.error().message;
  }
  EXPECT_FALSE(read_points("no/such.points"));
}

TEST(CrfFit, SweepMovesOneKnobAtATime) {
  const std::vector<LabelledPoints> rooms{corner_room(3)};
  const label::CrfParameters base = label::default_crf_parameters();
  const float factors[] = {0.5F, 2.0F};
  std::size_t reported = 0;
  const auto rows = sweep(rooms, base, factors, [&](const SweepRow&) { ++reported; });
  ASSERT_TRUE(rows) << rows.error().message;
  ASSERT_EQ(rows->size(), 2 * crf_knobs().size());
  EXPECT_EQ(reported, rows->size());
  for (std::size_t k = 0; k < crf_knobs().size(); ++k) {
    label::CrfParameters copy = base;
    const float at = crf_knobs()[k].value(copy), value = at == 0 ? 1 : at;  // a kernel left out comes back
    EXPECT_EQ((*rows)[2 * k].knob, crf_knobs()[k].name);
    EXPECT_FLOAT_EQ((*rows)[2 * k].value, value / 2);
    EXPECT_FLOAT_EQ((*rows)[2 * k + 1].value, value * 2);
    EXPECT_EQ((*rows)[2 * k].score.metrics.pixels_count, rooms[0].size());
  }
}

TEST(CrfFit, RaisesMeanIuFromPoorParametersOnRoomsItHasNotSeenToo) {
  const std::vector<LabelledPoints> rooms{corner_room(4)}, held_out{corner_room(5)};
  label::CrfParameters poor = label::default_crf_parameters();
  poor.smoothness.weight = poor.surface.weight = 0;
  poor.appearance = {0.5F, 0.05F, 5.0F};
  const auto before = score_crf(rooms, poor), held_before = score_crf(held_out, poor);
  double last = fit_objective(*before);
  const auto fitted = fit(rooms, poor, 8, [&](const SweepRow& row) {
    EXPECT_GT(fit_objective(row.score), last) << row.knob;
    last = fit_objective(row.score);
  });
  ASSERT_TRUE(fitted) << fitted.error().message;
  const auto after = score_crf(rooms, *fitted), held_after = score_crf(held_out, *fitted);
  std::printf("mean IU: unary %.3f, poor %.3f, fitted %.3f; held out %.3f -> %.3f\n",
              score_unary(rooms).metrics.mean_iu, before->metrics.mean_iu, after->metrics.mean_iu,
              held_before->metrics.mean_iu, held_after->metrics.mean_iu);
  EXPECT_GT(after->metrics.mean_iu, before->metrics.mean_iu + 0.1);
  EXPECT_GT(held_after->metrics.mean_iu, held_before->metrics.mean_iu + 0.1);
}

}  // namespace
}  // namespace tactus::bench
