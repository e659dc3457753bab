#include "tests/house/rules.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <regex>

namespace tactus::house {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// Where `word` stands in `code` by itself, not as a part of a longer name; npos when nowhere.
std::size_t find_word(std::string_view code, std::string_view word, std::size_t from = 0) {
  for (auto at = code.find(word, from); at != std::string_view::npos; at = code.find(word, at + 1)) {
    const bool starts = at == 0 || !is_word(code[at - 1]) || !is_word(word.front());
    const auto end = at + word.size();
    const bool ends = end == code.size() || !is_word(code[end]) || !is_word(word.back());
    if (starts && ends) return at;
  }
  return std::string_view::npos;
}

bool is_excepted(std::string_view path, std::string_view word, std::span<const Exception> exceptions) {
  return std::any_of(exceptions.begin(), exceptions.end(), [&](const Exception& e) {
    return e.word == word && (e.path == path || (e.path.ends_with('/') && path.starts_with(e.path)));
  });
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// The folder that a layer rule is about: "rt", "hal", "hal/replay", "pipeline", "pipeline/map", "tests".
std::string layer_of(std::string_view path) {
  const auto first = path.find('/');
  if (first == std::string_view::npos) return "";
  const std::string_view top = path.substr(0, first);
  const auto second = path.find('/', first + 1);
  if ((top == "hal" || top == "pipeline") && second != std::string_view::npos)
    return std::string(path.substr(0, second));
  return std::string(top);
}

bool is_hal_backend(std::string_view layer) { return layer.starts_with("hal/"); }

// The arrows between the stages' folders; each may always name itself, hal interfaces and rt.
struct Arrow {
  std::string_view from, to;
};
constexpr std::array kStageArrows{
    Arrow{"pipeline/map", "pipeline/label"},      Arrow{"pipeline/track", "pipeline/map"},
    Arrow{"pipeline/segment", "pipeline/label"},  Arrow{"pipeline/contact", "pipeline/map"},
    Arrow{"pipeline/contact", "pipeline/label"},  Arrow{"pipeline/interact", "pipeline/contact"},
    Arrow{"pipeline/interact", "pipeline/label"}, Arrow{"pipeline/interact", "pipeline/map"},
    Arrow{"pipeline/render", "pipeline/label"},   Arrow{"pipeline/evaluate", "pipeline/label"},
    Arrow{"pipeline/track", "pipeline/label"},    Arrow{"pipeline/map", "pipeline/register"},
    Arrow{"pipeline/track", "pipeline/register"}, Arrow{"pipeline/sound", "pipeline/contact"},
    Arrow{"pipeline/sound", "pipeline/label"},    Arrow{"pipeline/sound", "pipeline/map"},
};
bool may_include(std::string_view from, std::string_view to) {
  if (from == to || from == "tests") return true;
  if (from == "firmware_host") return to != "tests";
  if (to == "rt") return true;
  if (from == "rt") return false;
  if (to == "hal" || to == "hal/toml") return true;
  if (from == "hal" || from == "hal/toml" || from == "hal/frames") return false;
  if (is_hal_backend(from)) return to == "hal/frames";
  if (from == "pipeline") return to.starts_with("pipeline/");
  return std::any_of(kStageArrows.begin(), kStageArrows.end(),
                     [&](const Arrow& arrow) { return arrow.from == from && arrow.to == to; });
}

bool is_in_step_scope(std::string_view path) {
  const std::string layer = layer_of(path);
  return layer == "rt" || layer == "hal" || layer == "pipeline" ||
         (layer.starts_with("pipeline/") && layer != "pipeline/evaluate");
}

bool is_in_result_scope(std::string_view path) {
  const std::string layer = layer_of(path);
  return is_in_step_scope(path) && layer != "pipeline/render" && layer != "pipeline/sound";
}

constexpr std::array<std::string_view, 45> kStepWords{
    // heap
    "new", "delete", "malloc(", "calloc(", "realloc(", "free(", "aligned_alloc", "posix_memalign", "strdup(",
    "shared_ptr", "make_shared", "make_unique", "std::function", "std::any", "std::list", "std::deque",
    "std::map", "std::set",
    // locks
    "std::mutex", "std::recursive_mutex", "std::shared_mutex", "std::lock_guard", "std::unique_lock",
    "std::scoped_lock", "std::condition_variable", "std::call_once", "pthread_mutex_lock",
    // waiting
    "sleep_for", "sleep_until", "usleep", "nanosleep",
    // printing and files
    "iostream", "std::cout", "std::cerr", "printf(", "fprintf(", "std::ofstream", "std::ifstream",
    // exceptions and run-time types
    "throw", "catch", "dynamic_cast", "typeid",
    // clocks: time comes in by argument
    "::now", "clock_gettime", "gettimeofday"};
// A stage is handed the time; what has a Clock at all is rt/ and the wiring.
constexpr std::array<std::string_view, 1> kStageWords{"now("};

constexpr std::array<std::string_view, 9> kGrowingWords{
    "std::string",        "std::to_string",     "std::vector",      "std::stringstream", "std::ostringstream",
    "std::unordered_map", "std::unordered_set", "std::make_unique", "std::filesystem"};

constexpr std::array<std::string_view, 40> kDeterminismWords{"std::sin",
                                                             "std::cos",
                                                             "std::tan",
                                                             "std::asin",
                                                             "std::acos",
                                                             "std::atan",
                                                             "std::atan2",
                                                             "std::exp",
                                                             "std::exp2",
                                                             "std::log",
                                                             "std::log2",
                                                             "std::log10",
                                                             "std::pow",
                                                             "std::cbrt",
                                                             "std::hypot",
                                                             "std::fma",
                                                             "sinf",
                                                             "cosf",
                                                             "expf",
                                                             "logf",
                                                             "powf",
                                                             "std::sinh",
                                                             "std::cosh",
                                                             "std::tanh",
                                                             "std::expm1",
                                                             "std::log1p",
                                                             "std::erf",
                                                             "std::reduce",
                                                             "std::unordered_map",
                                                             "std::unordered_set",
                                                             "std::random_device",
                                                             "std::normal_distribution",
                                                             "rand",
                                                             "MulAdd",
                                                             "NegMulAdd",
                                                             "MulSub",
                                                             "ApproximateReciprocal",
                                                             "ApproximateReciprocalSqrt",
                                                             "immintrin.h",
                                                             "arm_neon.h"};

// A member that shares its name with a banned function is another function: pool.free(slot).
bool is_member(std::string_view code, std::size_t at) {
  const std::string_view before = trim(code.substr(0, at));
  return before.ends_with('.') || before.ends_with("->");
}

// `new (place) T` puts an object into memory that is there already, <new> declares that; `= delete` is a
// declaration; operator new and operator delete are names.
bool is_harmless(std::string_view code, std::size_t at, std::string_view word) {
  if (is_member(code, at) && word != "now(") return true;
  if (word != "new" && word != "delete") return false;
  const std::string_view before = trim(code.substr(0, at));
  const std::string_view after = trim(code.substr(at + word.size()));
  if (before.ends_with("operator")) return true;
  if (word == "delete") return before.ends_with('=');
  return after.starts_with('(') || (before.ends_with('<') && after.starts_with('>'));
}

template <std::size_t N>
std::vector<Finding> find_words(const SourceFile& file, const std::array<std::string_view, N>& words,
                                std::string_view why, std::span<const Exception> exceptions) {
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string_view code = file.lines[i].code;
    for (const std::string_view word : words) {
      for (auto at = find_word(code, word); at != std::string_view::npos;
           at = find_word(code, word, at + 1)) {
        if (is_harmless(code, at, word) || is_excepted(file.path, word, exceptions)) continue;
        findings.push_back({file.path, static_cast<int>(i + 1), std::string(word) + ": " + std::string(why)});
        break;
      }
    }
  }
  return findings;
}

// All code of a file as one text, with the line of each character.
struct Code {
  std::string text;
  std::vector<int> line;
};
Code join(const SourceFile& file) {
  Code code;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    code.text += file.lines[i].code;
    code.text += '\n';
    code.line.resize(code.text.size(), static_cast<int>(i + 1));
  }
  return code;
}

