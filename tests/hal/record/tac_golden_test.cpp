// Version 1 as it was first written: golden.tac stays readable, and today's writer still writes the same.
#include <gtest/gtest.h>

#include "hal/frames/convert.hpp"
#include "hal/record/chunk.hpp"
#include "hal/record/crc32c.hpp"
#include "hal/record/packer.hpp"
#include "hal/record/tac.hpp"
#include "hal/record/tac_file.hpp"
#include "hal/record/tac_writer.hpp"
#include "tests/hal/record/depth_pictures.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::record {
namespace {

constexpr int kWidth = 16, kHeight = 12;
constexpr std::size_t kPixels = kWidth * kHeight;

FrameHeader header_of(std::uint64_t i) {
  return {{1'000'000'007 + 33'333'333 * static_cast<std::int64_t>(i)}, 40 + i, {5'000'000'000 + static_cast<std::int64_t>(i)}};
}

std::vector<std::uint16_t> depth_of(std::uint64_t i) {
  return depth_picture(i % 2 == 0 ? DepthKind::disparity : DepthKind::noise, kWidth, kHeight, 7);
}

std::vector<std::uint8_t> color_of(PixelFormat format, std::uint64_t i) {
  std::vector<std::uint8_t> bytes(frames::packed_bytes(format, kWidth, kHeight));
  for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k] = static_cast<std::uint8_t>(k / 3 + 5 * i);
  return bytes;
}
constexpr std::array kFormats{PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12};
constexpr std::array kRgbSums{2533388169U, 1095554747U, 2533018415U};  // of the first version

void write_golden(const std::filesystem::path& path) {
  Sensor sensor;
  sensor.description = "golden";
  sensor.calibration.depth = {kWidth, kHeight, 14.25, 14.5, 7.5, 5.5, 0.125, 0, 0, 0, 0};
  sensor.calibration.depth_m_per_unit = 0.001;
  sensor.calibration.has_color = true;
  sensor.calibration.color = {kWidth, kHeight, 15, 15, 8, 6, 0, 0, 0, 0, 0};
  sensor.calibration.T_color_depth.translation = {-0.025, 0, 0};
  sensor.gravity_depth = Vec3d{0, 1, 0};
  TruthPose pose;
  pose.time = header_of(0).time;
  pose.T_world_depth.translation = {1, 2, 3};
  sensor.truth.push_back(pose);
  auto writer = TacWriter::create(path, sensor, {{{"source", "golden"}}}, {.waits_when_full = true});
  ASSERT_TRUE(writer) << writer.error().message;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto depth = depth_of(i);
    (*writer)->take(Stream::depth, frames::raw_frame(depth, header_of(i), kWidth, kHeight));
    const auto color = color_of(kFormats[i], i);
    const std::size_t row = kFormats[i] == PixelFormat::nv12 ? kWidth : color.size() / kHeight;
    (*writer)->take(Stream::color, {header_of(i), kFormats[i], kWidth, kHeight, row, color});
    ASSERT_TRUE((*writer)->add_labels(40 + i, std::vector<std::uint8_t>(kPixels, static_cast<std::uint8_t>(i))));
  }
  ASSERT_TRUE((*writer)->close());
}

std::filesystem::path golden() { return std::filesystem::path(TACTUS_SOURCE_DIR) / "tests/hal/record/golden.tac"; }

class Keeper final : public FrameTap {
 public:
  void take(Stream, const RawFrame& frame) noexcept override { last.assign(frame.bytes.begin(), frame.bytes.end()); }
  std::vector<std::uint8_t> last;
};

TEST(TacGolden, TheFirstVersionsFileStillPlays) {
  auto sensor = open_tac(golden(), {});
  ASSERT_TRUE(sensor) << sensor.error().message;
  EXPECT_TRUE(sensor->notes.empty());
  EXPECT_EQ(sensor->frames_count, 3U);
  EXPECT_EQ(sensor->calibration.depth.fy, 14.5);
  ASSERT_EQ(sensor->truth.size(), 1U);
  Keeper keeper;
  sensor->color->set_tap(&keeper);
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<std::uint8_t> rgb(3 * kPixels), ids(kPixels);
  FrameHeader header;
  for (std::uint64_t i = 0; i < 3; ++i) {
    ASSERT_EQ(sensor->depth->read(depth, header, {}), rt::Status::ok);
    EXPECT_EQ(depth, depth_of(i));
    EXPECT_EQ(header.time, header_of(i).time);
    EXPECT_EQ(header.sequence, 40 + i);
    EXPECT_EQ(header.arrived, header_of(i).arrived);
    ASSERT_EQ(sensor->color->read(rgb, header, {}), rt::Status::ok);
    EXPECT_EQ(keeper.last, color_of(kFormats[i], i));
    EXPECT_EQ(crc32c(rgb), kRgbSums[i]) << "pixels are the same on every machine";
    ASSERT_EQ(sensor->labels->read(40 + i, ids), rt::Status::ok);
    EXPECT_EQ(ids, std::vector<std::uint8_t>(kPixels, static_cast<std::uint8_t>(i)));
  }
  const auto facts = tac_facts(golden());
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->info, (TacInfo{{{"source", "golden"}}}));
}

