// `tactus study form`: which clips it takes and what is in the page; study_form_browser_test.cpp uses the
// page.
#include "firmware_host/study_form.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/html.hpp"
#include "tests/firmware_host/study_commands.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

std::vector<std::string> names_of(const std::vector<std::filesystem::path>& clips) {
  std::vector<std::string> names;
  for (const auto& clip : clips) names.push_back(clip.filename().string());
  return names;
}

TEST(StudyForm, ClipsAreInThePapersOrderThenByName) {
  const test::TemporaryFolder folder;
  for (const char* name :
       {"semantic.mp4", "b.mp4", "none.mp4", "a.mp4", "uniform.mp4", "notes.txt", "folder.mp4/x"})
    folder.write(name, "x");
  const auto sut = find_clips(folder.path());
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(names_of(*sut),
            (std::vector<std::string>{"none.mp4", "uniform.mp4", "semantic.mp4", "a.mp4", "b.mp4"}));
}

TEST(StudyForm, WhatIsWrongIsOneSentence) {
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "form.html").string();
  std::filesystem::create_directory(folder.path() / "empty");
  folder.write("one/none.mp4", "x");
  folder.write("blank/ none.mp4", "x");
  folder.write("blank/semantic.mp4", "x");
  folder.write("two/a.mp4", "x");
  folder.write("two/b.mp4", "x");
  const struct {
    std::vector<std::string> words;
    int code;
    std::string part;
  } cases[] = {
      {{"--clips", folder.path() / "empty", "--out", out}, 2, "there is no clip (*.mp4); put one"},
      {{"--clips", folder.path() / "one", "--out", out}, 2, "there is one clip only"},
      {{"--clips", folder.path() / "nowhere", "--out", out}, 3, "the folder cannot be read"},
      {{"--clips", folder.path() / "two/a.mp4", "--out", out}, 3, "the folder cannot be read"},
      {{"--clips", folder.path() / "blank", "--out", out}, 3, "the name cannot be a column's"},
      {{"--clips", folder.path() / "two", "--out", folder.path() / "two/a.mp4"}, 2, "which ends in .html"},
      {{"--clips", folder.path() / "two", "--out", folder.path() / "nowhere/form.html"},
       1,
       "cannot be created"},
      {{"--clips", folder.path() / "two", "--out", out, "--min-view-s", "-1"}, 2, "--min-view-s"},
  };
  for (const auto& [words, code, part] : cases) {
    std::vector<std::string> all = {"form"};
    all.insert(all.end(), words.begin(), words.end());
    const test::Outcome sut = test::call_study(all);
    EXPECT_EQ(sut.code, code) << part;
    EXPECT_NE(sut.err.find(part), std::string::npos) << sut.err;
    EXPECT_EQ(std::count(sut.err.begin(), sut.err.end(), '\n'), 1) << sut.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST(StudyForm, FolderThatMayNotBeReadIsASentence) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read every folder.";
  const test::TemporaryFolder folder;
  folder.write("clips/a.mp4", "x");
  chmod((folder.path() / "clips").c_str(), 0);
  const auto sut = find_clips(folder.path() / "clips");
  chmod((folder.path() / "clips").c_str(), 0700);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
}

TEST(StudyForm, PathsAreRelativeToThePageAndEncoded) {
  EXPECT_EQ(relative_url("study/clips/none.mp4", "study/form.html"), "clips/none.mp4");
  EXPECT_EQ(relative_url("study/clips/none.mp4", "study/pages/../form.html"), "clips/none.mp4");
  EXPECT_EQ(relative_url("clips/none.mp4", "pages/form.html"), "../clips/none.mp4");
  EXPECT_EQ(relative_url("a b/100%\"#?'<é.mp4", "form.html"), "a%20b/100%25%22%23%3F%27%3C%C3%A9.mp4");
  EXPECT_EQ(relative_url("a:b.mp4", "form.html"), "a%3Ab.mp4") << "no scheme";
}

TEST(StudyForm, HostileTitlesAndNamesStayText) {
  const std::string evil = "</script><script>alert('x')</script>\"><img src=x>&\xff";
  const std::string html = study_form_html({evil, 10, {{evil, evil, 1}, {"b", "b.mp4", 2}}});
  EXPECT_NE(html.find("\\u003c/script>\\u003cscript>alert('x')"), std::string::npos) << "in the settings";
  EXPECT_EQ(html.find("alert('x')</script>"), std::string::npos);
  EXPECT_EQ(html.find("<img"), std::string::npos);
  EXPECT_EQ(html.find("\xff"), std::string::npos);
  std::size_t scripts_count = 0;
  for (std::size_t i = html.find("<script"); i != std::string::npos; i = html.find("<script", i + 1))
    ++scripts_count;
  EXPECT_EQ(scripts_count, 2u) << "the settings and the page's own";
}

TEST(StudyForm, PageNamesNothingFromElsewhere) {
  const test::TemporaryFolder folder;
  for (const char* name : {"none.mp4", "semantic.mp4"}) folder.write(name, "bytes of " + std::string(name));
  for (const bool is_embedded : {false, true}) {
    std::vector<std::string> words = {"form", "--clips", folder.path(), "--out", folder.path() / "form.html"};
    if (is_embedded) words.push_back("--embed");
    const test::Outcome sut = test::call_study(words);
    ASSERT_EQ(sut.code, 0) << sut.err;
    const std::string html = folder.read("form.html");
    for (const char* text :
         {"http:", "https:", "src=\"//", "@import", "url(", "<link", "<iframe", "fetch(", "XMLHttp"})
      EXPECT_EQ(html.find(text), std::string::npos) << text;
    EXPECT_NE(html.find("content=\"default-src 'none'; "), std::string::npos);
    EXPECT_EQ(html.find(is_embedded ? "src=\"none.mp4\"" : "data:video"), std::string::npos);
    EXPECT_NE(html.find(is_embedded ? "src=\"data:video/mp4;base64," + base64("bytes of none.mp4") + "\""
                                    : "src=\"none.mp4\""),
              std::string::npos);
  }
}

}  // namespace
}  // namespace tactus::firmware
