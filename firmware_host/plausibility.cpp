#include "firmware_host/plausibility.hpp"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "firmware_host/study_text.hpp"
#include "rt/assert.hpp"

namespace tactus::firmware {
namespace {

/// Whether a contact went as expected, by its id.
using Matches = std::map<std::uint64_t, bool>;

rt::Result<Matches> matches_of(const PlausibilityCondition& condition) {
  Matches matches;
  for (const JudgedContact& contact : condition.contacts)
    if (!matches.emplace(contact.id, contact.actual == contact.expected).second)
      return rt::Error{rt::ExitCode::bad_input, "condition " + condition.name + ": contact " +
                                                    std::to_string(contact.id) +
                                                    " is there twice; give each its own number."};
  if (matches.empty())
    return rt::Error{
        rt::ExitCode::bad_input,
        "condition " + condition.name + ": no contact was judged; throw at something that is there."};
  return matches;
}

ConditionShare share_of(const PlausibilityCondition& condition) {
  ConditionShare share;
  share.name = condition.name;
  share.n = condition.contacts.size();
  for (const JudgedContact& contact : condition.contacts) {
    if (contact.actual == contact.expected) ++share.matches;
    ++share.counts[static_cast<std::size_t>(contact.expected)][static_cast<std::size_t>(contact.actual)];
  }
  share.share = static_cast<double>(share.matches) / static_cast<double>(share.n);
  share.ci95 = wilson95(share.matches, share.n);
  return share;
}

std::string percent(double share) { return fixed(100 * share, 1); }

}  // namespace

Interval wilson95(std::size_t successes, std::size_t n) {
  TACTUS_ASSERT(n > 0 && successes <= n);
  const double z = boost::math::quantile(boost::math::normal(), 0.975);
  const auto count = static_cast<double>(n);
  const double p = static_cast<double>(successes) / count, z2 = z * z / count;
  const double middle = (p + z2 / 2) / (1 + z2), half = std::sqrt(z2 * (p * (1 - p) + z2 / 4)) / (1 + z2);
  // At none and at all, the formula's zero and one come out with the last bit wrong.
  return {successes == 0 ? 0 : middle - half, successes == n ? 1 : middle + half};
}

double mcnemar_exact_p(std::size_t only_first, std::size_t only_second) {
  const std::size_t differing = only_first + only_second;
  if (differing == 0) return 1;
  const boost::math::binomial coin(static_cast<double>(differing), 0.5);
  return std::min(1.0, 2 * boost::math::cdf(coin, static_cast<double>(std::min(only_first, only_second))));
}

rt::Result<Plausibility> plausibility_of(std::span<const PlausibilityCondition> conditions) {
  if (conditions.empty())
    return rt::Error{rt::ExitCode::bad_input, "there is no condition to judge; name one at least."};
  Plausibility result;
  std::vector<Matches> matches;
  for (const PlausibilityCondition& condition : conditions) {
    auto of_condition = matches_of(condition);
    if (!of_condition) return of_condition.error();
    matches.push_back(std::move(*of_condition));
    result.shares.push_back(share_of(condition));
  }
  const auto pairs_count = static_cast<double>(conditions.size() * (conditions.size() - 1) / 2);
  for (std::size_t first = 0; first < conditions.size(); ++first)
    for (std::size_t second = first + 1; second < conditions.size(); ++second) {
      ConditionPair pair{.first = first, .second = second};
      for (const auto& [id, is_match] : matches[first]) {
        const auto partner = matches[second].find(id);
        if (partner == matches[second].end()) continue;
        ++pair.n;
        if (is_match && !partner->second) ++pair.only_first;
        if (!is_match && partner->second) ++pair.only_second;
      }
      pair.p = mcnemar_exact_p(pair.only_first, pair.only_second);
      pair.p_bonferroni = std::min(1.0, pair.p * pairs_count);
      result.pairs.push_back(pair);
    }
  return result;
}

std::string plausibility_text(const Plausibility& plausibility) {
  std::string text = "Contacts that went as the true material would have it\n  " + padded("condition", 18) +
                     "     n  as expected  share (%)   95 % interval (Wilson)\n";
  for (const ConditionShare& s : plausibility.shares) {
    std::array<char, 96> line{};
    std::snprintf(line.data(), line.size(), " %5zu  %11zu  %9.1f   %5.1f to %.1f\n", s.n, s.matches,
                  100 * s.share, 100 * s.ci95.low, 100 * s.ci95.high);
    text += "  " + padded(s.name, 18) + line.data();
  }
  if (!plausibility.pairs.empty()) text += "\nPairs on the same contacts (McNemar, exact; Bonferroni)\n";
  for (const ConditionPair& pair : plausibility.pairs) {
    const std::string &first = plausibility.shares[pair.first].name,
                      &second = plausibility.shares[pair.second].name;
    text += "  " + first + " - " + second + ": ";
    if (pair.n == 0) {
      text += "no contact is in both\n";
      continue;
    }
    const double difference = (static_cast<double>(pair.only_first) - static_cast<double>(pair.only_second)) /
                              static_cast<double>(pair.n);
    text += percent(difference) + " points; of " + std::to_string(pair.n) + ", " +
            std::to_string(pair.only_first) + " as expected in " + first + " only, " +
            std::to_string(pair.only_second) + " in " + second + " only, " + p_text(pair.p_bonferroni) + "\n";
  }
  for (const ConditionShare& s : plausibility.shares) {
    text += "\n" + s.name + ": what was expected (rows) and what came (columns)\n  " + padded("", 18);
    for (const std::string_view name : contact::kOutcomeNames)
      text += std::string(18 - name.size(), ' ') + std::string(name);
    text += "\n";
    for (std::size_t expected = 0; expected < contact::kOutcomesCount; ++expected) {
      const auto& row = s.counts[expected];
      if (std::all_of(row.begin(), row.end(), [](std::size_t count) { return count == 0; })) continue;
      text += "  " + padded(std::string(contact::kOutcomeNames[expected]), 18);
      for (const std::size_t count : row) {
        const std::string digits = std::to_string(count);
        text += std::string(18 - std::min<std::size_t>(17, digits.size()), ' ') + digits;
      }
      text += "\n";
    }
  }
  return text;
}

nlohmann::json plausibility_json(const Plausibility& plausibility) {
  nlohmann::json json = {{"conditions", nlohmann::json::array()}, {"pairs", nlohmann::json::array()}};
  for (const ConditionShare& s : plausibility.shares) {
    nlohmann::json outcomes = nlohmann::json::object();
    for (std::size_t expected = 0; expected < contact::kOutcomesCount; ++expected)
      for (std::size_t actual = 0; actual < contact::kOutcomesCount; ++actual)
        if (s.counts[expected][actual] > 0)
          outcomes[contact::kOutcomeNames[expected]][contact::kOutcomeNames[actual]] = s.counts[expected][actual];
    json["conditions"].push_back({{"name", s.name},
                                  {"n", s.n},
                                  {"as_expected", s.matches},
                                  {"share", s.share},
                                  {"ci95", {s.ci95.low, s.ci95.high}},
                                  {"outcomes", outcomes}});
  }
  for (const ConditionPair& pair : plausibility.pairs)
    json["pairs"].push_back({{"first", plausibility.shares[pair.first].name},
                             {"second", plausibility.shares[pair.second].name},
                             {"n", pair.n},
                             {"only_first", pair.only_first},
                             {"only_second", pair.only_second},
                             {"p_uncorrected", pair.p},
                             {"p", pair.p_bonferroni}});
  return json;
}

}  // namespace tactus::firmware