std::size_t skip_space(std::string_view text, std::size_t at) {
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
  return at;
}

// One past the bracket that closes the one at `open`; the text's end when it is never closed.
std::size_t skip_brackets(std::string_view text, std::size_t open) {
  int depth = 0;
  for (std::size_t i = open; i < text.size(); ++i) {
    if (text[i] == '(' || text[i] == '{' || text[i] == '[') ++depth;
    if (text[i] == ')' || text[i] == '}' || text[i] == ']') --depth;
    if (depth == 0) return i + 1;
  }
  return text.size();
}

// The opening brace of the body that belongs to the declarator ending at `at`; nothing for a mere
// declaration.
std::optional<std::size_t> find_body(std::string_view text, std::size_t at) {
  bool initialisers = false;
  for (at = skip_space(text, at); at < text.size(); at = skip_space(text, at)) {
    const char c = text[at];
    if (c == ';' || c == '=' || c == ')' || c == ',') {
      if (c != ',' || !initialisers) return std::nullopt;
      ++at;
    } else if (text.substr(at).starts_with("::")) {
      at += 2;
    } else if (c == ':') {
      initialisers = true;
      ++at;
    } else if (c == '(') {
      at = skip_brackets(text, at);
    } else if (c == '{') {
      // Within initialisers a brace right after a name or a template's end holds that member's value.
      const auto before = text.find_last_not_of(" \t\n", at - 1);
      if (!initialisers || !(is_word(text[before]) || text[before] == '>')) return at;
      at = skip_brackets(text, at);
    } else {
      ++at;
    }
  }
  return std::nullopt;
}

