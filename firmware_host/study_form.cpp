#include "firmware_host/study_form.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <system_error>

#include "firmware_host/html.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_form_page.hpp"
#include "pipeline/evaluate/text.hpp"

namespace tactus::firmware {
namespace {

namespace fs = std::filesystem;

// A page of more than this takes browsers seconds to open and a multiple of it in memory.
constexpr std::uintmax_t kEmbeddedMaxBytes = std::uintmax_t{256} << 20;

struct Background {
  const char *name, *question;
};
constexpr std::array<Background, 2> kBackgrounds = {
    {{"fps", "Have you played first-person shooters (FPS games) before?"},
     {"vr_ar", "Have you played virtual or augmented reality (VR/AR) games before?"}}};

std::string radio(const std::string& name, const std::string& value, const std::string& label) {
  return "<label><input type=\"radio\" name=\"" + name + "\" value=\"" + value + "\" required> " + label +
         "</label>";
}

std::string yes_no(const std::string& name, const std::string& question) {
  return "<fieldset class=\"choice\"><legend>" + question + "</legend>" + radio(name, "yes", "Yes") +
         radio(name, "no", "No") + "</fieldset>\n";
}

std::string clip_section(std::size_t index, const StudyClip& clip, double min_view_s) {
  const std::string name = "rating_" + std::to_string(index);
  std::string html =
      "<section class=\"clip\" hidden><h2></h2>\n<video controls playsinline preload=\"auto\" "
      "controlslist=\"nodownload noplaybackrate\" disablepictureinpicture src=\"" +
      escaped(clip.source) +
      "\"></video>\n<p class=\"failed bad\" role=\"alert\" hidden></p>\n"
      "<div class=\"watched\"><button type=\"button\" class=\"again\">Play from the start</button>"
      "<progress max=\"" +
      shortest(std::max(min_view_s, 0.001)) +
      "\" value=\"0\" aria-label=\"Time watched\"></progress><span class=\"said\"></span></div>\n"
      "<fieldset disabled><legend>How good and how real do you find the way in which virtual things and "
      "the room act on each other?</legend><div class=\"scale\">";
  for (int rating = 1; rating <= 10; ++rating)
    html += radio(name, std::to_string(rating), std::to_string(rating));
  return html +
         "</div><div class=\"ends\"><span>1: very bad</span><span>10: very "
         "good</span></div></fieldset></section>\n";
}

std::string settings_json(const StudyForm& form) {
  nlohmann::json json = {
      {"title", form.title}, {"min_view_s", form.min_view_s}, {"clips", nlohmann::json::array()}};
  for (const StudyClip& clip : form.clips)
    json["clips"].push_back({{"name", clip.name}, {"bytes", clip.bytes_count}});
  for (const Background& background : kBackgrounds) json["backgrounds"].push_back(background.name);
  const std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::string safe;  // a title with </script> in it must not end the block
  for (const char c : text) safe += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return safe;
}

bool is_unreserved(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
         c == '_' || c == '~';
}

/// The name comes back unchanged from a CSV: no control characters, no blanks at its ends.
bool is_column_name(const std::string& name) {
  return !name.empty() && name.front() != ' ' && name.back() != ' ' &&
         std::none_of(name.begin(), name.end(), [](char c) {
           const auto byte = static_cast<unsigned char>(c);  // whether char has a sign differs between machines
           return byte < 0x20 || byte == 0x7F;
         }) &&
         escaped(name).find("\xEF\xBF\xBD") == std::string::npos;
}

}  // namespace

std::string relative_url(const fs::path& file, const fs::path& page) {
  // By name alone, as browsers do it: they know nothing of symbolic links.
  const fs::path from = fs::absolute(page).lexically_normal().parent_path();
  const std::string path = fs::absolute(file).lexically_normal().lexically_relative(from).generic_string();
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string url;
  for (const char c : path) {
    const auto code = static_cast<unsigned char>(c);
    if (is_unreserved(c) || c == '/')
      url += c;
    else
      (url += '%', url += kDigits[code >> 4], url += kDigits[code & 15]);
  }
  return url;
}

rt::Result<std::vector<fs::path>> find_clips(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> clips;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code unknown;
    if (entry->path().extension() == ".mp4" && entry->is_regular_file(unknown))
      clips.push_back(entry->path());
  }
  if (error)
    return rt::Error{rt::ExitCode::bad_input,
                     folder.string() + ": the folder cannot be read: " + error.message() + "."};
  if (clips.size() < 2)
    return rt::Error{
        rt::ExitCode::bad_usage,
        folder.string() + ": " + (clips.empty() ? "there is no clip" : "there is one clip only") +
            " (*.mp4); put one for each of two or more conditions there, such as none.mp4, uniform.mp4 and "
            "semantic.mp4."};
  for (const fs::path& clip : clips)
    if (!is_column_name(clip.stem().string()))
      return rt::Error{rt::ExitCode::bad_input,
                       clip.string() +
                           ": the name cannot be a column's; rename the file without blanks at its ends, "
                           "control characters and bytes that are not UTF-8."};
  const auto rank = [](const fs::path& clip) {
    constexpr std::array<std::string_view, 3> kPaperOrder = {"none", "uniform", "semantic"};
    return std::find(kPaperOrder.begin(), kPaperOrder.end(), clip.stem().string()) - kPaperOrder.begin();
  };
  std::sort(clips.begin(), clips.end(), [&](const fs::path& a, const fs::path& b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a.filename() < b.filename();
  });
  return clips;
}