/// Chunk by chunk: headers and unpacked bytes. What zstd makes of them is zstd's, and changes with its version.
TEST(TacGolden, TodaysWriterWritesTheSame) {
  const test::TemporaryFolder folder;
  write_golden(folder.path() / "now.tac");
  const auto then = TacFile::open(golden()), now = TacFile::open(folder.path() / "now.tac");
  ASSERT_TRUE(then) << then.error().message;
  ASSERT_TRUE(now) << now.error().message;
  EXPECT_EQ(format_file_header((*now)->header()), format_file_header((*then)->header()));
  const auto &a = (*then)->entries(), &b = (*now)->entries();
  ASSERT_EQ(a.size(), b.size());
  const auto unpacked = [](const TacFile& file, const IndexEntry& entry) {
    std::vector<std::uint8_t> buffer(TacFile::chunk_bytes(entry)), out(entry.header.raw_bytes);
    std::span<const std::uint8_t> payload;
    EXPECT_EQ(file.read_chunk(entry, buffer, payload), nullptr);
    Unpacker unpacker({kWidth, kHeight});
    EXPECT_TRUE(unpacker.unpack(entry.header.packing, entry.header.format, payload, out));
    return out;
  };
  std::array<int, 4> packings{};
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].header.type, b[i].header.type) << i;
    EXPECT_EQ(a[i].header.format, b[i].header.format) << i;
    EXPECT_EQ(a[i].header.packing, b[i].header.packing) << i;
    EXPECT_EQ(a[i].header.frame.time, b[i].header.frame.time) << i;
    EXPECT_EQ(a[i].header.frame.sequence, b[i].header.frame.sequence) << i;
    EXPECT_EQ(a[i].header.frame.arrived, b[i].header.frame.arrived) << i;
    ++packings[static_cast<std::size_t>(a[i].header.packing)];
    EXPECT_EQ(unpacked(**then, a[i]), unpacked(**now, b[i])) << i;
  }
  for (const int count : packings) EXPECT_GT(count, 0) << "every packing has its example";
}

/// The bytes of a chunk's header and of an end, as chunk.hpp has them.
TEST(TacGolden, HeadersHaveTheirBytes) {
  const ChunkHeader header{.type = ChunkType::color, .format = PixelFormat::nv12, .packing = Packing::deltas_zstd,
                           .payload_bytes = 0x0102030405060708, .raw_bytes = 0x1112131415161718,
                           .frame = {{0x2122232425262728}, 0x3132333435363738, {0x4142434445464748}},
                           .payload_crc = 0x51525354};
  const ChunkHeaderBytes bytes = encode(header);
  const std::array<std::uint8_t, 52> expected{
      'T',  'A',  'C',  0xB5, 3,    3,    3,    0,    0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x18, 0x17,
      0x16, 0x15, 0x14, 0x13, 0x12, 0x11, 0x28, 0x27, 0x26, 0x25, 0x24, 0x23, 0x22, 0x21, 0x38, 0x37, 0x36, 0x35,
      0x34, 0x33, 0x32, 0x31, 0x48, 0x47, 0x46, 0x45, 0x44, 0x43, 0x42, 0x41, 0x54, 0x53, 0x52, 0x51};
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), bytes.begin()));
  const auto back = decode_chunk_header(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(encode(*back), bytes);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    ChunkHeaderBytes damaged = bytes;
    damaged[i] ^= 4;
    EXPECT_FALSE(decode_chunk_header(damaged)) << "byte " << i;
  }
  EndCounts counts{.last_index_offset = 1, .chunks_count = 2, .streams = {{{3, 4, 5}, {6, 7, 8}}}};
  const auto end = encode(counts);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(end[8 * i], i + 1);
  EXPECT_EQ(decode_end(end).streams, counts.streams);
}

}  // namespace
}  // namespace tactus::hal::record
