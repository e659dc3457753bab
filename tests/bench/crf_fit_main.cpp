// Fits the CRF's parameters to rooms with known labels, and says how sensitive the four metrics are to each.
//
//   crf_fit ROOM.points... [--from SETTINGS.toml | --preset paper|default] [--held-out ROOM.points]...
//           [--sweep] [--fit ROUNDS] [--out SETTINGS.toml] [--sensitivity TABLE.md]
//
// ROOM.points: crf_points_file.hpp. Prints the metrics without CRF and with the starting parameters; --sweep
// a table row per parameter and factor (1/4 to 4) around them; --fit the improvements and the result, on the
// rooms and the held-out ones; --out writes the result as a settings file, --sensitivity a table of the four
// metrics on both with each parameter of the result halved and doubled. Exit codes as the program's: 0
// done, 2 bad usage, 3 bad input.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/label/crf/crf_settings.hpp"
#include "tests/bench/crf_fit.hpp"

namespace tactus::bench {
namespace {

void print_row(const std::string& what, const CrfScore& score) {
  const evaluate::LabelMetrics& m = score.metrics;
  std::printf("| %-40s | %6.2f | %6.2f | %6.2f | %6.2f | %6.2f |\n", what.c_str(), 100 * m.pixel_accuracy,
              100 * m.mean_accuracy, 100 * m.mean_iu, 100 * m.frequency_weighted_iu,
              100 * score.mean_truth_probability);
  std::fflush(stdout);
}

std::string cells(const CrfScore& score) {
  const evaluate::LabelMetrics& m = score.metrics;
  char text[80];
  std::snprintf(text, sizeof(text), " %.2f | %.2f | %.2f | %.2f |", 100 * m.pixel_accuracy,
                100 * m.mean_accuracy, 100 * m.mean_iu, 100 * m.frequency_weighted_iu);
  return text;
}

/// Markdown: a row without CRF, one for each set of parameters named, then two per parameter of the last of
/// them.
rt::Result<std::string> sensitivity_table(
    const std::vector<LabelledPoints>& rooms, const std::vector<LabelledPoints>& held_out,
    const std::vector<std::pair<std::string, label::CrfParameters>>& named) {
  std::string text =
      "| | pixel acc. | mean acc. | mean IU | f.w. IU | held out: pixel acc. | mean acc. | mean IU | f.w. IU "
      "|\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  text += "| without CRF |" + cells(score_unary(rooms)) + cells(score_unary(held_out)) + "\n";
  for (const auto& [name, parameters] : named) {
    const auto fitted = score_crf(rooms, parameters), held = score_crf(held_out, parameters);
    if (!fitted) return fitted.error();
    if (!held) return held.error();
    text += "| " + name + " |" + cells(*fitted) + cells(*held) + "\n";
  }
  const float factors[] = {0.5F, 2.0F};
  const auto silent = [](const SweepRow&) {};
  const auto on_rooms = sweep(rooms, named.back().second, factors, silent),
             on_held = sweep(held_out, named.back().second, factors, silent);
  if (!on_rooms) return on_rooms.error();
  if (!on_held) return on_held.error();
  for (std::size_t i = 0; i < on_rooms->size(); ++i) {
    char name[80];
    std::snprintf(name, sizeof(name), "%s = %g", (*on_rooms)[i].knob.c_str(),
                  static_cast<double>((*on_rooms)[i].value));
    text += "| " + std::string(name) + " |" + cells((*on_rooms)[i].score) + cells((*on_held)[i].score) + "\n";
  }
  return text;
}

rt::Result<void> write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) return rt::Error{rt::ExitCode::failed, path + ": cannot be written"};
  return {};
}

int fail(const rt::Error& error) {
  std::fprintf(stderr, "crf_fit: %s\n", error.message.c_str());
  return static_cast<int>(error.code);
}

