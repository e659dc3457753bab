#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "firmware_host/html.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/ratings_file.hpp"
#include "firmware_host/repeated_measures.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_sets.hpp"
#include "firmware_host/study_text.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {
namespace {

/// Degrees of freedom: whole ones without decimals.
std::string df_text(double df) { return fixed(df, df == std::nearbyint(df) ? 0 : 3); }

/// A statistic whose error may be 0.
std::string statistic_text(double value) {
  if (std::isnan(value)) return "undefined";
  return std::isinf(value) ? (value < 0 ? "-infinity" : "infinity") : fixed(value, 3);
}

std::string f_text(const FTest& test) {
  return "F(" + df_text(test.df_effect) + ", " + df_text(test.df_error) + ") = " + statistic_text(test.f) + ", " + p_text(test.p);
}

nlohmann::json json_of(const FTest& test) {
  return {{"f", test.f}, {"df_effect", test.df_effect}, {"df_error", test.df_error}, {"p", test.p}};
}

/// A background question: who answered what, groups in the order of their names.
struct Factor {
  std::string name;
  std::map<std::string, std::size_t> sizes;
  std::vector<std::size_t> group;  // per participant
};

Factor factor_of(const RatingsFile& file, std::size_t index) {
  Factor factor{file.factors[index], {}, {}};
  for (const Answer& answer : file.answers)
    if (answer.left_out == LeftOut::no) ++factor.sizes[answer.backgrounds[index]];
  for (const Answer& answer : file.answers)
    if (answer.left_out == LeftOut::no)
      factor.group.push_back(
          static_cast<std::size_t>(std::distance(factor.sizes.begin(), factor.sizes.find(answer.backgrounds[index]))));
  return factor;
}

/// Means with 95 % intervals; the rating's whole scale, so that no difference is drawn larger than it is.
std::string plot_svg(const RatingsFile& file, const std::vector<Spread>& spreads) {
  constexpr double kWidth = 120, kTop = 20, kHeight = 270, kLeft = 50;
  const auto y_of = [&](double rating) { return kTop + kHeight * (10 - rating) / 9; };
  const double right = kLeft + kWidth * static_cast<double>(spreads.size());
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + fixed(right + 20, 0) +
                    "\" height=\"340\" font-family=\"sans-serif\" font-size=\"13\">\n"
                    "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (int rating = 1; rating <= 10; ++rating)
    svg += "<path d=\"M" + fixed(kLeft, 0) + " " + fixed(y_of(rating), 1) + "H" + fixed(right, 0) +
           "\" stroke=\"#ddd\"/><text x=\"40\" y=\"" + fixed(y_of(rating) + 4, 1) + "\" text-anchor=\"end\">" +
           std::to_string(rating) + "</text>\n";
  for (std::size_t c = 0; c < spreads.size(); ++c) {
    const Spread& s = spreads[c];
    const double x = kLeft + kWidth * (static_cast<double>(c) + 0.5), top = y_of(s.mean);
    const double low = y_of(std::max(s.ci95_low, 1.0)), high = y_of(std::min(s.ci95_high, 10.0));
    svg += "<rect x=\"" + fixed(x - 30, 1) + "\" y=\"" + fixed(top, 1) + "\" width=\"60\" height=\"" +
           fixed(y_of(1) - top, 1) + "\" fill=\"#7aa6d8\"/><path d=\"M" + fixed(x, 1) + " " + fixed(low, 1) + "V" +
           fixed(high, 1) + "M" + fixed(x - 8, 1) + " " + fixed(low, 1) + "h16M" + fixed(x - 8, 1) + " " +
           fixed(high, 1) + "h16\" stroke=\"#222\" stroke-width=\"1.5\" fill=\"none\"/><text x=\"" + fixed(x, 1) +
           "\" y=\"310\" text-anchor=\"middle\">" + escaped(file.conditions[c]) + "</text><text x=\"" + fixed(x, 1) +
           "\" y=\"328\" text-anchor=\"middle\" fill=\"#555\">" + fixed(s.mean, 2) + "</text>\n";
  }
  return svg + "</svg>\n";
}

// The figures as the paper prints them (section V-B).
constexpr double kPaperChi2 = 42.029, kPaperF = 212.293, kPaperDfEffect = 1.330, kPaperDfError = 81.135;
constexpr std::size_t kPaperPeople = 62, kPaperConditions = 3;
constexpr std::size_t kPaperPeopleMax = 70;  // 68 answered
struct Printed {
  const char* what;
  double value;
  int decimals;
};
constexpr Printed kPaperMeans[] = {{"semantic", 8.427, 3}, {"uniform", 5.935, 3}, {"none", 3.71, 2}};
constexpr Printed kPaperShares[] = {{"had played first-person shooters", 69.57, 2},
                                    {"had used virtual or mixed reality", 65.22, 2}};

/// What of the paper's printed figures follows from the others, and what cannot be.
std::string paper_text() {
  const double w = mauchly_w_of(kPaperChi2, kPaperPeople, kPaperConditions), e = epsilon_of_three_conditions(w);
  const double df_effect = (kPaperConditions - 1) * e, df_error = df_effect * (kPaperPeople - 1);
  const std::string people = std::to_string(kPaperPeople);
  std::string text = "The paper's own printed figures\n  Mauchly's chi2 of " + fixed(kPaperChi2, 3) + " with " +
                     people + " people fixes W = " + fixed(w, 3) + " and epsilon = " + fixed(e, 3) +
                     ", hence F(" + fixed(df_effect, 3) + ", " + fixed(df_error, 3) + "); printed: F(" +
                     fixed(kPaperDfEffect, 3) + ", " + fixed(kPaperDfError, 3) + ") = " + fixed(kPaperF, 3) + ".\n";
  text += "  They give a partial eta2 of " +
          fixed(kPaperF * kPaperDfEffect / (kPaperF * kPaperDfEffect + kPaperDfError), 3) + ", which is not printed.\n";
  for (const auto& [what, mean, decimals] : kPaperMeans) {
    if (mean_is_possible(mean, decimals, kPaperPeople)) continue;
    text += std::string("  The mean of ") + what + ", " + fixed(mean, decimals) + ", is not one of " + people + " whole ratings" +
            (mean_is_possible(mean, decimals, kPaperPeople, 2) ? "; with half points it is.\n" : ", nor of half points.\n");
  }
  for (const auto& [what, share, decimals] : kPaperShares) {
    if (percentage_is_possible(share, decimals, kPaperPeople)) continue;
    text += "  " + fixed(share, decimals) + " % (" + what + ") is no number of " + people + " people; of up to " +
            std::to_string(kPaperPeopleMax) + " it could be";
    for (std::size_t n = 1; n <= kPaperPeopleMax; ++n)
      if (percentage_is_possible(share, decimals, n)) text += " " + std::to_string(n);
    text += ".\n";
  }
  return text;
}

}  // namespace

