#include "firmware_host/report.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "firmware_host/html.hpp"
#include "firmware_host/report_plot.hpp"
#include "tests/firmware_host/sample_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

/// Empty when every element is closed in order and every attribute is quoted; else what is wrong and where.
/// Void elements as in HTML; `/>` only inside svg.
std::string structure_error(const std::string& html) {
  const auto is_void = [](const std::string& name) {
    return name == "meta" || name == "img" || name == "br";
  };
  std::vector<std::string> open;
  std::size_t i = 0;
  while ((i = html.find('<', i)) != std::string::npos) {
    const std::string where = " at ..." + html.substr(i, 60);
    if (html.compare(i, 2, "<!") == 0) {
      i = html.find('>', i);
      continue;
    }
    const bool is_closing = html[i + 1] == '/';
    std::size_t j = i + 1 + is_closing;
    std::string name;
    while (j < html.size() && (std::isalnum(static_cast<unsigned char>(html[j])) != 0)) name += html[j++];
    if (name.empty()) return "a bare <" + where;
    bool is_quoted = false;
    for (; j < html.size() && (is_quoted || html[j] != '>'); ++j) {
      if (html[j] == '"') is_quoted = !is_quoted;
      if (html[j] == '<') return "< inside a tag" + where;
    }
    if (j == html.size()) return "a tag that does not end" + where;
    const bool is_empty = html[j - 1] == '/';
    if (is_closing) {
      if (open.empty() || open.back() != name)
        return "</" + name + "> closes " + (open.empty() ? "nothing" : open.back()) + where;
      open.pop_back();
    } else if (!is_empty && !is_void(name)) {
      open.push_back(name);
    }
    i = j;
    if (name == "style" && !is_closing) i = html.find("</style>", j);
  }
  return open.empty() ? "" : "<" + open.back() + "> is never closed";
}

std::string report_of(const RunResult& r) {
  const auto html = report_html(r);
  EXPECT_TRUE(html.has_value()) << html.error().message;
  return html ? *html : "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Report, IsWellFormedAndHasEverySection) {
  const std::string html = report_of(test::sample_run());
  EXPECT_EQ(structure_error(html), "");
  for (const char* id :
       {"notes", "pictures", "trajectory", "latency", "memory", "labels", "events", "provenance"})
    EXPECT_TRUE(contains(html, "<section id=\"" + std::string(id) + "\">")) << id;
  for (const char* text : {"synthetic:bedroom", "295", "integrate", "map blocks", "fabric", "05f9eab1c2d3",
                           "SCHED_FIFO", "8f3a11c20b77e5d4"})
    EXPECT_TRUE(contains(html, text)) << text;
}

TEST(Report, FetchesNothing) {
  const std::string html = report_of(test::sample_run());
  for (const char* text : {"http:", "https:", "<script", "<link", "<iframe", "@import", "url(", "src=\"//"})
    EXPECT_FALSE(contains(html, text)) << text;
  // The only sources are pictures inside the file.
  std::size_t count = 0;
  for (std::size_t at = html.find("src=\""); at != std::string::npos;
       at = html.find("src=\"", at + 1), ++count)
    EXPECT_EQ(html.compare(at, 27, "src=\"data:image/png;base64,"), 0);
  EXPECT_EQ(count, 3u);
}

TEST(Report, HostileStringsStayText) {
  RunResult r = test::sample_run();
  const std::string evil = "\"><script>alert('x')</script>&\x01\xff<";
  r.source = r.description = r.runner = r.profile = r.app = r.collision = r.command = r.date = r.revision =
      evil;
  r.machine.cpu = r.machine.kernel = r.machine.compiler = r.gravity_origin = r.labels.model = evil;
  for (auto& s : r.stages) s.name = s.thread = evil;
  for (auto& m : r.memory) m.name = m.owner = m.why = evil;
  for (auto& e : r.events) e.kind = e.text = evil, e.values = {{evil, 1}};
  for (auto& p : r.pictures) p.title = p.caption = evil;
  for (auto& n : r.notes) n.text = evil;
  const std::string html = report_of(r);
  EXPECT_EQ(structure_error(html), "");
  EXPECT_FALSE(contains(html, "<script"));
  EXPECT_FALSE(contains(html, "\xff"));
  EXPECT_TRUE(contains(html, "&lt;script&gt;alert(&#39;x&#39;)"));
}