bool looks_like_code(std::string_view comment) {
  static const std::regex statement(
      R"(^(return\b.*|break|continue|(auto|const|static|constexpr|int|float|double|bool|std::\w+|using|delete)\s.*=.*|)"
      R"([\w:.\[\]>-]+(->|\.)?\w*\s*(\(.*\)|[-+*/|&]?=\s.+))\s*;$)");
  static const std::regex opening(
      R"(^((if|for|while|switch)\s*\(.*\)|else|do|\}\s*else.*|.*\))\s*(const|noexcept)?\s*\{$)");
  static const std::regex directive(R"(^#\s*(include|define|if|ifdef|ifndef|endif|else|pragma)\b.*)");
  const std::string text(trim(comment));
  return text == "{" || text == "}" || text == "};" || std::regex_match(text, statement) ||
         std::regex_match(text, opening) || std::regex_match(text, directive);
}

// An example within an explanation is set off by three blanks and stands below a colon or an empty comment
// line.
bool is_example(const SourceFile& file, std::size_t line) {
  if (line == 0 || file.lines[line].raw.find("//   ") == std::string::npos) return false;
  const Line& above = file.lines[line - 1];
  const std::string_view text = trim(above.comment);
  return above.raw.find("//") != std::string::npos && (text.empty() || text.ends_with(':'));
}

bool is_banner(std::string_view comment) {
  const auto text = trim(comment);
  return text.size() >= 8 && text.find_first_not_of("=-*#/~_+") == std::string_view::npos;
}

// Whether the function body that opens at `body` asserts, itself or through functions of the same file.
bool asserts(const std::string& text, std::size_t body, int depth) {
  static const std::regex assertion(R"(\b(EXPECT_|ASSERT_|FAIL\(|ADD_FAILURE|SUCCEED\(\) <<|expect_))");
  static const std::regex call(R"(\b(\w+)\s*(<[\w:, ]*>\s*)?\()");
  const std::string inside = text.substr(body, skip_brackets(text, body) - body);
  if (std::regex_search(inside, assertion)) return true;
  if (depth == 0) return false;
  for (auto it = std::sregex_iterator(inside.begin(), inside.end(), call); it != std::sregex_iterator();
       ++it) {
    const std::string name = it->str(1);
    for (auto at = find_word(text, name); at != std::string_view::npos; at = find_word(text, name, at + 1)) {
      const auto open = skip_space(text, at + name.size());
      if (open >= text.size() || text[open] != '(') continue;
      const auto after = skip_space(text, skip_brackets(text, open));
      if (after < text.size() && text[after] == '{' && after != body && asserts(text, after, depth - 1))
        return true;
    }
  }
  return false;
}

}  // namespace