rt::Result<std::string> study_stats(const StudyStatsOptions& options) {
  const auto file = read_ratings(options.ratings);
  if (!file) return file.error();
  Ratings ratings{file->conditions.size(), {}};
  std::size_t counts[4] = {};
  for (const Answer& answer : file->answers) {
    ++counts[static_cast<std::size_t>(answer.left_out)];
    if (answer.left_out == LeftOut::no)
      ratings.values.insert(ratings.values.end(), answer.ratings.begin(), answer.ratings.end());
  }
  const std::size_t n = ratings.participants_count(), k = ratings.conditions_count;
  const std::string who =
      std::to_string(file->answers.size()) + " answers; left out: " + std::to_string(counts[1]) + " not confirmed, " +
      std::to_string(counts[2]) + " that watched a clip for less than " + fixed(kViewedMinS, 0) + " s, " +
      std::to_string(counts[3]) + " without all ratings; " + std::to_string(n) + " analysed";
  if (n < 2)
    return rt::Error{rt::ExitCode::bad_input, options.ratings.string() + ": " + who + "; at least 2 are needed."};

  std::string text = who + "\n\n  condition              n    mean      SD   95 % of the mean\n";
  nlohmann::json json = {{"answers", file->answers.size()},
                         {"left_out", {{"not_confirmed", counts[1]}, {"viewed_too_briefly", counts[2]}, {"unanswered", counts[3]}}},
                         {"analysed", n}};
  std::vector<Spread> spreads;
  std::vector<double> column(n);
  for (std::size_t c = 0; c < k; ++c) {
    for (std::size_t s = 0; s < n; ++s) column[s] = ratings.at(s, c);
    const Spread& s = spreads.emplace_back(spread_of(column));
    char line[160];
    std::snprintf(line, sizeof line, " %5zu  %6.3f  %6.3f   %6.3f to %.3f\n", s.n, s.mean, s.sd, s.ci95_low, s.ci95_high);
    text += "  " + padded(file->conditions[c], 18) + line;
    json["conditions"].push_back(
        {{"name", file->conditions[c]}, {"n", s.n}, {"mean", s.mean}, {"sd", s.sd}, {"ci95", {s.ci95_low, s.ci95_high}}});
  }

  const RepeatedMeasures anova = repeated_measures(ratings);
  const Sphericity& sphericity = anova.sphericity;
  if (k > 2)
    text += "\nSphericity (Mauchly): W = " + fixed(sphericity.w, 3) + ", chi2(" + df_text(sphericity.df) +
            ") = " + statistic_text(sphericity.chi2) + ", " + p_text(sphericity.p) + "; epsilon " +
            fixed(sphericity.greenhouse_geisser, 3) + " (Greenhouse and Geisser), " + fixed(sphericity.huynh_feldt, 3) +
            " (Huynh and Feldt)";
  text += "\nConditions: " + f_text(anova.corrected) + ", partial eta2 = " + statistic_text(anova.partial_eta2);
  if (k > 2) text += " (Greenhouse-Geisser); uncorrected " + f_text(anova.uncorrected);
  text += "\nPairs (Bonferroni)\n";
  json["anova"] = {{"corrected", json_of(anova.corrected)},
                   {"uncorrected", json_of(anova.uncorrected)},
                   {"partial_eta2", anova.partial_eta2},
                   {"mauchly", {{"w", sphericity.w}, {"chi2", sphericity.chi2}, {"df", sphericity.df}, {"p", sphericity.p}}},
                   {"greenhouse_geisser", sphericity.greenhouse_geisser},
                   {"huynh_feldt", sphericity.huynh_feldt}};
  for (const PairTest& pair : pairwise(ratings)) {
    text += "  " + file->conditions[pair.first] + " - " + file->conditions[pair.second] + ": " +
            fixed(pair.mean_difference, 3) + " (" + fixed(pair.ci95_low, 3) + " to " + fixed(pair.ci95_high, 3) + "), t(" +
            df_text(pair.df) + ") = " + statistic_text(pair.t) + ", " + p_text(pair.p_bonferroni) + "\n";
    json["pairs"].push_back({{"first", file->conditions[pair.first]},
                             {"second", file->conditions[pair.second]},
                             {"mean_difference", pair.mean_difference},
                             {"ci95", {pair.ci95_low, pair.ci95_high}},
                             {"t", pair.t},
                             {"df", pair.df},
                             {"p", pair.p_bonferroni}});
  }

  json["backgrounds"] = nlohmann::json::array();
  for (std::size_t i = 0; i < file->factors.size(); ++i) {
    const Factor factor = factor_of(*file, i);
    text += "Background " + factor.name + " (";
    nlohmann::json entry = {{"name", factor.name}, {"groups", factor.sizes}};
    bool is_first = true;
    for (const auto& [answer, count] : factor.sizes) {
      text += (is_first ? "" : ", ") + (answer.empty() ? std::string("no answer") : answer) + " " + std::to_string(count);
      is_first = false;
    }
    text += "): ";
    if (factor.sizes.size() < 2 || n <= factor.sizes.size() + 1) {
      text += factor.sizes.size() < 2 ? "one group, nothing to compare\n" : "too few answers for so many groups\n";
    } else {
      const MixedAnova mixed = mixed_anova(ratings, factor.group, factor.sizes.size());
      text += f_text(mixed.between) + "; with the conditions " + f_text(mixed.interaction) + "\n";
      entry["between"] = json_of(mixed.between);
      entry["conditions"] = json_of(mixed.conditions);
      entry["interaction"] = json_of(mixed.interaction);
      entry["greenhouse_geisser"] = mixed.epsilon;
    }
    json["backgrounds"].push_back(entry);
  }
  text += "\n" + paper_text();

  const std::string json_text = to_text(json);
  if (!options.out.empty()) {
    if (auto made = make_study_folder(options.out); !made) return made.error();
    if (auto wrote = write_file(options.out / "stats.json", json_text); !wrote) return wrote.error();
    if (auto wrote = write_file(options.out / "ratings.svg", plot_svg(*file, spreads)); !wrote) return wrote.error();
    text += "stats.json and ratings.svg are in " + options.out.string() + "\n";
  }
  return options.is_json ? json_text : text;
}

}  // namespace tactus::firmware
