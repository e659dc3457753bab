// Each house rule must be able to fail: bad snippets and the findings they give, good snippets and none.
#include "tests/house/rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace tactus::house {
namespace {

std::vector<std::string> list(const std::vector<Finding>& findings) {
  std::vector<std::string> text;
  std::transform(findings.begin(), findings.end(), std::back_inserter(text),
                 [](const auto& f) { return to_string(f); });
  return text;
}

std::size_t findings_of(std::vector<Finding> (*rule)(const SourceFile&), std::string_view path,
                        std::string_view text) {
  const auto findings = rule(split_source(path, text));
  for (const auto& line : list(findings)) ::testing::Test::RecordProperty("finding", line);
  return findings.size();
}

std::size_t step_words(std::string_view path, std::string_view text,
                       std::span<const Exception> exceptions = {}) {
  return check_step_words(split_source(path, text), exceptions).size();
}

std::size_t noexcept_bodies(std::string_view text) {
  return check_noexcept_bodies(split_source("rt/x.cpp", text), {}).size();
}

std::size_t determinism_words(std::string_view path, std::string_view text) {
  return check_determinism_words(split_source(path, text), {}).size();
}

TEST(SplitSource, CodeCommentAndLiteralAreToldApart) {
  const SourceFile sut =
      split_source("rt/x.hpp", "int a; // new b\nf(\"new // c\"); /* new\nnew */ g('\\'', 1'000);\n");

  ASSERT_EQ(sut.lines.size(), 3u);
  EXPECT_EQ(sut.lines[0].code, "int a;         ");
  EXPECT_NE(sut.lines[0].comment.find("new b"), std::string::npos);
  EXPECT_EQ(sut.lines[1].code.find("new"), std::string::npos);
  EXPECT_NE(sut.lines[1].literals.find("new // c"), std::string::npos);
  EXPECT_NE(sut.lines[1].comment.find("new"), std::string::npos);
  EXPECT_NE(sut.lines[2].code.find("g('  ', 1'000);"), std::string::npos) << sut.lines[2].code;
}

TEST(SplitSource, RawStringMaySpanLinesAndHoldQuotes) {
  const SourceFile sut = split_source("rt/x.hpp", "auto s = R\"x(a \" // b\nnew)\" c)x\"; int after;\n");

  ASSERT_EQ(sut.lines.size(), 2u);
  EXPECT_EQ(sut.lines[0].comment.find('b'), std::string::npos);
  EXPECT_EQ(sut.lines[1].code.find("new"), std::string::npos);
  EXPECT_NE(sut.lines[1].code.find("int after;"), std::string::npos);
}

TEST(SplitSource, ViewsKeepColumns) {
  const SourceFile sut = split_source("rt/x.hpp", "f(\"abc\", R\"(x)\"); // y\n");

  ASSERT_EQ(sut.lines.size(), 1u);
  EXPECT_EQ(sut.lines[0].code.size(), sut.lines[0].raw.size());
  EXPECT_EQ(sut.lines[0].comment.size(), sut.lines[0].raw.size());
  EXPECT_EQ(sut.lines[0].literals.size(), sut.lines[0].raw.size());
}

TEST(IncludeDirection, ArrowsThatRunUpAreFound) {
  const auto sut = [](std::string_view path, std::string_view target) {
    return findings_of(check_include_direction, path, "#include \"" + std::string(target) + "\"\n");
  };
  EXPECT_EQ(sut("rt/arena.hpp", "hal/camera.hpp"), 1u);
  EXPECT_EQ(sut("rt/arena.hpp", "pipeline/map/map.hpp"), 1u);
  EXPECT_EQ(sut("hal/camera.hpp", "hal/replay/tum.hpp"), 1u);
  EXPECT_EQ(sut("hal/camera.hpp", "pipeline/label/material.hpp"), 1u);
  EXPECT_EQ(sut("hal/replay/tum.cpp", "hal/synthetic/scene.hpp"), 1u);
  EXPECT_EQ(sut("hal/replay/tum.cpp", "pipeline/profile.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/map/map.cpp", "hal/replay/tum.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/pipeline.cpp", "hal/synthetic/scene.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/map/map.cpp", "pipeline/track/icp.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/map/map.cpp", "pipeline/pipeline.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/render/scene.cpp", "hal/egl/context.hpp"), 1u);
  EXPECT_EQ(sut("pipeline/map/map.cpp", "firmware_host/options.hpp"), 1u);
  EXPECT_EQ(sut("firmware_host/main.cpp", "tests/support/scene.hpp"), 1u);
}

TEST(IncludeDirection, ArrowsThatRunDownAreFine) {
  const auto sut = [](std::string_view path, std::string_view target) {
    return findings_of(check_include_direction, path, "#include \"" + std::string(target) + "\"\n");
  };
  EXPECT_EQ(sut("rt/arena.cpp", "rt/arena.hpp"), 0u);
  EXPECT_EQ(sut("hal/replay/tum.cpp", "hal/camera.hpp"), 0u);
  EXPECT_EQ(sut("pipeline/track/icp.cpp", "pipeline/map/reader.hpp"), 0u);
  EXPECT_EQ(sut("pipeline/pipeline.cpp", "pipeline/track/icp.hpp"), 0u);
  EXPECT_EQ(sut("firmware_host/boot.cpp", "hal/replay/tum.hpp"), 0u);
  EXPECT_EQ(sut("tests/rt/x_test.cpp", "firmware_host/options.hpp"), 0u);
}

TEST(IncludeDirection, IncludeBesideTheFileIsFound) {
  EXPECT_EQ(findings_of(check_include_direction, "rt/arena.cpp", "#include \"arena.hpp\"\n"), 1u);
  EXPECT_EQ(findings_of(check_include_direction, "rt/arena.cpp", "#include \"ode/ode.h\"\n"), 1u);
  EXPECT_EQ(findings_of(check_include_direction, "rt/arena.cpp", "// #include \"arena.hpp\"\n"), 0u);
}

TEST(StepWords, WordsThatAllocateLockWaitPrintOrThrowAreFound) {
  for (const char* bad :
       {"auto* a = new int;", "delete a;", "void* p = malloc(3);", "std::shared_ptr<int> p;",
        "std::function<void()> f;", "std::mutex m;", "std::lock_guard lock(m);", "#include <iostream>",
        "std::this_thread::sleep_for(d);", "printf(\"x\");", "throw 1;", "auto t = C::now();",
        "std::condition_variable c;", "if (dynamic_cast<B*>(a)) {}"})
    EXPECT_GE(step_words("pipeline/map/map.cpp", bad), 1u) << bad;
}

TEST(StepWords, StageThatReadsAClockIsFound) {
  EXPECT_EQ(step_words("pipeline/map/map.cpp", "const auto t = context.clock.now();"), 1u);
  EXPECT_EQ(step_words("pipeline/pipeline.cpp", "const auto t = clock.now();"), 0u);
  EXPECT_EQ(step_words("rt/runner.cpp", "const auto t = clock.now();"), 0u);
}

TEST(StepWords, WordsInNamesCommentsAndTextAreFine) {
  for (const char* good :
       {"int new_blocks;", "// a new block", "f(\"new delete throw\");", "X(const X&) = delete;",
        "::new (place) T();", "new (place) T();", "int renew;", "#include <new>", "block.free_count()",
        "pool.free(slot)", "snprintf(text, 3, format);", "std::mutex_like m;"})
    EXPECT_EQ(step_words("rt/arena.cpp", good), 0u) << good;
}

TEST(StepWords, BackendsProgramAndEvaluationMayUseThem) {
  for (const char* path :
       {"hal/replay/tum.cpp", "firmware_host/main.cpp", "pipeline/evaluate/mesh.cpp", "tests/rt/x_test.cpp"})
    EXPECT_EQ(step_words(path, "throw 1;"), 0u) << path;
  EXPECT_EQ(step_words("hal/camera.hpp", "throw 1;"), 1u);
}

TEST(StepWords, ExceptionCoversItsWordInItsFileOnly) {
  constexpr std::array kExceptions{Exception{"rt/thread.cpp", "malloc(", "boot"},
                                   Exception{"pipeline/segment/", "new", "boot"}};
  EXPECT_EQ(step_words("rt/thread.cpp", "malloc(1);", kExceptions), 0u);
  EXPECT_EQ(step_words("rt/thread.cpp", "calloc(1, 1);", kExceptions), 1u);
  EXPECT_EQ(step_words("rt/arena.cpp", "malloc(1);", kExceptions), 1u);
  EXPECT_EQ(step_words("pipeline/segment/a.cpp", "new int;", kExceptions), 0u);
  EXPECT_EQ(step_words("pipeline/segments/a.cpp", "new int;", kExceptions), 1u);
}

TEST(NoexceptBodies, GrowingInsideIsFound) {
  EXPECT_EQ(noexcept_bodies("void f() noexcept {\n  std::string s;\n}\n"), 1u);
  EXPECT_EQ(noexcept_bodies("void f() const noexcept override {\n  if (a) { std::vector<int> v; }\n}\n"), 1u);
  EXPECT_EQ(noexcept_bodies("X::X(int a) noexcept : a_{a}, b_(2) {\n  std::to_string(a);\n}\n"), 1u);
  EXPECT_EQ(noexcept_bodies("auto f() noexcept -> std::size_t {\n  std::vector<int> v;\n}\n"), 1u);
}

TEST(NoexceptBodies, GrowingElsewhereIsFine) {
  EXPECT_EQ(noexcept_bodies("void f() noexcept;\nvoid g() { std::string s; }\n"), 0u);
  EXPECT_EQ(noexcept_bodies("void f() noexcept { g(); }\nvoid h() { std::vector<int> v; }\n"), 0u);
  EXPECT_EQ(noexcept_bodies("X() noexcept = default;\nvoid h() { std::vector<int> v; }\n"), 0u);
  EXPECT_EQ(noexcept_bodies("static_assert(noexcept(f()));\nvoid h() { std::vector<int> v; }\n"), 0u);
  EXPECT_EQ(noexcept_bodies("X(int a) noexcept : a_{a} {}\nvoid h() { std::vector<int> v; }\n"), 0u);
}

TEST(DeterminismWords, MachineDependentResultsAreFound) {
  for (const char* bad : {"float a = std::sin(b);", "hn::MulAdd(a, b, c);", "std::unordered_map<int, int> m;",
                          "#include <immintrin.h>", "hn::ApproximateReciprocal(a);", "expf(a)"})
    EXPECT_EQ(determinism_words("pipeline/map/map.cpp", bad), 1u) << bad;
}

TEST(DeterminismWords, ExactOperationsAndOtherFoldersAreFine) {
  EXPECT_EQ(determinism_words("pipeline/map/map.cpp", "float a = std::sqrt(b) * sine(c);"), 0u);
  EXPECT_EQ(determinism_words("pipeline/map/map.cpp", "hn::Add(hn::Mul(a, b), c);"), 0u);
  EXPECT_EQ(determinism_words("pipeline/render/scene.cpp", "float a = std::sin(b);"), 0u);
  EXPECT_EQ(determinism_words("pipeline/evaluate/statistics.cpp", "std::pow(a, b);"), 0u);
}

TEST(Comments, CodeAndBannersAndDebtsAreFound) {
  for (const char* bad :
       {"// a = b + c;", "// return false;", "//   if (a < b) {", "// }", "// #include <vector>",
        "// map.integrate(frame);", "/* x->y(1); */", "    //   map.integrate(frame);", "// TODO later",
        "int a;  // FIXME", "//--------------------", "// ==========", "int a;  // NOLINT",
        "// std::swap(a, b);"})
    EXPECT_EQ(findings_of(check_comments, "rt/x.cpp", bad), 1u) << bad;
}

TEST(Comments, SentencesAreFine) {
  for (const char* good :
       {"// Pairs with pop(): acquire on write_.", "// The sum is a + b; it never overflows;",
        "// depth = raw / scale, in metres", "int a;  // of 8x8x8 blocks (2 cm each);",
        "// NOLINT(x): the C library wants it so", "// a -> b -> c", "// f(x) = x * x",
        "// if (rarely) the map is full, it evicts"})
    EXPECT_EQ(findings_of(check_comments, "rt/x.cpp", good), 0u) << good;
}

TEST(Comments, ExampleInAnExplanationIsFine) {
  EXPECT_EQ(findings_of(check_comments, "rt/x.hpp", "// Use it so:\n//   map.integrate(frame);\n"), 0u);
  EXPECT_EQ(findings_of(check_comments, "rt/x.hpp", "// What.\n//\n//   map.integrate(frame);\n"), 0u);
  EXPECT_EQ(findings_of(check_comments, "rt/x.hpp", "int a;\n//   map.integrate(frame);\n"), 1u);
  EXPECT_EQ(findings_of(check_comments, "rt/x.hpp", "// What:\n// map.integrate(frame);\n"), 1u);
}

TEST(Atomics, AccessWithoutPartnerOrReasonIsFound) {
  const auto sut = [](std::string_view text) { return findings_of(check_atomics, "rt/x.hpp", text); };
  EXPECT_EQ(sut("a.load(std::memory_order_acquire);\n"), 1u);
  EXPECT_EQ(sut("// Relaxed: nothing is published.\na.load(std::memory_order_acquire);\n"), 1u);
  EXPECT_EQ(sut("a.load(std::memory_order_acquire);  // pairs with push(): release on write_\n"), 0u);
  EXPECT_EQ(sut("a.load(std::memory_order_relaxed);\n"), 1u);
  EXPECT_EQ(sut("a.load(std::memory_order_relaxed);  // relaxed: a count, publishes nothing\n"), 0u);
  EXPECT_EQ(sut("a.load();\n"), 0u);
}

TEST(Header, MissingFirstLineOrGuardIsFound) {
  EXPECT_EQ(findings_of(check_header, "rt/x.hpp", "// What this header is for.\n#pragma once\n"), 0u);
  EXPECT_EQ(findings_of(check_header, "rt/x.hpp", "#pragma once\n// What this header is for.\n"), 1u);
  EXPECT_EQ(
      findings_of(check_header, "rt/x.hpp", "// What this header is for.\n#include <new>\n#pragma once\n"),
      1u);
  EXPECT_EQ(findings_of(check_header, "rt/x.hpp", "// What this header is for.\nint a;\n"), 1u);
  EXPECT_EQ(findings_of(check_header, "rt/x.hpp", ""), 2u);
  EXPECT_EQ(findings_of(check_header, "rt/x.hpp",
                        "// What this header is for.\n#pragma once\nusing namespace std;\n"),
            1u);
  EXPECT_EQ(findings_of(check_header, "rt/x.cpp", "int a;\n"), 0u);
}

TEST(Tests, CaseThatAssertsNothingOrIsDisabledIsFound) {
  EXPECT_EQ(findings_of(check_tests, "tests/rt/x_test.cpp", "TEST(A, B) {\n  f();\n}\n"), 1u);
  EXPECT_EQ(findings_of(check_tests, "tests/rt/x_test.cpp",
                        "TEST(A, B) {\n  // EXPECT_EQ\n}\nTEST(A, C) { EXPECT_TRUE(d); }"),
            1u);
  EXPECT_EQ(findings_of(check_tests, "tests/rt/x_test.cpp", "TEST_F(A, DISABLED_B) { EXPECT_EQ(1, f()); }\n"),
            1u);
  EXPECT_EQ(findings_of(check_tests, "tests/rt/x.cpp", "TEST_P(A, B) { EXPECT_EQ(1, f()); }\n"), 1u);
  EXPECT_EQ(
      findings_of(check_tests, "tests/rt/x_test.cpp", "TEST(A, B) {\n  if (c) { ASSERT_EQ(1, f()); }\n}\n"),
      0u);
}

TEST(FileName, OtherThanSnakeCaseIsFound) {
  EXPECT_EQ(check_file_name("rt/SpscRing.hpp").size(), 1u);
  EXPECT_EQ(check_file_name("pipeline/map/ray-cast.cpp").size(), 1u);
  EXPECT_EQ(check_file_name("pipeline/map/integrate-inl.hpp").size(), 0u);
  EXPECT_EQ(check_file_name("rt/spsc_ring.hpp").size(), 0u);
}

TEST(AbsolutePaths, PathsOfOneMachineAreFound) {
  for (const char* bad :
       {"open(\"/home/me/x\");", "set(a /root/x)", "out=/tmp/x", "\"/work/data\"", "/Users/me/x"})
    EXPECT_EQ(check_absolute_paths("a.cmake", bad).size(), 1u) << bad;
}

TEST(AbsolutePaths, SystemAndRelativePathsAreFine) {
  for (const char* good : {"\"/proc/self/status\"", "/dev/video0", "${dir}/tmp/x", "$HOME/work/x", "a/home/b",
                           "../work/x", "https://host/home/x"})
    EXPECT_EQ(check_absolute_paths("a.cmake", good).size(), 0u) << good;
}

}  // namespace
}  // namespace tactus::house