int run(const std::vector<std::string>& arguments) {
  std::vector<LabelledPoints> rooms, held_out;
  label::CrfParameters base = label::default_crf_parameters();
  bool with_sweep = false;
  int rounds = 0;
  std::string out, table;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const bool takes_value = argument == "--from" || argument == "--preset" || argument == "--held-out" ||
                             argument == "--fit" || argument == "--out" || argument == "--sensitivity";
    if (takes_value && i + 1 == arguments.size())
      return fail({rt::ExitCode::bad_usage, argument + " needs a value"});
    if (argument == "--sweep") {
      with_sweep = true;
    } else if (argument == "--from") {
      const auto settings = label::load_crf_parameters(arguments[++i]);
      if (!settings) return fail(settings.error());
      base = *settings;
    } else if (argument == "--preset") {
      const std::string& preset = arguments[++i];
      if (preset != "paper" && preset != "default")
        return fail({rt::ExitCode::bad_usage, "--preset is paper or default"});
      base = preset == "paper" ? label::paper_crf_parameters() : label::default_crf_parameters();
    } else if (argument == "--fit") {
      rounds = std::atoi(arguments[++i].c_str());
      if (rounds < 1) return fail({rt::ExitCode::bad_usage, "--fit needs a number of rounds from 1 on"});
    } else if (argument == "--out") {
      out = arguments[++i];
    } else if (argument == "--sensitivity") {
      table = arguments[++i];
    } else if (argument.starts_with("--") && argument != "--held-out") {
      return fail({rt::ExitCode::bad_usage, "unknown option " + argument});
    } else {
      const bool is_held_out = argument == "--held-out";
      auto room = read_points(is_held_out ? arguments[++i] : argument);
      if (!room) return fail(room.error());
      (is_held_out ? held_out : rooms).push_back(std::move(*room));
    }
  }
  if (rooms.empty())
    return fail({rt::ExitCode::bad_usage, "no room was given; see the head of crf_fit_main.cpp"});

  std::size_t points = 0;
  for (const auto& room : rooms) points += room.size();
  std::printf("%zu rooms, %zu points\n| %-40s | %6s | %6s | %6s | %6s | %6s |\n", rooms.size(), points, "",
              "pixel", "mean", "mIU", "fwIU", "P true");
  print_row("without CRF", score_unary(rooms));
  const auto started = std::chrono::steady_clock::now();
  const auto before = score_crf(rooms, base);
  if (!before) return fail(before.error());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  print_row("starting parameters", *before);
  std::printf("one evaluation takes %.2f s\n", seconds);
  const auto print_step = [](const SweepRow& row) {
    print_row(row.knob + " = " + std::to_string(row.value), row.score);
  };
  if (with_sweep) {
    const float factors[] = {0.25F, 0.5F, 0.7071F, 1.4142F, 2.0F, 4.0F};
    const auto rows = sweep(rooms, base, factors, print_step);
    if (!rows) return fail(rows.error());
  }
  label::CrfParameters result = base;
  if (rounds > 0) {
    std::printf("fitting, %d rounds at most\n", rounds);
    const auto fitted = fit(rooms, base, rounds, print_step);
    if (!fitted) return fail(fitted.error());
    result = *fitted;
    const auto after = score_crf(rooms, result);
    if (!after) return fail(after.error());
    print_row("fitted parameters", *after);
  }
  if (!held_out.empty()) {
    const auto held_before = score_crf(held_out, base), held_after = score_crf(held_out, result);
    if (!held_before) return fail(held_before.error());
    if (!held_after) return fail(held_after.error());
    print_row("held out, without CRF", score_unary(held_out));
    print_row("held out, starting parameters", *held_before);
    print_row("held out, fitted parameters", *held_after);
  }
  std::printf("%s", label::format_crf_parameters(result).c_str());
  if (!out.empty())
    if (const auto wrote = write_text(out, label::format_crf_parameters(result)); !wrote)
      return fail(wrote.error());
  if (table.empty()) return 0;
  std::vector<std::pair<std::string, label::CrfParameters>> named = {
      {"the authors' (preset paper)", label::paper_crf_parameters()},
      {rounds > 0 ? "starting parameters" : "these parameters", base}};
  if (rounds > 0) named.emplace_back("fitted parameters", result);
  const auto text = sensitivity_table(rooms, held_out, named);
  if (!text) return fail(text.error());
  const auto wrote = write_text(table, *text);
  return wrote ? 0 : fail(wrote.error());
}

}  // namespace
}  // namespace tactus::bench

int main(int argc, char** argv) { return tactus::bench::run({argv + 1, argv + argc}); }
