#include "tests/bench/crf_points_file.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

namespace tactus::bench {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian");
constexpr std::array<char, 8> kMagic{'T', 'A', 'C', 'T', 'C', 'R', 'F', '1'};
constexpr std::size_t kHeaderBytes = 16;

struct Record {
  std::array<float, 3> position_m, normal;
  std::array<std::uint8_t, 3> color;
  std::uint8_t truth;
  std::array<float, kMaterialCount> unary_nat;
};
static_assert(sizeof(Record) == 120);

}  // namespace

rt::Result<LabelledPoints> read_points(const std::string& path) {
  const auto fail = [&](const std::string& what) {
    return rt::Error{rt::ExitCode::bad_input, path + ": " + what};
  };
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail("the points cannot be read");
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    return fail("does not begin with TACTCRF1");
  std::uint32_t count = 0, materials = 0;
  std::memcpy(&count, &bytes[8], 4);
  std::memcpy(&materials, &bytes[12], 4);
  if (materials != kMaterialCount)
    return fail("has " + std::to_string(materials) + " materials instead of 23");
  if (bytes.size() != kHeaderBytes + sizeof(Record) * count)
    return fail("holds " + std::to_string(bytes.size()) + " bytes where " + std::to_string(count) +
                " points need " + std::to_string(kHeaderBytes + sizeof(Record) * count));
  LabelledPoints points;
  for (std::size_t i = 0; i < count; ++i) {
    Record r;
    std::memcpy(&r, &bytes[kHeaderBytes + i * sizeof(Record)], sizeof(Record));
    if (r.truth >= kMaterialCount && r.truth != kUnknownMaterial)
      return fail("point " + std::to_string(i) + " is of material " + std::to_string(r.truth));
    points.position_m.push_back({r.position_m[0], r.position_m[1], r.position_m[2]});
    points.normal.push_back({r.normal[0], r.normal[1], r.normal[2]});
    points.color.push_back({r.color[0], r.color[1], r.color[2]});
    points.truth.push_back(r.truth);
    points.unary_nat.insert(points.unary_nat.end(), r.unary_nat.begin(), r.unary_nat.end());
  }
  if (!label::is_valid(points.points())) return fail("holds a number that is not finite");
  return points;
}

rt::Result<void> write_points(const std::string& path, const LabelledPoints& points) {
  std::ofstream out(path, std::ios::binary);
  const auto count = static_cast<std::uint32_t>(points.size()),
             materials = static_cast<std::uint32_t>(kMaterialCount);
  out.write(kMagic.data(), kMagic.size());
  out.write(reinterpret_cast<const char*>(&count), 4);
  out.write(reinterpret_cast<const char*>(&materials), 4);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f p = points.position_m[i], n = points.normal[i];
    const Rgb8 c = points.color[i];
    Record r{{p.x, p.y, p.z}, {n.x, n.y, n.z}, {c.r, c.g, c.b}, points.truth[i], {}};
    std::memcpy(r.unary_nat.data(), &points.unary_nat[i * kMaterialCount], sizeof(r.unary_nat));
    out.write(reinterpret_cast<const char*>(&r), sizeof(r));
  }
  out.close();
  if (!out) return rt::Error{rt::ExitCode::failed, path + ": the points cannot be written"};
  return {};
}

}  // namespace tactus::bench