std::string to_string(const Finding& finding) {
  return finding.path + ":" + std::to_string(finding.line) + ": " + finding.what;
}

std::vector<Finding> check_include_direction(const SourceFile& file) {
  static const std::regex include(R"(^\s*#\s*include\s*"([^"]+)\".*)");
  constexpr std::array<std::string_view, 5> kTops{"rt", "hal", "pipeline", "firmware_host", "tests"};
  std::vector<Finding> findings;
  const std::string from = layer_of(file.path);
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (!std::regex_match(file.lines[i].code, match, include)) continue;
    const std::string target = match[1];
    const auto report = [&](const std::string& what) {
      findings.push_back({file.path, static_cast<int>(i + 1), "includes " + target + ": " + what});
    };
    const std::string top = target.substr(0, target.find('/'));
    if (target.starts_with("hwy/")) continue;  // Highway's own idiom, around its foreach_target.h
    if (target.find('/') == std::string::npos || std::find(kTops.begin(), kTops.end(), top) == kTops.end()) {
      report("quoted includes start at the repository's root; third parties come in angle brackets");
      continue;
    }
    const std::string to = layer_of(target);
    if (!may_include(from, to)) report("no arrow leads from " + from + " to " + to);
  }
  return findings;
}

std::vector<Finding> check_step_words(const SourceFile& file, std::span<const Exception> exceptions) {
  if (!is_in_step_scope(file.path)) return {};
  auto findings = find_words(
      file, kStepWords, "can be reached from a step, and may allocate, wait, print or throw", exceptions);
  if (layer_of(file.path).starts_with("pipeline/")) {
    const auto clocks = find_words(file, kStageWords, "a stage reads no clock", exceptions);
    findings.insert(findings.end(), clocks.begin(), clocks.end());
  }
  return findings;
}

std::vector<Finding> check_determinism_words(const SourceFile& file, std::span<const Exception> exceptions) {
  if (!is_in_result_scope(file.path)) return {};
  return find_words(file, kDeterminismWords, "its result differs from machine to machine", exceptions);
}

std::vector<Finding> check_noexcept_bodies(const SourceFile& file, std::span<const Exception> exceptions) {
  if (!is_in_step_scope(file.path)) return {};
  std::vector<Finding> findings;
  const Code code = join(file);
  const std::string_view text = code.text;
  for (auto at = find_word(text, "noexcept"); at != std::string_view::npos;
       at = find_word(text, "noexcept", at + 1)) {
    const auto body = find_body(text, at + std::string_view("noexcept").size());
    if (!body) continue;
    const std::string_view inside = text.substr(*body, skip_brackets(text, *body) - *body);
    for (const std::string_view word : kGrowingWords) {
      const auto found = find_word(inside, word);
      if (found == std::string_view::npos || is_excepted(file.path, word, exceptions)) continue;
      findings.push_back(
          {file.path, code.line[*body + found], std::string(word) + ": grows inside a noexcept function"});
    }
  }
  return findings;
}

std::vector<Finding> check_comments(const SourceFile& file) {
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string_view comment = file.lines[i].comment;
    const auto report = [&](std::string what) {
      findings.push_back({file.path, static_cast<int>(i + 1), std::move(what)});
    };
    for (const std::string_view word : {"TODO", "FIXME", "XXX", "HACK"})
      if (find_word(comment, word) != std::string_view::npos) report(std::string(word) + " in a comment");
    if (looks_like_code(comment) && !is_example(file, i))
      report("code in a comment: " + std::string(trim(comment)));
    if (is_banner(comment)) report("banner line");
    const auto lint = comment.find("NOLINT");
    if (lint != std::string_view::npos && comment.find(": ", lint) == std::string_view::npos)
      report("a lint switch without its reason on the same line");
  }
  return findings;
}

