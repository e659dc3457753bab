#include "pipeline/label/crf/crf_settings.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace tactus::label {
namespace {

constexpr const char* kGood = R"(preset = "paper"
iterations_max = 12
settled_change = 0.002
normalisation = "symmetric"
[smoothness]
weight = 1.5
theta_position_m = 0.04
[appearance]
weight = 3
theta_position_m = 0.25
theta_color = 15.5
[surface]
weight = 0.0
theta_position_m = 0.06
theta_normal = 0.2
[compatibility]
default_cost = 0.9
[[compatibility.pair]]
materials = ["painted", "wallpaper"]
cost = 0.3
)";

TEST(CrfSettings, ReadsEveryKey) {
  const auto sut = parse_crf_parameters(kGood, "crf.toml");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->iterations_max, 12);
  EXPECT_FLOAT_EQ(sut->settled_change, 0.002F);
  EXPECT_EQ(sut->normalisation, CrfNormalisation::symmetric);
  EXPECT_FLOAT_EQ(sut->smoothness.weight, 1.5F);
  EXPECT_FLOAT_EQ(sut->smoothness.theta_position_m, 0.04F);
  EXPECT_FLOAT_EQ(sut->appearance.weight, 3.0F);
  EXPECT_FLOAT_EQ(sut->appearance.theta_color, 15.5F);
  EXPECT_FLOAT_EQ(sut->surface.weight, 0.0F);
  EXPECT_FLOAT_EQ(sut->surface.theta_normal, 0.2F);
  ASSERT_FALSE(sut->compatibility.is_potts);
  const MaterialId painted = material_from_name("painted"), wallpaper = material_from_name("wallpaper");
  EXPECT_FLOAT_EQ(sut->compatibility.of(painted, wallpaper), 0.3F);
  EXPECT_FLOAT_EQ(sut->compatibility.of(wallpaper, painted), 0.3F);
  EXPECT_FLOAT_EQ(sut->compatibility.of(painted, painted), 0.0F);
  EXPECT_FLOAT_EQ(sut->compatibility.of(0, painted), 0.9F);
  EXPECT_TRUE(is_valid(*sut));
}

TEST(CrfSettings, WhatIsLeftOutKeepsThePreset) {
  const auto nothing = parse_crf_parameters("", "crf.toml"),
             paper = parse_crf_parameters("preset = \"paper\"", "crf.toml"),
             one = parse_crf_parameters("[surface]\nweight = 7.0\n", "crf.toml");
  ASSERT_TRUE(nothing && paper && one);
  EXPECT_EQ(nothing->normalisation, CrfNormalisation::symmetric);
  EXPECT_TRUE(nothing->compatibility.is_potts);
  EXPECT_EQ(paper->iterations_max, 30);
  EXPECT_FLOAT_EQ(paper->appearance.weight, 4.0F);
  EXPECT_FLOAT_EQ(paper->appearance.theta_position_m, 0.3F);
  EXPECT_FLOAT_EQ(paper->appearance.theta_color, 20.0F);
  EXPECT_FLOAT_EQ(paper->smoothness.weight, 1.3F);
  EXPECT_FLOAT_EQ(paper->smoothness.theta_position_m, 0.03F);
  EXPECT_FLOAT_EQ(paper->surface.theta_position_m, 0.05F);
  EXPECT_FLOAT_EQ(paper->surface.theta_normal, 0.1F);
  EXPECT_FLOAT_EQ(one->surface.weight, 7.0F);
  EXPECT_FLOAT_EQ(one->surface.theta_normal, nothing->surface.theta_normal);
}