TEST(Report, GameShowsItsFilmItsCountsAndWhatImpactsCameTo) {
  RunResult r = test::sample_run();
  r.display.film = "video.mp4";
  r.display.sound = "sound.wav";
  r.display.pictures_recorded = 300;
  r.game.throws = 17;
  r.game.broken = 5;
  r.events = {{{}, 3, "throw", "ceramic is thrown", std::nullopt, {}, {}}};
  for (const char* outcome : {"broke", "intact", "broke"}) {
    RunEvent event;
    event.kind = "contact";
    event.material = material_from_name("wood");
    event.values = {{"energy_j", 2.5}, {"chips", 4}};
    event.outcome = outcome;
    r.events.push_back(event);
  }
  const std::string html = report_of(r);
  EXPECT_EQ(structure_error(html), "");
  EXPECT_TRUE(contains(html, "<section id=\"game\">"));
  EXPECT_TRUE(contains(html, "src=\"video.mp4"));
  EXPECT_TRUE(contains(html, "href=\"sound.wav\""));
  EXPECT_TRUE(contains(html, "<div class=\"figure\">17</div><div class=\"detail\">5 broken"));
  EXPECT_TRUE(contains(html,
                       "wood</td><td class=\"n\">3</td><td class=\"n\">2</td><td class=\"n\">1</td>"
                       "<td class=\"n\">12</td><td class=\"n\">2.50</td>"));
  r.display.film = "\"><script>";
  EXPECT_FALSE(contains(report_of(r), "<script"));
  r = test::sample_run();
  EXPECT_FALSE(contains(report_of(r), "id=\"game\"")) << "nothing was thrown";
}

TEST(Report, EmptyRunGivesAPageWithoutEmptySections) {
  RunResult r;
  r.source = "nothing";
  const std::string html = report_of(r);
  EXPECT_EQ(structure_error(html), "");
  EXPECT_FALSE(contains(html, "id=\"trajectory\""));
  EXPECT_FALSE(contains(html, "id=\"labels\""));
  EXPECT_TRUE(contains(html, "id=\"provenance\""));
}

TEST(Report, BudgetThatIsBrokenIsSaid) {
  RunResult r = test::sample_run();
  r.heap_allocations_after_seal = 3;
  r.stages[1].latency_ms.p99 = 99;
  r.frame_latency_ms.p99 = 99;
  const std::string html = report_of(r);
  EXPECT_TRUE(contains(html, "class=\"n over\">99.0"));
  EXPECT_GE(html.find("tile bad"), 0u);
  EXPECT_TRUE(
      contains(html, "tile bad\"><div class=\"name\">Heap calls after boot</div><div class=\"figure\">3"));
}

TEST(Report, RunWithoutTruthShowsThePathAndNoError) {
  RunResult r = test::sample_run();
  r.truth.clear();
  r.accuracy.reset();
  const std::string html = report_of(r);
  EXPECT_EQ(structure_error(html), "");
  EXPECT_TRUE(contains(html, "id=\"trajectory\""));
  EXPECT_FALSE(contains(html, "RMSE"));
}

TEST(Report, NotFiniteFiguresDoNotReachTheDrawing) {
  RunResult r = test::sample_run();
  for (auto& s : r.stages) s.frame_ms.assign(50, kDidNotRun);
  r.frame_ms.assign(50, kDidNotRun);
  r.trajectory.resize(1);
  const std::string html = report_of(r);
  EXPECT_EQ(structure_error(html), "");
  for (const char* text : {"nan,", ",nan", "inf,", ",inf", "\"nan", "\"inf"})
    EXPECT_FALSE(contains(html, text)) << text;
}

TEST(Report, IsWrittenToAFile) {
  const tactus::test::TemporaryFolder folder;
  ASSERT_TRUE(write_report(folder.path() / "report.html", test::sample_run()).has_value());
  EXPECT_EQ(folder.read("report.html"), report_of(test::sample_run()));
  const auto failed = write_report(folder.path() / "absent" / "report.html", test::sample_run());
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, rt::ExitCode::failed);
  // For looking at it: keep the page where TACTUS_KEEP_REPORT says.
  if (const char* keep = std::getenv("TACTUS_KEEP_REPORT")) {
    ASSERT_TRUE(write_report(keep, test::sample_run()).has_value());
  }
}