std::vector<Finding> check_atomics(const SourceFile& file) {
  if (file.path.starts_with("tests/")) return {};
  static const std::regex publishes(R"(memory_order_(acquire|release|acq_rel|seq_cst)|atomic_thread_fence)");
  static const std::regex pairs(R"([Pp]airs? with)");
  static const std::regex relaxed("[Rr]elaxed");
  int publishing_line = 0, relaxed_line = 0;
  bool names_partner = false, explains_relaxed = false;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const Line& line = file.lines[i];
    if (publishing_line == 0 && std::regex_search(line.code, publishes))
      publishing_line = static_cast<int>(i + 1);
    if (relaxed_line == 0 && line.code.find("memory_order_relaxed") != std::string::npos)
      relaxed_line = static_cast<int>(i + 1);
    names_partner = names_partner || std::regex_search(line.comment, pairs);
    explains_relaxed = explains_relaxed || std::regex_search(line.comment, relaxed);
  }
  std::vector<Finding> findings;
  if (publishing_line != 0 && !names_partner)
    findings.push_back({file.path, publishing_line, "no comment says which access this one pairs with"});
  if (relaxed_line != 0 && !explains_relaxed && !names_partner)
    findings.push_back({file.path, relaxed_line, "no comment says why relaxed is enough"});
  return findings;
}

std::vector<Finding> check_header(const SourceFile& file) {
  if (!file.path.ends_with(".hpp")) return {};
  std::vector<Finding> findings;
  const std::string_view first = file.lines.empty() ? std::string_view{} : trim(file.lines[0].comment);
  if (first.size() < 15)
    findings.push_back({file.path, 1, "the first line does not say what the header is for"});
  const auto code = std::find_if(file.lines.begin(), file.lines.end(),
                                 [](const Line& line) { return !trim(line.code).empty(); });
  if (code == file.lines.end() || trim(code->code) != "#pragma once")
    findings.push_back(
        {file.path, static_cast<int>(code - file.lines.begin()) + 1, "#pragma once must come first"});
  for (std::size_t i = 0; i < file.lines.size(); ++i)
    if (file.lines[i].code.starts_with("using namespace"))
      findings.push_back({file.path, static_cast<int>(i + 1), "using namespace in a header"});
  return findings;
}

std::vector<Finding> check_tests(const SourceFile& file) {
  if (!file.path.starts_with("tests/")) return {};
  static const std::regex test(
      R"(\b(TEST|TEST_F|TEST_P|TYPED_TEST|TYPED_TEST_P)\s*\(\s*(\w+)\s*,\s*(\w+)\s*\))");
  std::vector<Finding> findings;
  const Code code = join(file);
  bool has_cases = false;
  for (auto it = std::sregex_iterator(code.text.begin(), code.text.end(), test); it != std::sregex_iterator();
       ++it) {
    has_cases = true;
    const auto at = static_cast<std::size_t>(it->position());
    const auto body = find_body(code.text, at + static_cast<std::size_t>(it->length()));
    const std::string name = it->str(2) + "." + it->str(3);
    if (name.find("DISABLED_") != std::string::npos)
      findings.push_back({file.path, code.line[at], name + " is disabled"});
    if (body && !asserts(code.text, *body, 2))
      findings.push_back({file.path, code.line[at], name + " asserts nothing"});
  }
  if (has_cases && !file.path.ends_with("_test.cpp") && !file.path.ends_with("_suite.cpp"))
    findings.push_back({file.path, 0, "holds test cases, so its name must end in _test.cpp or _suite.cpp"});
  return findings;
}

std::vector<Finding> check_file_name(std::string_view path) {
  static const std::regex name(R"(([a-z0-9_]+/)+[a-z0-9_]+(-inl)?\.(hpp|cpp))");
  if (std::regex_match(path.begin(), path.end(), name)) return {};
  return {{std::string(path), 0, "folders and files are named in snake_case"}};
}

std::vector<Finding> check_absolute_paths(std::string_view path, std::string_view text) {
  static const std::regex machine(R"((^|[^\w.$}/])(/(home|root|work|Users|tmp|mnt|opt)/|[A-Z]:\\\\))");
  std::vector<Finding> findings;
  int number = 0;
  for (std::size_t start = 0; start < text.size();) {
    const auto end = std::min(text.find('\n', start), text.size());
    const std::string line(text.substr(start, end - start));
    ++number;
    if (std::regex_search(line, machine))
      findings.push_back({std::string(path), number, "names a path of one machine: " + line});
    start = end + 1;
  }
  return findings;
}

}  // namespace tactus::house
