// What a picture of a film costs, in processor time.
#include <gtest/gtest.h>

#include <ctime>

#include "hal/movie/movie_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal {
namespace {

TEST(MovieWriterLatency, PictureOf640x480) {
  constexpr int kWidth = 640, kHeight = 480, kPicturesCount = 120;
  const test::TemporaryFolder folder;
  auto film = MovieWriter::create(folder.path() / "a.mp4",
                                  {.width_px = kWidth, .height_px = kHeight, .sound = {48000, 2}});
  if (!film) GTEST_SKIP() << film.error().message;
  std::vector<std::uint8_t> rgb(3 * kWidth * kHeight);
  const std::vector<float> sound(2 * 1600, 0.1F);
  std::uint32_t noise = 1;
  double spent_s = 0;
  for (int i = 0; i < kPicturesCount; ++i) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        noise = noise * 1664525U + 1013904223U;
        const bool inside = std::abs(x - 3 * i - 60) < 50 && std::abs(y - 240) < 50;
        auto* pixel = &rgb[static_cast<std::size_t>(3 * (y * kWidth + x))];
        pixel[0] = static_cast<std::uint8_t>((inside ? 200 : x / 3) + static_cast<int>(noise >> 30));
        pixel[1] = static_cast<std::uint8_t>((inside ? 60 : y / 2) + static_cast<int>(noise >> 30));
        pixel[2] = static_cast<std::uint8_t>(((x / 16 + y / 16 + i) % 2) * 40 + 100);
      }
    const std::clock_t before = std::clock();
    film->write_picture(static_cast<std::uint64_t>(i), rgb);
    film->write_sound(sound);
    spent_s += static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  }
  const std::clock_t before = std::clock();
  ASSERT_TRUE(film->close());
  spent_s += static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  std::printf("film of 640 x 480 with sound: %.2f ms of processor time a picture, %.0f kB for %d pictures\n",
              1e3 * spent_s / kPicturesCount,
              static_cast<double>(std::filesystem::file_size(folder.path() / "a.mp4")) / 1e3, kPicturesCount);
  EXPECT_GT(spent_s, 0);
}

}  // namespace
}  // namespace tactus::hal
