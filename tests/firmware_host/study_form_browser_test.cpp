// The page of `tactus study form` in a real browser, up to what `tactus study stats` makes of its CSV.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <thread>

#include "firmware_host/ratings_file.hpp"
#include "tests/firmware_host/browser.hpp"
#include "tests/firmware_host/study_commands.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::Browser;

constexpr std::array<const char*, 3> kNames = {"none", "uniform", "semantic"};
const std::string kHeader =
    "participant,confirmed,rating_none,viewed_none_s,rating_uniform,viewed_uniform_s,rating_semantic,viewed_"
    "semantic_s,"
    "background_fps,background_vr_ar,order,comment\r\n";

/// What the tests say in the page. `played` is the browser's own record of what was played of a clip.
const std::string kHelpers = R"js(
  var q = (selector) => document.querySelector(selector);
  var clips = () => [...document.querySelectorAll("section.clip")];
  var clip_of = (section) => Number(section.querySelector(".scale input").name.slice("rating_".length));
  var wait = (test) => new Promise((done, fail) => {
    const began = performance.now();
    const look = () => test() ? done(true) : performance.now() - began > 50000 ? fail(Error("waited for " + test)) : setTimeout(look, 20);
    look();
  });
  var once = (target, event) => new Promise((done) => target.addEventListener(event, done, {once: true}));
  var played = (video) => Array.from(video.played, (_, i) => i).reduce((sum, i) => sum + video.played.end(i) - video.played.start(i), 0);
  var choose = (name, value) => q(`input[name="${name}"][value="${value}"]`).click();
  var visible = (element) => element.getClientRects().length > 0;
  var take_part = async (background, ratings) => {
    q("#start").click();
    choose("background_fps", background);
    choose("background_vr_ar", "no");
    for (const section of clips()) {
      section.querySelector(".again").click();
      await wait(() => !section.querySelector("fieldset").disabled);
      choose("rating_" + clip_of(section), ratings[clip_of(section)]);
    }
    choose("confirmed", "yes");
    q("#end button").click();
    return q("#line").value;
  };
  0)js";

/// A page about three clips that are the same twelve seconds of one colour (2 frames/s, 64 x 48, VP9: ffmpeg
/// -f lavfi -i color=c=0x336699:size=64x48:rate=2:duration=12 -c:v libvpx-vp9).
fs::path make_form(const test::TemporaryFolder& folder, std::vector<std::string> more) {
  fs::create_directories(folder.path() / "clips");
  for (const char* name : kNames)
    fs::copy_file(fs::path(TACTUS_SOURCE_DIR) / "tests/firmware_host/tiny_clip.mp4",
                  folder.path() / "clips" / (std::string(name) + ".mp4"));
  more.insert(more.begin(),
              {"form", "--clips", folder.path() / "clips", "--out", folder.path() / "form.html"});
  const test::Outcome made = test::call_study(more);
  EXPECT_EQ(made.code, 0) << made.err;
  return folder.path() / "form.html";
}

