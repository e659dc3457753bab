#include <gtest/gtest.h>

#include "hal/movie/movie_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal {
namespace {

TEST(MovieWriterWithoutLibav, CreateSaysSoInOneSentenceAndWritesNothing) {
  const test::TemporaryFolder folder;
  const auto refused = MovieWriter::create(folder.path() / "video.mp4", {.width_px = 64, .height_px = 48});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find("without libavformat"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "video.mp4"));
}

}  // namespace
}  // namespace tactus::hal