std::string study_form_html(const StudyForm& form) {
  const bool is_embedded = !form.clips.empty() && form.clips.front().source.starts_with("data:");
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta "
      "http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; media-src ";
  html += is_embedded ? "data:" : "'self' file:";
  html +=
      "; base-uri 'none'; form-action 'none'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><meta name=\"referrer\" "
      "content=\"no-referrer\">\n<title>" +
      escaped(form.title) + "</title><style>" + std::string(kStudyFormStyle) +
      "</style></head>\n<body><main>\n<h1>" + escaped(form.title) +
      "</h1>\n<noscript><p class=\"bad\">This page works with JavaScript only; please allow it. It loads "
      "nothing from "
      "anywhere.</p></noscript>\n<section id=\"intro\" hidden><h2>What this is about</h2>\n<p>You will see " +
      std::to_string(form.clips.size()) +
      " short clips in which virtual things are thrown into a real room. Watch each of them carefully, as "
      "often as you "
      "like, and rate it from 1 (very bad) to 10 (very good) for the quality and the realism of what "
      "happens.</p>\n"
      "<p>A clip can be rated once you have watched it for " +
      shortest(form.min_view_s) +
      " s; playing it again counts, jumping ahead does not. Earlier ratings can be changed until you "
      "finish.</p>\n"
      "<p class=\"soft\">Taking part is voluntary and anonymous: you may stop at any time by closing this "
      "page, and "
      "nobody is asked for a name. Your ratings, how long you watched, two answers about your experience and "
      "what you "
      "write are kept in this browser, under a random number, for the person who runs the study. This page "
      "sends "
      "nothing over the network.</p>\n"
      "<button type=\"button\" class=\"main\" id=\"start\">I agree to take part</button></section>\n"
      "<form id=\"form\" autocomplete=\"off\" hidden>\n<section><h2>About you</h2>\n";
  for (const Background& background : kBackgrounds)
    html += yes_no(std::string("background_") + background.name, background.question);
  html += "</section>\n<div id=\"clips\">\n";
  for (std::size_t i = 0; i < form.clips.size(); ++i) html += clip_section(i, form.clips[i], form.min_view_s);
  html +=
      "</div>\n<section id=\"end\" hidden><h2>To finish</h2>\n" +
      yes_no("confirmed", "I have watched the videos carefully.") +
      "<p><label for=\"comment\">What else would you like to say? (You may leave this empty.)</label></p>\n"
      "<p><textarea id=\"comment\" name=\"comment\" rows=\"4\" maxlength=\"4000\"></textarea></p>\n"
      "<button class=\"main\">Finish</button></section>\n</form>\n"
      "<section id=\"done\" hidden><h2 id=\"thanks\" tabindex=\"-1\">Thank you!</h2>\n"
      "<p><label for=\"line\">Your answers, as they were noted:</label></p>\n"
      "<p><textarea id=\"line\" rows=\"5\" readonly></textarea></p>\n"
      "<button type=\"button\" class=\"main\" id=\"save\">Save as CSV</button>"
      "<button type=\"button\" id=\"next\">Next participant</button></section>\n"
      "<details><summary>For the person who runs the study</summary>\n<p id=\"kept_count\"></p>\n"
      "<p id=\"storage_fails\" class=\"bad\" hidden>This browser does not let the page keep answers, or what "
      "it kept "
      "cannot be read: save each participant's CSV before the page is closed.</p>\n"
      "<button type=\"button\" id=\"export\">Export all as CSV</button><button type=\"button\" "
      "id=\"clear\">Clear"
      "</button>\n<p id=\"sure\" hidden>Everything that this page kept here will be gone. "
      "<button type=\"button\" id=\"no_clear\">Keep it</button><button type=\"button\" "
      "id=\"yes_clear\">Clear it"
      "</button></p>\n<p class=\"soft\">The CSV is what <code>tactus study stats</code> reads; it leaves out "
      "who watched a "
      "clip for less than 10 s.</p></details>\n</main>\n<script type=\"application/json\" id=\"settings\">" +
      settings_json(form) + "</script>\n<script>" + std::string(kStudyFormScript) +
      "</script></body></html>\n";
  return html;
}

