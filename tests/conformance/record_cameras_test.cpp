#include <unistd.h>

#include <fstream>

#include "hal/record/tac_file.hpp"
#include "tests/conformance/camera_suite.hpp"
#include "tests/hal/record/small_recording.hpp"

namespace tactus::hal::conformance {
namespace {

using record::Content;
using record::IndexEntry;
using record::TacReadOptions;

/// A recording of its own per case, made when it is first opened and gone with the process.
std::filesystem::path made(const char* name, const Content& content) {
  static const test::TemporaryFolder folder;
  const auto path = folder.path() / (std::string(name) + ".tac");
  if (!std::filesystem::exists(path)) record::record(path, content);
  return path;
}

/// Where depth frame `number` starts.
std::uint64_t offset_of(const std::filesystem::path& path, std::uint64_t number) {
  const auto file = record::TacFile::open(path);
  EXPECT_TRUE(file);
  for (const IndexEntry& entry : (*file)->entries())
    if (entry.header.type == record::ChunkType::depth && entry.header.frame.sequence == number) return entry.offset;
  ADD_FAILURE() << "no frame " << number;
  return 0;
}

/// Cut off within depth frame 6.
std::filesystem::path cut_off() {
  static const std::filesystem::path path = [] {
    auto out = made("cut_off", {});
    EXPECT_EQ(truncate(out.c_str(), static_cast<off_t>(offset_of(out, 6) + 100)), 0);
    return out;
  }();
  return path;
}

/// Depth frames 2 and 5 have a byte turned over, one in its header, one in its pixels.
std::filesystem::path damaged() {
  static const std::filesystem::path path = [] {
    auto out = made("damaged", {.color = PixelFormat::nv12});
    std::fstream file(out, std::ios::in | std::ios::out | std::ios::binary);
    for (const std::uint64_t at : {offset_of(out, 2) + 20, offset_of(out, 5) + 200}) {
      file.seekg(static_cast<std::streamoff>(at));
      const char byte = static_cast<char>(file.get() ^ 1);
      file.seekp(static_cast<std::streamoff>(at));
      file.put(byte);
    }
    return out;
  }();
  return path;
}

std::function<rt::Result<Sensor>()> opens(const char* name, const Content& content, TacReadOptions options = {}) {
  return [=] { return record::open_tac(made(name, content), options); };
}

INSTANTIATE_TEST_SUITE_P(
    Record, CameraConformance,
    testing::Values(
        CameraCase{"tac", opens("whole", {}), 9, 9},
        CameraCase{"tac_prefetch", opens("whole", {}, {.prefetch = 3}), 9, 9},
        CameraCase{"tac_part", opens("whole", {}, {.first = 2, .last = 6, .prefetch = 1}), 4, 4},
        CameraCase{"tac_cut_off", [] { return record::open_tac(cut_off(), {}); }, 6, 6},
        CameraCase{"tac_damaged", [] { return record::open_tac(damaged(), {}); }, 7, 9, 2},
        CameraCase{"tac_damaged_prefetch", [] { return record::open_tac(damaged(), {.prefetch = 2}); }, 7, 9, 2},
        CameraCase{"tac_depth_only", opens("depth_only", {.has_color = false, .has_labels = false}), 9, 0},
        CameraCase{"tac_yuyv", opens("yuyv", {.color = PixelFormat::yuyv}, {.prefetch = 2}), 9, 9},
        CameraCase{"tac_mjpeg", opens("mjpeg", {.color = PixelFormat::mjpeg}), 9, 9}),
    case_name);

}  // namespace
}  // namespace tactus::hal::conformance
