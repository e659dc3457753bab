#include "pipeline/contact/materials.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "pipeline/contact/contact_law.hpp"

namespace tactus::contact {
namespace {

std::string replaced(const std::string& from, const std::string& to) {
  std::string text(default_material_toml());
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string complaint(const std::string& toml) {
  const auto result = parse_material_table(toml, "my.toml");
  EXPECT_FALSE(result.has_value());
  if (result) return "";
  EXPECT_EQ(result.error().code, rt::ExitCode::bad_usage);
  return result.error().message;
}

TEST(Materials, BuiltInTableIsTheFileInTheSource) {
  std::ifstream file(std::filesystem::path(TACTUS_SOURCE_DIR) / "pipeline/contact/materials.toml");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), default_material_toml());
}

TEST(Materials, BuiltInTableIsPhysicallyOrdered) {
  const MaterialTable sut = default_material_table();
  const auto of = [&](const char* name) { return sut.of(material_from_name(name)); };
  EXPECT_GT(of("glass").restitution, of("wood").restitution);
  EXPECT_GT(of("wood").restitution, of("carpet").restitution);
  EXPECT_GT(of("carpet").rolling_resistance, of("tile").rolling_resistance);
  EXPECT_GT(of("fabric").compliance_m_per_n, 100 * of("stone").compliance_m_per_n);
  for (const ContactProperties& p : sut.properties) EXPECT_LE(p.kinetic_friction, p.static_friction);
  EXPECT_EQ(&sut.of(kUnknownMaterial), &sut.of(material_from_name("other")));
}

TEST(Materials, UnknownMaterialNamesFileAndLine) {
  const std::string message = complaint(replaced("[brick]", "[bricks]"));
  EXPECT_NE(message.find("my.toml:23: [bricks]"), std::string::npos) << message;
}

TEST(Materials, MissingMaterialIsNamed) {
  std::string text(default_material_toml());
  text.resize(text.find("[wood]"));
  EXPECT_NE(complaint(text).find("[wood] is missing"), std::string::npos);
}

TEST(Materials, UnknownKeyNamesLineAndKey) {
  const std::string message = complaint(replaced("[brick]\nrestitution ", "[brick]\nbouncyness "));
  EXPECT_NE(message.find("my.toml:24:"), std::string::npos) << message;
  EXPECT_NE(message.find("bouncyness"), std::string::npos) << message;
}

TEST(Materials, MissingKeyIsNamed) {
  const std::string message =
      complaint(replaced("restitution        = { value = 0.55, source = \"estimated\" }\n", ""));
  EXPECT_NE(message.find("[brick] restitution is missing"), std::string::npos) << message;
}

TEST(Materials, NumberOutsideItsRangeIsRefused) {
  const std::string message = complaint(replaced("value = 0.55", "value = 1.55"));
  EXPECT_NE(message.find("my.toml:24: [brick] restitution is 1.55; it must lie between 0 and 1"),
            std::string::npos)
      << message;
  EXPECT_NE(complaint(replaced("value = 0.55", "value = nan")).find("must lie between"), std::string::npos);
}

TEST(Materials, NumberWithoutSourceIsRefused) {
  EXPECT_NE(complaint(replaced("value = 0.55, source = \"estimated\"", "value = 0.55")).find("has no source"),
            std::string::npos);
  EXPECT_NE(complaint(replaced("value = 0.55, source = \"estimated\"", "value = 0.55, source = \"\""))
                .find("no source"),
            std::string::npos);
}

TEST(Materials, WrongTypesAreRefused) {
  EXPECT_NE(complaint(replaced("{ value = 0.55, source = \"estimated\" }", "0.55")).find("must be { value"),
            std::string::npos);
  EXPECT_NE(complaint(replaced("value = 0.55", "value = \"high\"")).find("has no number"), std::string::npos);
  EXPECT_NE(complaint("brick = 3\n").find("must be a table"), std::string::npos);
}

TEST(Materials, EveryMaterialSaysHowItBreaksSoundsAndLooks) {
  const MaterialTable sut = default_material_table();
  for (std::size_t i = 0; i < kMaterialCount; ++i) {
    const FractureProperties& f = sut.fracture[i];
    EXPECT_EQ(f.pattern == BreakPattern::none, f.chips_per_joule == 0) << kMaterialNames[i];
    EXPECT_EQ(f.decal == DecalKind::none, f.decal_radius_m == 0) << kMaterialNames[i];
    EXPECT_GT(sut.sound[i].mode_frequency_hz, 0) << kMaterialNames[i];
    EXPECT_GT(sut.sound[i].loss_factor, 0) << kMaterialNames[i];
    EXPECT_GT(sut.look[i].optical_roughness, 0) << kMaterialNames[i];
  }
  const auto id = [](const char* name) { return material_from_name(name); };
  EXPECT_EQ(sut.fracture_of(id("glass")).decal, DecalKind::cracks);
  EXPECT_EQ(sut.fracture_of(id("wood")).pattern, BreakPattern::splinters);
  EXPECT_LT(sut.sound_of(id("metal")).loss_factor, sut.sound_of(id("fabric")).loss_factor);
  EXPECT_GT(sut.sound_of(id("carpet")).absorption[2], sut.sound_of(id("tile")).absorption[2]);
  EXPECT_EQ(sut.look_of(id("metal")).metalness, 1);
  EXPECT_EQ(&sut.fracture_of(kUnknownMaterial), &sut.fracture_of(id("other")));
}

TEST(Materials, WordThatIsNoChoiceNamesTheChoices) {
  const std::string message = complaint(replaced("decal              = \"crater\"", "decal = \"hole\""));
  EXPECT_NE(message.find("[brick] decal must be one of none, crater, cracks, tear, splinter, dent"), std::string::npos)
      << message;
  EXPECT_NE(complaint(replaced("fracture_pattern   = \"crumbs\"", "fracture_pattern = 3")).find("must be one of"),
            std::string::npos);
  EXPECT_NE(complaint(replaced("fracture_pattern   = \"crumbs\"\n", "")).find("fracture_pattern is missing"),
            std::string::npos);
}

TEST(Materials, SlidingThatGripsMoreThanRestIsRefused) {
  EXPECT_NE(complaint(replaced("kinetic_friction   = { value = 0.6,", "kinetic_friction   = { value = 0.95,"))
                .find("kinetic_friction is greater"),
            std::string::npos);
}

TEST(Materials, BrokenTomlNamesTheLine) {
  const std::string message = complaint("[brick]\nrestitution = = 3\n");
  EXPECT_NE(message.find("my.toml:2: not valid TOML"), std::string::npos) << message;
}

TEST(Materials, EmptyAndBinaryTextsAreRefusedWithoutACrash) {
  EXPECT_FALSE(complaint("").empty());
  EXPECT_FALSE(complaint(std::string("\0\xff\xfe[[[", 6)).empty());
}

TEST(Materials, MissingFileAndFolderAreOneSentence) {
  for (const char* path : {"/nowhere/materials.toml", "/tmp"}) {
    const auto result = load_material_table(path);
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code, rt::ExitCode::bad_usage);
    EXPECT_EQ(result.error().message.find(path), 0U);
  }
}

