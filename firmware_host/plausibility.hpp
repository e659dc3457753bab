// How often virtual things do what the true material would make them do, and whether that differs between
// ways of collision: the statistics of `study plausibility`. Counts in, plain numbers out. Host only; no
// state; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "pipeline/contact/fracture.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct JudgedContact {
  std::uint64_t id = 0;  // the same for the same contact of the same throw in every condition
  contact::Outcome expected = contact::Outcome::through;  // by the true material
  contact::Outcome actual = contact::Outcome::through;
};

struct PlausibilityCondition {
  std::string name;
  std::vector<JudgedContact> contacts;  // any order
};

struct Interval {
  double low = 0, high = 0;
};
/// 95 % interval of a share (Wilson 1927, without correction for continuity). n >= 1, successes <= n.
[[nodiscard]] Interval wilson95(std::size_t successes, std::size_t n);

/// Two-sided exact test of McNemar (1947): twice the smaller binomial tail of the pairs that differ, 1 at
/// most. only_first: as expected in the first condition and not in the second.
[[nodiscard]] double mcnemar_exact_p(std::size_t only_first, std::size_t only_second);

struct ConditionShare {
  std::string name;
  std::size_t n = 0, matches = 0;
  double share = 0;
  Interval ci95;
  std::array<std::array<std::size_t, contact::kOutcomesCount>, contact::kOutcomesCount> counts{};  // [expected][actual]
};

struct ConditionPair {
  std::size_t first = 0, second = 0;                   // of the shares
  std::size_t n = 0, only_first = 0, only_second = 0;  // n: contacts that both have
  double p = 1, p_bonferroni = 1;
};

struct Plausibility {
  std::vector<ConditionShare> shares;  // in the order given
  std::vector<ConditionPair> pairs;    // every two, in that order
};

/// bad_input when a condition has no contact or one twice, or there is no condition.
rt::Result<Plausibility> plausibility_of(std::span<const PlausibilityCondition> conditions);

/// Shares, pairs, and per condition what came of what was expected; and the same figures as JSON.
[[nodiscard]] std::string plausibility_text(const Plausibility& plausibility);
[[nodiscard]] nlohmann::json plausibility_json(const Plausibility& plausibility);

}  // namespace tactus::firmware