TEST(CrfSettings, MistakesAreNamedWithFileLineAndKey) {
  struct Case {
    const char* from;
    const char* to;
    const char* expected;
  };
  const Case cases[] = {
      {"\"paper\"", "\"papers\"", "crf.toml:1: preset: must be \"default\" or \"paper\""},
      {"= 12", "= 12.5", "crf.toml:2: iterations_max: must be a whole number from 0 to 1000"},
      {"= 12", "= 1001", "crf.toml:2: iterations_max: must be a whole number"},
      {"0.002", "-1", "crf.toml:3: settled_change: must be a number from 0.0 to 1.0"},
      {"\"symmetric\"", "3", "crf.toml:4: normalisation: must be \"symmetric\" or \"per_point\""},
      {"weight = 1.5", "weight = -1.5", "crf.toml:6: smoothness.weight: must be a number from 0.0"},
      {"weight = 1.5", "wieght = 1.5", "crf.toml:6: smoothness.wieght: unknown key"},
      {"0.04", "0.0", "crf.toml:7: smoothness.theta_position_m: must be a number"},
      {"0.04", "nan", "crf.toml:7: smoothness.theta_position_m: must be a number"},
      {"15.5", "\"blue\"", "crf.toml:11: appearance.theta_color: must be a number"},
      {"theta_normal", "theta_color", "crf.toml:15: surface.theta_color: unknown key"},
      {"[surface]", "[surfaces]", "surfaces: unknown key"},
      {"0.9", "101", "crf.toml:17: compatibility.default_cost: must be a number"},
      {"\"wallpaper\"", "\"wall\"", "crf.toml:19: compatibility.pair.materials: must be two names"},
      {"\"wallpaper\"", "\"painted\"",
       "crf.toml:19: compatibility.pair.materials: a material costs nothing beside itself"},
      {", \"wallpaper\"", "", "crf.toml:19: compatibility.pair.materials: must be two material names"},
      {"cost = 0.3", "", "compatibility.pair.cost: is missing"},
      {"cost = 0.3\n",
       "cost = 0.3\n[[compatibility.pair]]\nmaterials = [\"wallpaper\", \"painted\"]\ncost = 1.0\n",
       "crf.toml:22: compatibility.pair.materials: this pair was given before"},
      {"[[compatibility.pair]]", "[compatibility.pair]",
       "compatibility.pair: must be [[compatibility.pair]]"},
      {"preset = \"paper\"", "smoothness = 1\npreset = \"paper\"", "crf.toml:6: "},
  };
  for (const Case& c : cases) {
    std::string text = kGood;
    const auto at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    text.replace(at, std::string(c.from).size(), c.to);
    const auto sut = parse_crf_parameters(text, "crf.toml");
    ASSERT_FALSE(sut) << c.to;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(sut.error().message.find(c.expected), std::string::npos)
        << sut.error().message << "\nexpected " << c.expected;
  }
}

TEST(CrfSettings, SectionThatIsNoneIsNamed) {
  const auto sut = parse_crf_parameters("smoothness = 1\n", "crf.toml");
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().message, "crf.toml:1: smoothness: must be a section [smoothness]");
}

TEST(CrfSettings, WrittenParametersAreReadBackTheSame) {
  auto parameters = parse_crf_parameters(kGood, "crf.toml");
  ASSERT_TRUE(parameters);
  parameters->smoothness.weight = 1.0F / 3;
  const auto again = parse_crf_parameters(format_crf_parameters(*parameters), "again.toml");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->smoothness.weight, parameters->smoothness.weight);
  EXPECT_EQ(again->appearance.theta_color, parameters->appearance.theta_color);
  EXPECT_EQ(again->settled_change, parameters->settled_change);
  EXPECT_EQ(again->compatibility.cost, parameters->compatibility.cost);
  const auto potts = parse_crf_parameters(format_crf_parameters(default_crf_parameters()), "potts.toml");
  ASSERT_TRUE(potts) << potts.error().message;
  EXPECT_TRUE(potts->compatibility.is_potts);
  EXPECT_EQ(potts->surface.theta_normal, default_crf_parameters().surface.theta_normal);
}

TEST(CrfSettings, FileThatIsMissingIsNamed) {
  const auto sut = load_crf_parameters("no/such/crf.toml");
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("no/such/crf.toml: the CRF settings cannot be read"), std::string::npos)
      << sut.error().message;
}

}  // namespace
}  // namespace tactus::label
