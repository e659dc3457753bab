#include "pipeline/segment/class_map.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace tactus::segment {
namespace {

constexpr const char* kGood = R"([network]
name = "net"
temperature = 2.0
[input]
order = "bgr"
mean = [1.0, 2.0, 3]
std = [4.0, 5.0, 6.0]
[[class]]
name = "wall"
materials = { painted = 0.75, brick = 0.25 }
[[class]]
name = "table"
materials = { wood = 1.0 }
)";

TEST(ClassMap, ReadsEveryKey) {
  const auto sut = parse_class_map(kGood, "map.toml");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->network, "net");
  EXPECT_FLOAT_EQ(sut->temperature, 2.0F);
  EXPECT_TRUE(sut->is_bgr);
  EXPECT_FLOAT_EQ(sut->mean[2], 3.0F);
  EXPECT_FLOAT_EQ(sut->std[0], 4.0F);
  ASSERT_EQ(sut->materials.size(), 2U);
  EXPECT_EQ(sut->class_names[1], "table");
  EXPECT_FLOAT_EQ(sut->materials[0][material_from_name("painted")], 0.75F);
  EXPECT_FLOAT_EQ(sut->materials[0][material_from_name("wood")], 0.0F);
}

TEST(ClassMap, MistakesAreNamedWithFileLineAndKey) {
  struct Case {
    const char* from;
    const char* to;
    const char* expected;
  };
  const Case cases[] = {
      {"painted = 0.75", "paint = 0.75",
       "map.toml:10: class 0.materials (wall): 'paint' is none of the 23 materials"},
      {"painted = 0.75", "painted = 0.7", "map.toml:10: class 0.materials (wall): shares sum to 0.95"},
      {"painted = 0.75", "painted = \"a\"",
       "map.toml:10: class 0.materials (wall).painted: must be a number"},
      {"painted = 0.75", "painted = 1.75", "map.toml:10: class 0.materials (wall).painted: must be a number"},
      {"temperature = 2.0", "temperature = 0.0", "map.toml:3: network.temperature: must be a number"},
      {"temperature", "temprature", "map.toml:3: network.temprature: unknown key"},
      {"order = \"bgr\"", "order = \"brg\"", "map.toml:5: input.order: must be \"rgb\" or \"bgr\""},
      {"mean = [1.0, 2.0, 3]", "mean = [1.0, 2.0]", "map.toml:6: input.mean: must be three numbers"},
      {"mean = [1.0, 2.0, 3]", "mean = [1.0, nan, 3]", "map.toml:6: input.mean: must be a number"},
      {"std = [4.0, 5.0, 6.0]", "", "input.std: is missing"},
      {"name = \"table\"", "name = 3", "map.toml:12: class 1.name: must be a string"},
      {"[network]", "[netwerk]", "map.toml:1: netwerk: unknown key"},
      {"[[class]]", "[[clas]]", "clas: unknown key"},
      {"name = \"net\"", "name = ", "map.toml:2: "},
      {"name = \"wall\"", "name = \"w\u00e4ll\"", "map.toml:9: not valid TOML: holds a character outside ASCII"},
      {"[network]", "[%", "map.toml:1: "},  // aborted inside the TOML library once
  };
  for (const Case& c : cases) {
    std::string text = kGood;
    for (std::size_t at = 0; (at = text.find(c.from, at)) != std::string::npos;
         at += std::string(c.to).size()) {
      text.replace(at, std::string(c.from).size(), c.to);
      if (std::string(c.from) != "[[class]]") break;
    }
    const auto sut = parse_class_map(text, "map.toml");
    ASSERT_FALSE(sut) << c.to;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(sut.error().message.find(c.expected), std::string::npos)
        << sut.error().message << "\n  expected: " << c.expected;
  }
}

TEST(ClassMap, FileWithoutClassesIsRefused) {
  const std::string text(kGood, std::string(kGood).find("[[class]]"));
  const auto sut = parse_class_map(text, "map.toml");
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("no [[class]] is given"), std::string::npos);
}

class ShippedClassMap : public testing::TestWithParam<std::pair<const char*, std::size_t>> {};

TEST_P(ShippedClassMap, IsCompleteAndEveryClassIsADistribution) {
  const auto sut =
      load_class_map(std::string(TACTUS_SOURCE_DIR) + "/pipeline/segment/models/" + GetParam().first);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->materials.size(), GetParam().second);
  for (const MaterialDistribution& materials : sut->materials)
    EXPECT_NEAR(std::accumulate(materials.begin(), materials.end(), 0.0F), 1.0F, 1e-5F);
}

INSTANTIATE_TEST_SUITE_P(Files, ShippedClassMap,
                         testing::Values(std::pair("ade20k32_to_minc23.toml", std::size_t{32}),
                                         std::pair("voc21_to_minc23.toml", std::size_t{21})),
                         [](const auto& shipped) { return shipped.index == 0 ? "ade20k32" : "voc21"; });

TEST(ClassMap, LoadNamesAFileThatIsNotThere) {
  const auto sut = load_class_map("/nonexistent/map.toml");
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("/nonexistent/map.toml: the class map cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace tactus::segment