/// A file that the page saved, once it is there.
std::string downloaded(const Browser& browser, const std::string& name) {
  for (int i = 0; i < 200 && !fs::exists(browser.downloads() / name); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  std::ifstream in(browser.downloads() / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Pages asked for their own files and for what is inside them, as the icons of the player are; each for
/// itself at least.
void expect_local(const Browser& browser, const test::TemporaryFolder& folder) {
  EXPECT_FALSE(browser.requests().empty());
  for (const std::string& url : browser.requests())
    EXPECT_TRUE(url.starts_with("file://" + folder.path().string() + "/") || url.starts_with("data:")) << url;
}

/// For looking at the page: pictures are kept where TACTUS_KEEP_FORM says.
void keep_picture(Browser& browser, const Browser::Page& page, const std::string& name,
                  bool is_dark = false) {
  const char* keep = std::getenv("TACTUS_KEEP_FORM");
  if (keep == nullptr) return;
  browser.emulate(page, is_dark, 900, 1200);
  browser.screenshot(page, fs::path(keep) / (name + ".png"));
}

TEST(StudyFormInABrowser, RatingOpensAfterPlayingTimeAndTheAnswersAreExact) {
  const auto program = Browser::find_program();
  if (!program) GTEST_SKIP() << "There is no Chromium here to show the page in.";
  const test::TemporaryFolder folder;
  const std::string title = "Plates & </script><b>\"rooms\"</b>";
  const fs::path form = make_form(folder, {"--min-view-s", "1", "--title", title});
  Browser browser(*program, folder.path());
  const Browser::Page page = browser.open(form);
  const auto evaluate = [&](const std::string& expression) { return browser.evaluate(page, expression); };
  evaluate(kHelpers);
  EXPECT_EQ(evaluate("document.title"), title);
  EXPECT_EQ(evaluate("q('h1').textContent"), title);
  keep_picture(browser, page, "intro");

  // By keyboard alone: agree, the two questions; the first clip appears only then.
  EXPECT_EQ(evaluate("visible(q('#form'))"), false);
  browser.press(page, "Tab");
  EXPECT_EQ(evaluate("document.activeElement.id"), "start");
  browser.press(page, "Enter");
  EXPECT_EQ(evaluate("document.activeElement.name"), "background_fps");
  browser.press(page, " ");
  EXPECT_EQ(evaluate("clips().filter(visible).length"), 0);
  browser.press(page, "Tab");
  browser.press(page, "ArrowRight");
  EXPECT_EQ(
      evaluate("[q('#form').elements.background_fps.value, q('#form').elements.background_vr_ar.value]"),
      (json{"yes", "no"}));
  EXPECT_EQ(evaluate("clips().filter(visible).length"), 1);
  const json order = evaluate("clips().map(clip_of)");
  ASSERT_EQ(order.size(), 3u);

  // Waiting and jumping are no viewing.
  evaluate(
      "var section = clips()[0], video = section.querySelector('video'), scale = "
      "section.querySelector('fieldset');"
      "wait(() => video.readyState >= 2)");
  evaluate(
      "(async () => { for (const t of [9, 2, 11]) { video.currentTime = t; await once(video, 'seeked'); }"
      " await new Promise((done) => setTimeout(done, 1200)); })()");
  EXPECT_EQ(evaluate("scale.disabled"), true);
  EXPECT_EQ(evaluate("section.querySelector('progress').value"), 0);
  // Half a second of play, with a jump while it plays: still closed, and what counts is what the browser says
  // was played.
  evaluate(
      "(async () => { video.currentTime = 0; await once(video, 'seeked'); await video.play(); await wait(() "
      "=> video.currentTime > 0.3);"
      " video.currentTime = 8; await once(video, 'seeked'); await wait(() => video.currentTime > 8.2); "
      "video.pause();"
      " await once(video, 'pause'); })()");
  EXPECT_EQ(evaluate("scale.disabled"), true);
  const double counted_s = evaluate("section.querySelector('progress').value"),
               played_s = evaluate("played(video)");
  EXPECT_LE(counted_s, played_s + 0.02);
  EXPECT_GE(counted_s, 0.2);
  EXPECT_EQ(
      evaluate(
          "(video.playbackRate = 8, new Promise((done) => setTimeout(() => done(video.playbackRate), 100)))"),
      1);
  keep_picture(browser, page, "closed");
  evaluate("video.play(), wait(() => !scale.disabled)");
  EXPECT_GE(evaluate("played(video)").get<double>(), 1.0);
  EXPECT_EQ(evaluate("clips().filter(visible).length"), 1) << "the next clip waits for this one's rating";

  // Another clip that starts stops this one.
  const auto rating_of = [](std::size_t clip) { return std::to_string(3 * (clip + 1)); };  // 3, 6, 9
  evaluate("choose('rating_" + order[0].dump() + "', " + rating_of(order[0]) + ")");
  EXPECT_EQ(evaluate("clips().filter(visible).length"), 2);
  evaluate(
      "clips()[1].querySelector('.again').click(); wait(() => "
      "!clips()[1].querySelector('fieldset').disabled)");
  EXPECT_EQ(evaluate("video.paused"), true);
  keep_picture(browser, page, "rating");
  keep_picture(browser, page, "rating_dark", true);
  // The rating by keyboard: from the first of the ten on.
  evaluate("clips()[1].querySelector('.scale input').focus()");
  browser.press(page, " ");
  for (std::size_t i = 1; i < 3 * (order[1].get<std::size_t>() + 1); ++i) browser.press(page, "ArrowRight");
  evaluate(
      "clips()[2].querySelector('.again').click(); wait(() => "
      "!clips()[2].querySelector('fieldset').disabled)");
  EXPECT_EQ(evaluate("visible(q('#end'))"), false);
  evaluate("choose('rating_" + order[2].dump() + "', " + rating_of(order[2]) + ")");
  EXPECT_EQ(evaluate("visible(q('#end'))"), true);

  // Without the confirmation's answer it does not end.
  evaluate("q('#end button').click()");
  EXPECT_EQ(evaluate("visible(q('#done'))"), false);
  evaluate("choose('confirmed', 'yes'); q('#comment').focus()");
  browser.type(page, "=1+1 \"good\", I'd say;\nsecond line – ü");
  keep_picture(browser, page, "end");
  evaluate("q('#end button').click()");
  EXPECT_EQ(evaluate("visible(q('#done')) && !visible(q('#form'))"), true);
  keep_picture(browser, page, "done");
  keep_picture(browser, page, "done_dark", true);

  // The file that is saved is exact but for the random number and the times.
  evaluate("q('#save').click()");
  const std::string id = evaluate("participant.id");
  const std::string csv = downloaded(browser, "study_" + id + ".csv");
  std::string order_text;
  for (const std::size_t clip : order)
    order_text += (order_text.empty() ? "" : " > ") + std::string(kNames[clip]);
  const std::regex line(
      "(p[0-9a-f]{8}),yes,3,([0-9]+\\.[0-9]),6,([0-9]+\\.[0-9]),9,([0-9]+\\.[0-9]),yes,no," + order_text +
      ",\"'=1\\+1 \"\"good\"\", I'd say;\nsecond line – ü\"\r\n");
  ASSERT_EQ(csv.substr(0, 3 + kHeader.size()), "\xEF\xBB\xBF" + kHeader);
  std::smatch parts;
  const std::string row = csv.substr(3 + kHeader.size());
  ASSERT_TRUE(std::regex_match(row, parts, line)) << row;
  EXPECT_EQ(parts[1], id);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_GE(std::stod(parts[i]), 1.0);
  const auto ratings = parse_ratings(csv, "form.csv");
  ASSERT_TRUE(ratings) << ratings.error().message;
  EXPECT_EQ(ratings->answers[0].ratings, (std::vector<double>{3, 6, 9}));
  EXPECT_EQ(ratings->answers[0].left_out, LeftOut::viewed_too_briefly)
      << "a second is less than the paper's ten";

  // The next participant sees another order, and this one's answers are still there; cleared, they are gone.
  evaluate("q('#next').click()");
  ASSERT_TRUE(browser.wait_until(page, "participant.id !== '" + id + "'"));
  evaluate(kHelpers);
  EXPECT_NE(evaluate("clips().map(clip_of)"), order);
  EXPECT_EQ(evaluate("q('#kept_count').textContent"), "1 participant is kept in this browser.");
  evaluate("q('#export').click()");
  EXPECT_EQ(downloaded(browser, "study_ratings.csv"), csv);
  evaluate("q('details').open = true; q('#clear').click()");
  keep_picture(browser, page, "clear");
  evaluate("q('#no_clear').click()");
  EXPECT_EQ(evaluate("kept().length"), 1);
  evaluate(
      "localStorage.setItem(key_start + 'torn', '{'); localStorage.setItem('elsewhere', 'x'); say_kept()");
  EXPECT_EQ(evaluate("[kept().length, visible(q('#storage_fails'))]"), (json{1, true}))
      << "what is broken is said";
  evaluate("q('#clear').click(); q('#yes_clear').click()");
  EXPECT_EQ(evaluate("Object.keys(localStorage)"), json::array({"elsewhere"}));
  EXPECT_EQ(evaluate("kept().length"), 0);
  EXPECT_EQ(evaluate("q('#export').disabled"), true);

  // Nothing but the page and its clips was asked for, and nothing else can be.
  expect_local(browser, folder);
  EXPECT_EQ(
      evaluate(
          "(async () => { const refused = once(document, 'securitypolicyviolation');"
          " fetch('http://127.0.0.1:9/').catch(() => 0); return (await refused).effectiveDirective; })()"),
      "connect-src");
}

// Two people at once in two windows of one browser, each of whom really watches each clip for ten seconds.
TEST(StudyFormInABrowser, StatsReadWhatTwoPeopleAnswered) {
  const auto program = Browser::find_program();
  if (!program) GTEST_SKIP() << "There is no Chromium here to show the page in.";
  const test::TemporaryFolder folder;
  const fs::path form = make_form(folder, {"--embed"});
  fs::remove_all(folder.path() / "clips");  // they are in the page
  Browser browser(*program, folder.path());
  const Browser::Page first = browser.open(form), second = browser.open(form);
  for (const auto* page : {&first, &second}) browser.evaluate(*page, kHelpers);
  browser.evaluate(first, "var line; take_part('yes', [3, 6, 9]).then((text) => { line = text; }); 0");
  browser.evaluate(second, "var line; take_part('no', [4, 5, 8]).then((text) => { line = text; }); 0");
  for (const auto* page : {&first, &second}) browser.evaluate(*page, "wait(() => line)");
  ASSERT_TRUE(browser.wait_until(second, "kept().length === 2"))
      << "one window sees the other's answers a moment later";
  browser.evaluate(second, "q('#export').click()");
  const std::string csv = downloaded(browser, "study_ratings.csv");
  const auto ratings = parse_ratings(csv, "study_ratings.csv");
  ASSERT_TRUE(ratings) << ratings.error().message;
  ASSERT_EQ(ratings->answers.size(), 2u) << csv;
  for (const Answer& answer : ratings->answers) EXPECT_EQ(answer.left_out, LeftOut::no) << csv;

  const test::Outcome stats =
      test::call_study({"stats", browser.downloads() / "study_ratings.csv", "--json"});
  ASSERT_EQ(stats.code, 0) << stats.err;
  const json result = json::parse(stats.out);
  EXPECT_EQ(result["answers"], 2);
  EXPECT_EQ(result["analysed"], 2);
  ASSERT_EQ(result["conditions"].size(), 3u);
  constexpr std::array kMeans = {3.5, 5.5, 8.5};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result["conditions"][i]["name"], kNames[i]);
    EXPECT_EQ(result["conditions"][i]["mean"], kMeans[i]);
  }
  EXPECT_EQ(result["backgrounds"][0]["groups"], (json{{"no", 1}, {"yes", 1}}));
  EXPECT_EQ(result["backgrounds"][1]["groups"], (json{{"no", 2}}));
  expect_local(browser, folder);
}

// Every order as often as every other, every clip as often in every place and behind every other.
TEST(StudyFormInABrowser, OrdersAreBalanced) {
  const auto program = Browser::find_program();
  if (!program) GTEST_SKIP() << "There is no Chromium here to show the page in.";
  const test::TemporaryFolder folder;
  Browser browser(*program, folder.path());
  const Browser::Page page = browser.open(make_form(folder, {}));
  for (int n = 2; n <= 7; ++n) {
    const json rows = browser.evaluate(page, "orders(" + std::to_string(n) + ")");
    const auto size = static_cast<std::size_t>(n);
    const std::size_t repeats = n % 2 == 0 ? 1 : 2;
    ASSERT_EQ(rows.size(), repeats * size);
    std::vector<std::size_t> at_place(size * size), behind(size * size);
    for (const json& row : rows)
      for (std::size_t i = 0; i < size; ++i) {
        ++at_place[row[i].get<std::size_t>() * size + i];
        if (i > 0) ++behind[row[i].get<std::size_t>() * size + row[i - 1].get<std::size_t>()];
      }
    for (std::size_t i = 0; i < size * size; ++i) {
      EXPECT_EQ(at_place[i], repeats) << n;
      EXPECT_EQ(behind[i], i % (size + 1) == 0 ? 0u : repeats) << n;
    }
  }
  // Six participants on one device see the six orders of three clips, whatever their numbers.
  const json orders = browser.evaluate(page, R"js((() => {
    const seen = [];
    for (let i = 0; i < 6; ++i) {
      const next = new_participant();
      seen.push(order_text(next.order));
      keep(columns.map((name) => name === "participant" ? next.id : name === "order" ? order_text(next.order) : ""));
    }
    return [...new Set(seen)];
  })())js");
  EXPECT_EQ(orders.size(), 6u) << orders.dump();
}

}  // namespace
}  // namespace tactus::firmware