TEST(Report, PictureIsTheSamePixelsAfterDecoding) {
  Picture p{"three", "", 3, 1, {255, 0, 0, 0, 255, 0, 1, 2, 3}};
  const auto png = encode_png(p);
  ASSERT_TRUE(png.has_value()) << png.error().message;
  const std::vector<std::uint8_t> bytes(png->begin(), png->end());
  const cv::Mat bgr = cv::imdecode(bytes, cv::IMREAD_COLOR);
  ASSERT_EQ(bgr.cols, 3);
  EXPECT_EQ(bgr.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(bgr.at<cv::Vec3b>(0, 2), cv::Vec3b(3, 2, 1));
}

TEST(Report, PictureOfTheWrongSizeIsASentence) {
  RunResult r = test::sample_run();
  r.pictures[1].rgb.pop_back();
  const auto html = report_html(r);
  ASSERT_FALSE(html.has_value());
  EXPECT_TRUE(contains(html.error().message, "Labels"));
  EXPECT_FALSE(encode_png({"none", "", 0, 0, {}}).has_value());
  EXPECT_FALSE(encode_png({"negative", "", -3, -1, {1, 2, 3, 4, 5, 6, 7, 8, 9}}).has_value());
}

TEST(Html, EscapesAndRepairs) {
  EXPECT_EQ(escaped("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
  EXPECT_EQ(escaped("Zürich – 水 🏠"), "Zürich – 水 🏠");
  const std::string r = "\xEF\xBF\xBD";
  EXPECT_EQ(escaped("\xC0\xAF"), r + r);          // overlong
  EXPECT_EQ(escaped("\xED\xA0\x80"), r + r + r);  // surrogate
  EXPECT_EQ(escaped("x\xE6\xB0"), "x" + r + r);   // cut short
  EXPECT_EQ(escaped(std::string_view("\0\x1b", 2)), r + r);
}

TEST(Html, Base64OfRfc4648) {
  const char* expected[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (std::size_t n = 0; n <= 6; ++n)
    EXPECT_EQ(base64(std::string_view("foobar").substr(0, n)), expected[n]);
  EXPECT_EQ(base64("\xff\xef\xbf"), "/++/");
}

TEST(Html, NumbersAreReadable) {
  EXPECT_EQ(readable(0), "0");
  EXPECT_EQ(readable(0.0421), "0.042");
  EXPECT_EQ(readable(1.234), "1.23");
  EXPECT_EQ(readable(12.34), "12.3");
  EXPECT_EQ(readable(1234.5), "1234");
  EXPECT_EQ(readable(kDidNotRun), "–");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1234567),
            "1\xE2\x80\xAF"
            "234\xE2\x80\xAF"
            "567");
  EXPECT_EQ(readable_bytes(1023), "1023 B");
  EXPECT_EQ(readable_bytes(96ull << 20), "96.0 MiB");
}

TEST(ReportPlot, BudgetLineAndSpikesAreDrawn) {
  std::vector<float> values(200, 5.0F);
  values[60] = 80;
  const std::string svg =
      series_svg({.values = values, .unit = "ms", .label = "l", .budget = 6, .budget_label = "six"});
  EXPECT_TRUE(contains(svg, "class=\"budget\""));
  EXPECT_TRUE(contains(svg, "class=\"spike\""));
  EXPECT_TRUE(contains(svg, ">six</text>"));
  values[60] = 5;
  EXPECT_FALSE(contains(series_svg({.values = values, .unit = "ms", .label = "l"}), "class=\"spike\""));
}

TEST(ReportPlot, LossLeavesAGapInThePath) {
  const RunResult r = test::sample_run();
  const auto moves = [&](rt::Duration gap_max) {
    const std::string svg = trajectory_svg(r.trajectory, {}, View::top, gap_max);
    const std::size_t line = svg.find("class=\"line\"");
    const std::string d = svg.substr(line, svg.find('>', line) - line);
    return std::count(d.begin(), d.end(), 'M');
  };
  EXPECT_EQ(moves(rt::Duration{100'000'000}), 2);
  EXPECT_EQ(moves(rt::Duration{1'000'000'000}), 1);
}

TEST(ReportPlot, LongRunsStaySmall) {
  std::vector<float> values(100'000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(5 + i % 7);
  EXPECT_LT(series_svg({.values = values, .unit = "ms", .label = "l"}).size(), 60'000u);
}

}  // namespace
}  // namespace tactus::firmware
