#include "hal/toml/toml_text.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace tactus::hal {
namespace {

TEST(ParseToml, ValidTextGivesItsTable) {
  const auto sut = parse_toml("a = 1\n[b]\nc = 'x'\n", "f.toml", rt::ExitCode::bad_usage);
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ((*sut)["a"].value<int>(), 1);
  EXPECT_EQ((*sut)["b"]["c"].value<std::string>(), "x");
}

TEST(ParseToml, BrokenTextNamesFileAndLineAndCarriesTheCode) {
  const auto sut = parse_toml("a = 1\nb = = 2\n", "f.toml", rt::ExitCode::bad_input);
  ASSERT_FALSE(sut.has_value());
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
  EXPECT_EQ(sut.error().message.rfind("f.toml:2: not valid TOML: ", 0), 0u) << sut.error().message;
}

TEST(ParseToml, TableHeaderThatTheLibraryAssertsOnIsRefused) {
  for (const char* text : {"[.]", "[", "[=]", "[a.]", "[[", "[[]]"})
    EXPECT_FALSE(parse_toml(text, "f.toml", rt::ExitCode::bad_usage).has_value()) << text;
}

TEST(ParseToml, LettersOutsideAsciiAreRefusedWithTheirLine) {
  const auto sut = parse_toml("a = 1\n\n\xC3\xA9 = 2\n", "f.toml", rt::ExitCode::bad_usage);
  ASSERT_FALSE(sut.has_value());
  EXPECT_EQ(sut.error().message, "f.toml:3: not valid TOML: holds a character outside ASCII");
}

TEST(ReadSettingsFile, MissingFolderAndHugeFilesGetASentence) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(read_settings_file("/nowhere/x.toml", "script").error().message,
            "/nowhere/x.toml: the script cannot be read");
  EXPECT_EQ(read_settings_file(folder.path().string(), "script").error().message,
            folder.path().string() + ": the script cannot be read");
  const std::string huge = folder.write("huge.toml", std::string((1 << 20) + 1, ' '));
  EXPECT_EQ(read_settings_file(huge, "script").error().message, huge + ": the script is larger than 1 MB");
  const auto text = read_settings_file(folder.write("good.toml", "a = 1\n"), "script");
  ASSERT_TRUE(text.has_value());
  EXPECT_EQ(*text, "a = 1\n");
}

}  // namespace
}  // namespace tactus::hal