TEST(ContactLaw, AgainstAStifferPartnerEachMaterialShowsItsOwnRestitution) {
  const MaterialTable table = default_material_table();
  const ContactProperties& carpet = table.of(material_from_name("carpet"));
  const ContactProperties& glass = table.of(material_from_name("glass"));
  EXPECT_NEAR(combine(glass, carpet).restitution, carpet.restitution, 1e-3);
  EXPECT_NEAR(combine(carpet, glass).restitution, carpet.restitution, 1e-3);
  EXPECT_DOUBLE_EQ(combine(glass, glass).restitution, glass.restitution);
}

TEST(ContactLaw, LiesBetweenItsTwoMaterialsAndIsSymmetric) {
  const MaterialTable table = default_material_table();
  for (const ContactProperties& a : table.properties)
    for (const ContactProperties& b : table.properties) {
      const ContactLaw law = combine(a, b), mirrored = combine(b, a);
      EXPECT_GE(law.restitution, std::min(a.restitution, b.restitution) - 1e-12);
      EXPECT_LE(law.restitution, std::max(a.restitution, b.restitution) + 1e-12);
      EXPECT_DOUBLE_EQ(law.static_friction, std::sqrt(a.static_friction * b.static_friction));
      EXPECT_DOUBLE_EQ(law.restitution, mirrored.restitution);
      EXPECT_LE(law.kinetic_friction, law.static_friction);
    }
}

TEST(ContactLaw, ExpectationIsLinearInTheProbabilities) {
  const MaterialTable table = default_material_table();
  const ContactProperties& ball = table.of(material_from_name("plastic"));
  MaterialDistribution mixed{};
  mixed[material_from_name("wood")] = 0.7F;
  mixed[material_from_name("fabric")] = 0.3F;
  const ContactLaw wood = combine(ball, table.of(material_from_name("wood")));
  const ContactLaw fabric = combine(ball, table.of(material_from_name("fabric")));
  const ContactLaw sut = expected_law(ball, mixed, table);
  EXPECT_NEAR(sut.restitution, 0.7 * wood.restitution + 0.3 * fabric.restitution, 1e-6);
  EXPECT_NEAR(sut.static_friction, 0.7 * wood.static_friction + 0.3 * fabric.static_friction, 1e-6);
  EXPECT_NEAR(sut.compliance_m_per_n, 0.3 * fabric.compliance_m_per_n + 0.7 * wood.compliance_m_per_n, 1e-9);
}

TEST(ContactLaw, EmptyOrBrokenDistributionActsAsOther) {
  const MaterialTable table = default_material_table();
  const ContactProperties& ball = table.of(material_from_name("plastic"));
  MaterialDistribution sick{};
  sick[3] = std::nanf("");
  sick[4] = -1;
  const double other = combine(ball, table.of(kUnknownMaterial)).restitution;
  EXPECT_DOUBLE_EQ(expected_law(ball, MaterialDistribution{}, table).restitution, other);
  EXPECT_DOUBLE_EQ(expected_law(ball, sick, table).restitution, other);
}

}  // namespace
}  // namespace tactus::contact
