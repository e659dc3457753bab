// What a recording's depth costs: the recorder's own codec beside RVL, LZ4 and plain zstd, and the price of its parts.
//
//   depth_codec_bench [--frames N]
//
// Images: the synthetic rooms with a Kinect's noise, and the recordings in ../shared/data (TACTUS_SHARED_DATA) where they
// are. Every way is checked to give back the same bits. Times are of one thread, processor time, every image once. Then the
// whole recorder: what take() costs the thread that reads the cameras, and what the rest costs in processor time.
#include <lz4.h>
#include <zstd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "hal/record/crc32c.hpp"
#include "hal/frames/convert.hpp"
#include "hal/record/packer.hpp"
#include "hal/record/tac_writer.hpp"
#include "hal/replay/replay.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "tests/bench/depth_codec_peers.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::bench {
namespace {

using Image = std::vector<std::uint16_t>;
using Bytes = std::vector<std::uint8_t>;

double now_ms(clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
  timespec now{};
  clock_gettime(clock, &now);  // what other work takes away does not count
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::span<const std::uint8_t> bytes_of(const Image& image) {
  return {reinterpret_cast<const std::uint8_t*>(image.data()), 2 * image.size()};
}

struct Codec {
  std::string name;
  std::function<void(const Image&, Bytes&)> encode;
  std::function<bool(const Bytes&, Image&)> decode;
};

double middle(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void measure(const Codec& codec, const std::vector<Image>& images) {
  std::vector<double> encode_ms, decode_ms;
  double in_bytes = 0, out_bytes = 0;
  Bytes packed;
  Image back(images.front().size());
  for (const Image& image : images) {
    const double begin = now_ms();
    codec.encode(image, packed);
    const double encoded = now_ms();
    const bool is_good = codec.decode(packed, back);
    decode_ms.push_back(now_ms() - encoded);
    encode_ms.push_back(encoded - begin);
    if (!is_good || back != image) {
      std::fprintf(stderr, "depth_codec_bench: %s does not give back what it took\n", codec.name.c_str());
      std::exit(1);
    }
    in_bytes += 2.0 * static_cast<double>(image.size());
    out_bytes += static_cast<double>(packed.size());
  }
  const double encode = middle(encode_ms);
  std::printf("  %-26s %6.2f  %8.0f  %7.2f %7.2f  %7.2f   %5.1f %%\n", codec.name.c_str(), in_bytes / out_bytes,
              out_bytes / static_cast<double>(images.size()), encode, encode_ms.back(), middle(decode_ms),
              60 * encode / 10);
}

std::vector<Codec> codecs(int width, int height) {
  static ZSTD_CCtx* compressor = ZSTD_createCCtx();
  static ZSTD_DCtx* decompressor = ZSTD_createDCtx();
  static Bytes filtered;
  const auto zstd_of = [](int level, const void* from, std::size_t count, Bytes& out) {
    out.resize(ZSTD_compressBound(count));
    out.resize(ZSTD_compressCCtx(compressor, out.data(), out.size(), from, count, level));
  };
  const auto from_zstd = [](const Bytes& in, void* to, std::size_t count) {
    return ZSTD_decompressDCtx(decompressor, to, count, in.data(), in.size()) == count;
  };
  const auto lz4_of = [](const void* from, std::size_t count, Bytes& out) {
    out.resize(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(count))));
    out.resize(static_cast<std::size_t>(LZ4_compress_default(static_cast<const char*>(from),
                                                             reinterpret_cast<char*>(out.data()),
                                                             static_cast<int>(count), static_cast<int>(out.size()))));
  };
  const auto from_lz4 = [](const Bytes& in, void* to, std::size_t count) {
    return LZ4_decompress_safe(reinterpret_cast<const char*>(in.data()), static_cast<char*>(to),
                               static_cast<int>(in.size()), static_cast<int>(count)) == static_cast<int>(count);
  };
  std::vector<Codec> out;
  out.push_back({"RVL", [](const Image& in, Bytes& to) { rvl_encode(in, to); },
                 [](const Bytes& in, Image& to) { return rvl_decode(in, to); }});
  out.push_back({"LZ4", [=](const Image& in, Bytes& to) { lz4_of(in.data(), 2 * in.size(), to); },
                 [=](const Bytes& in, Image& to) { return from_lz4(in, to.data(), 2 * to.size()); }});
  out.push_back({"zstd 1", [=](const Image& in, Bytes& to) { zstd_of(1, in.data(), 2 * in.size(), to); },
                 [=](const Bytes& in, Image& to) { return from_zstd(in, to.data(), 2 * to.size()); }});
  out.push_back({"median, planes, LZ4",
                 [=](const Image& in, Bytes& to) {
                   median_planes(in, width, filtered);
                   lz4_of(filtered.data(), filtered.size(), to);
                 },
                 [=](const Bytes& in, Image& to) {
                   filtered.resize(2 * to.size());
                   if (!from_lz4(in, filtered.data(), filtered.size())) return false;
                   from_median_planes(filtered, width, to);
                   return true;
                 }});
  out.push_back({"median, planes, zstd 1",
                 [=](const Image& in, Bytes& to) {
                   median_planes(in, width, filtered);
                   zstd_of(1, filtered.data(), filtered.size(), to);
                 },
                 [=](const Bytes& in, Image& to) {
                   filtered.resize(2 * to.size());
                   if (!from_zstd(in, filtered.data(), filtered.size())) return false;
                   from_median_planes(filtered, width, to);
                   return true;
                 }});
  static std::vector<hal::record::DepthRanks> ranks;
  ranks.clear();
  ranks.emplace_back(width, height);
  for (const int level : {-1, 2, 3})
    out.push_back({"ranks, zstd " + std::to_string(level),
                   [=](const Image& in, Bytes& to) {
                     filtered.resize(hal::record::ranks_bytes_max(in.size()));
                     zstd_of(level, filtered.data(), ranks[0].pack(in, filtered), to);
                   },
                   [=](const Bytes& in, Image& to) {
                     filtered.resize(hal::record::ranks_bytes_max(to.size()));
                     const std::size_t count =
                         ZSTD_decompressDCtx(decompressor, filtered.data(), filtered.size(), in.data(), in.size());
                     return ZSTD_isError(count) == 0 && ranks[0].unpack(std::span(filtered).first(count), to);
                   }});
  static std::unique_ptr<hal::record::Packer> packer;
  static std::unique_ptr<hal::record::Unpacker> unpacker;
  static hal::record::Packing packing;
  packer = std::make_unique<hal::record::Packer>(hal::record::FrameSize{width, height});
  unpacker = std::make_unique<hal::record::Unpacker>(hal::record::FrameSize{width, height});
  out.push_back({"recorder (ranks, zstd 1)",
                 [](const Image& in, Bytes& to) {
                   const auto packed = packer->pack(hal::PixelFormat::depth16, bytes_of(in));
                   packing = packed.packing;
                   to.assign(packed.payload.begin(), packed.payload.end());
                 },
                 [](const Bytes& in, Image& to) {
                   return unpacker->unpack(packing, hal::PixelFormat::depth16, in,
                                           {reinterpret_cast<std::uint8_t*>(to.data()), 2 * to.size()});
                 }});
  return out;
}

/// Depth alone, then depth and colour, as two cameras at 30 Hz would give them, without the waiting.
void record(const hal::Sensor& sensor, const std::vector<Image>& images, const std::vector<Bytes>& colors) {
  const hal::Intrinsics &k = sensor.calibration.depth, &c = sensor.calibration.color;
  const test::TemporaryFolder folder;
  for (const bool with_color : {false, true}) {
    if (with_color && colors.empty()) continue;
    const auto path = folder.path() / (with_color ? "both.tac" : "depth.tac");
    auto writer = hal::record::TacWriter::create(path, sensor, {}, {.waits_when_full = true});
    if (!writer) {
      std::printf("  recorder: %s\n", writer.error().message.c_str());
      return;
    }
    std::vector<double> take_us;
    const double begin = now_ms(CLOCK_PROCESS_CPUTIME_ID);
    for (std::size_t i = 0; i < images.size(); ++i) {
      const hal::FrameHeader header{{static_cast<std::int64_t>(i) * 33'333'333 + 1}, i, {1}};
      const double taken = now_ms();
      (*writer)->take(hal::Stream::depth, hal::frames::raw_frame(images[i], header, k.width, k.height));
      take_us.push_back(1e3 * (now_ms() - taken));
      if (with_color)
        (*writer)->take(hal::Stream::color,
                        hal::frames::raw_frame(colors[i % colors.size()], header, c.width, c.height));
    }
    const std::size_t buffers_bytes = (*writer)->buffers_bytes();
    if (const auto closed = (*writer)->close(); !closed) std::printf("  recorder: %s\n", closed.error().message.c_str());
    const double frame_ms = (now_ms(CLOCK_PROCESS_CPUTIME_ID) - begin) / static_cast<double>(images.size());
    const double frame_bytes =
        static_cast<double>(std::filesystem::file_size(path)) / static_cast<double>(images.size());
    const double take = middle(take_us);
    std::printf("  recorder, %-16s %.2f ms a frame of all threads (%.1f %% of one core at %d Hz), take() %.0f us,\n"
                "  %.1f MB a minute at 30 Hz, %.1f MB of memory\n",
                with_color ? "depth and RGB:" : "depth alone:", frame_ms, (with_color ? 30 : 60) * frame_ms / 10,
                with_color ? 30 : 60, take, frame_bytes * 1800 / 1e6, static_cast<double>(buffers_bytes) / 1e6);
  }
}

void compare(const char* name, rt::Result<hal::Sensor> sensor, std::size_t frames_count) {
  if (!sensor) {
    std::printf("%s: left out (%s)\n", name, sensor.error().message.c_str());
    return;
  }
  const hal::Intrinsics& k = sensor->calibration.depth;
  std::vector<Image> images;
  std::vector<Bytes> colors;
  std::set<std::size_t> distinct;
  for (hal::FrameHeader header; images.size() < frames_count;) {
    Image image(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
    if (sensor->depth->read(image, header, {}) != rt::Status::ok) break;
    distinct.insert(std::set<std::uint16_t>(image.begin(), image.end()).size());
    images.push_back(std::move(image));
    if (!sensor->color || colors.size() >= 10) continue;
    Bytes color(static_cast<std::size_t>(sensor->calibration.color.width) *
                static_cast<std::size_t>(sensor->calibration.color.height) * 3);
    if (sensor->color->read(color, header, {}) == rt::Status::ok) colors.push_back(std::move(color));
  }
  if (images.empty()) return;
  std::printf("%s: %zu frames of %dx%d, %zu to %zu distinct values each\n", name, images.size(), k.width, k.height,
              *distinct.begin(), *distinct.rbegin());
  std::printf("  %-26s  ratio     bytes   encode     max   decode   of one core at 60 Hz\n", "");
  for (const Codec& codec : codecs(k.width, k.height)) measure(codec, images);
  double begin = now_ms();
  std::uint32_t sum = 0;
  for (const Image& image : images) sum ^= hal::record::crc32c(bytes_of(image));
  const double by_processor = now_ms() - begin;
  begin = now_ms();
  for (const Image& image : images) sum ^= hal::record::crc32c_by_tables(bytes_of(image));
  const auto count = static_cast<double>(images.size());
  std::printf("  checksum of the raw image: %.3f ms, by tables %.3f ms%s\n", by_processor / count,
              (now_ms() - begin) / count, sum == 0 ? "" : ", and they differ");
  record(*sensor, images, colors);
}

int run(std::size_t frames_count) {
  for (const char* room : {"bedroom", "office"}) {
    auto options = hal::parse_synthetic_name(std::string("synthetic:") + room + "?frames=60");
    compare(room, options ? hal::open_synthetic(*options) : rt::Result<hal::Sensor>(options.error()),
            std::min<std::size_t>(frames_count, 20));
  }
  for (const char* folder : {"tum_fr1_rpy", "kitchen_7scenes"}) {
    const auto path = test::shared_data(folder);
    if (!path) {
      std::printf("%s: left out (not in ../shared/data)\n", folder);
      continue;
    }
    compare(folder, hal::open_replay(*path, {}), frames_count);
  }
  return 0;
}

}  // namespace
}  // namespace tactus::bench

int main(int argc, char** argv) {
  std::size_t frames_count = 60;
  if (argc == 3 && std::string(argv[1]) == "--frames") frames_count = std::strtoul(argv[2], nullptr, 10);
  if ((argc != 1 && argc != 3) || frames_count == 0) {
    std::fprintf(stderr, "usage: depth_codec_bench [--frames N]\n");
    return 2;
  }
  return tactus::bench::run(frames_count);
}