rt::Result<std::string> study_form(const StudyFormOptions& options) {
  if (options.out.extension() != ".html")
    return rt::Error{rt::ExitCode::bad_usage,
                     options.out.string() + ": --out names the page, which ends in .html."};
  const auto paths = find_clips(options.clips);
  if (!paths) return paths.error();
  StudyForm form{options.title, options.min_view_s, {}};
  std::uintmax_t bytes_count = 0;
  for (const fs::path& path : *paths) {
    std::error_code error;
    StudyClip clip{path.stem().string(), relative_url(path, options.out), fs::file_size(path, error)};
    if (error)
      return rt::Error{rt::ExitCode::bad_input,
                       path.string() + ": the clip cannot be read: " + error.message() + "."};
    if (options.is_embedded) {
      bytes_count += clip.bytes_count;
      if (bytes_count > kEmbeddedMaxBytes)
        return rt::Error{rt::ExitCode::bad_usage,
                         options.clips.string() + ": the clips are larger than the " +
                             readable_bytes(kEmbeddedMaxBytes) +
                             " that one page can hold; leave --embed out or shrink them."};
      const auto bytes = evaluate::read_file(path, kEmbeddedMaxBytes);
      if (!bytes) return bytes.error();
      clip.source = "data:video/mp4;base64," + base64(*bytes);
    }
    form.clips.push_back(std::move(clip));
  }
  if (auto wrote = write_file(options.out, study_form_html(form)); !wrote) return wrote.error();
  std::string text = options.out.string() + " asks about";
  for (const StudyClip& clip : form.clips) text += (&clip == form.clips.data() ? " " : ", ") + clip.name;
  text += options.is_embedded ? "; the clips are in it.\n" : "; it plays";
  if (!options.is_embedded)
    for (const StudyClip& clip : form.clips) text += (&clip == form.clips.data() ? " " : ", ") + clip.source;
  return options.is_embedded ? text : text + ", which must stay where they are relative to the page.\n";
}

}  // namespace tactus::firmware
