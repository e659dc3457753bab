// The whole bench on a few frames: that it measures what it says. Nothing here depends on how fast the
// machine is.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "firmware_host/bench.hpp"
#include "firmware_host/bench_spine.hpp"
#include "pipeline/profile.hpp"

namespace tactus::firmware {
namespace {

TEST(Bench, TwentyFramesAreTrackedInASmallAndInALargeMap) {
  BenchOptions options;
  options.frames_count = 20;
  options.is_json = true;
  options.command = "tactus bench --frames 20 --json";
  const auto text = bench(options);
  ASSERT_TRUE(text) << text.error().message;
  const auto json = nlohmann::json::parse(*text);
  EXPECT_EQ(json["command"], options.command);
  EXPECT_EQ(json["frames"], 10);
  EXPECT_EQ(json["frames_warm_up"], 10);
  EXPECT_EQ(json["frames_lost"], 0);
  const double view = json["blocks_in_view"];
  EXPECT_GT(view, 1000) << "the room fills the image";
  EXPECT_GE(json["map_10x"]["far_blocks"].get<double>(), 10 * view);
  EXPECT_LT(json["map_10x"]["near_blocks"].get<double>(), 3 * view);
  double sum = 0;
  for (const char* stage : {"register", "track", "integrate", "predict"}) {
    const double median = json["stages"][stage]["cpu_ms"]["median"];
    EXPECT_GT(median, 0) << stage;
    sum += median;
  }
  EXPECT_GT(json["stages"]["total"]["cpu_ms"]["max"].get<double>(), 0.5 * sum)
      << "the total is of all stages";
}

TEST(BenchPass, FarBlocksThatDoNotFitAreToldInOneSentence) {
  const BenchFrames frames = render_bench_frames(1);
  SpineConfig config = x86_profile().spine;
  const auto sut = run_bench_pass(frames, config, 0, config.map.blocks_capacity);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::budget_exceeded);
  EXPECT_NE(sut.error().message.find("no room"), std::string::npos) << sut.error().message;
}

}  // namespace
}  // namespace tactus::firmware
