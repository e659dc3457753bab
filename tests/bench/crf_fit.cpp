#include "tests/bench/crf_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "pipeline/label/crf/batch_crf.hpp"

namespace tactus::bench {
namespace {

struct PlannedMemory {
  explicit PlannedMemory(std::size_t bytes_wanted)
      : bytes(rt::round_up(bytes_wanted, rt::kCacheLineBytes)),
        data(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{rt::kCacheLineBytes}))) {}
  ~PlannedMemory() { ::operator delete (data, std::align_val_t{rt::kCacheLineBytes}); }
  PlannedMemory(const PlannedMemory&) = delete;
  PlannedMemory& operator=(const PlannedMemory&) = delete;

  std::size_t bytes;
  std::byte* data;
};

struct Tally {
  evaluate::ConfusionMatrix confusion;
  double truth_probability = 0;

  void count(const LabelledPoints& room, const std::vector<float>& marginals) {
    std::vector<MaterialId> labels(room.size());
    label::most_probable(marginals, labels);
    for (std::size_t i = 0; i < room.size(); ++i) {
      confusion.add(room.truth[i], labels[i]);
      if (room.truth[i] < kMaterialCount)
        truth_probability += static_cast<double>(marginals[i * kMaterialCount + room.truth[i]]);
    }
  }
  [[nodiscard]] CrfScore score() const {
    const evaluate::LabelMetrics metrics = evaluate::label_metrics(confusion);
    return {metrics,
            metrics.pixels_count == 0 ? 0 : truth_probability / static_cast<double>(metrics.pixels_count)};
  }
};

// Small bandwidths need more lattice than rooms usually do: first room for rooms, then for anything.
rt::Status solve(const LabelledPoints& room, const label::CrfParameters& parameters,
                 std::vector<float>& marginals) {
  rt::Status status = rt::Status::full;
  for (const auto& config :
       {label::BatchCrfConfig::for_points(room.size()), label::BatchCrfConfig::for_any_points(room.size())}) {
    if (status != rt::Status::full) break;
    const PlannedMemory memory(label::BatchCrf::bytes_needed(config));
    rt::Slice slice({memory.data, memory.bytes});
    label::BatchCrf crf;
    crf.bind(slice, config);
    status = crf.prepare(room.points(), parameters);
    if (status == rt::Status::ok) static_cast<void>(crf.solve(marginals));
  }
  return status;
}

constexpr std::array<CrfKnob, 8> kKnobs{{
    {"smoothness.weight", [](label::CrfParameters& p) -> float& { return p.smoothness.weight; }, 0.1F, 8},
    {"smoothness.theta_position_m",
     [](label::CrfParameters& p) -> float& { return p.smoothness.theta_position_m; }, 0.05F, 0.8F},
    {"appearance.weight", [](label::CrfParameters& p) -> float& { return p.appearance.weight; }, 0.1F, 8},
    {"appearance.theta_position_m",
     [](label::CrfParameters& p) -> float& { return p.appearance.theta_position_m; }, 0.14F, 0.8F},
    {"appearance.theta_color", [](label::CrfParameters& p) -> float& { return p.appearance.theta_color; }, 14,
     80},
    {"surface.weight", [](label::CrfParameters& p) -> float& { return p.surface.weight; }, 0.1F, 8},
    {"surface.theta_position_m", [](label::CrfParameters& p) -> float& { return p.surface.theta_position_m; },
     0.14F, 0.8F},
    {"surface.theta_normal", [](label::CrfParameters& p) -> float& { return p.surface.theta_normal; }, 0.4F,
     2.4F},
}};

bool is_weight(const CrfKnob& knob) { return std::string_view(knob.name).ends_with(".weight"); }

}  // namespace

CrfScore score_unary(std::span<const LabelledPoints> rooms) {
  Tally tally;
  for (const LabelledPoints& room : rooms) {
    std::vector<float> probability(room.unary_nat.size());
    for (std::size_t i = 0; i < room.size(); ++i) {
      const auto cost = std::span(room.unary_nat).subspan(i * kMaterialCount, kMaterialCount);
      const float least = *std::min_element(cost.begin(), cost.end());
      float sum = 0;
      for (std::size_t l = 0; l < kMaterialCount; ++l)
        sum += probability[i * kMaterialCount + l] = std::exp(least - cost[l]);
      for (std::size_t l = 0; l < kMaterialCount; ++l) probability[i * kMaterialCount + l] /= sum;
    }
    tally.count(room, probability);
  }
  return tally.score();
}

rt::Result<CrfScore> score_crf(std::span<const LabelledPoints> rooms,
                               const label::CrfParameters& parameters) {
  Tally tally;
  for (std::size_t r = 0; r < rooms.size(); ++r) {
    std::vector<float> marginals(rooms[r].unary_nat.size());
    const rt::Status status = solve(rooms[r], parameters, marginals);
    if (status != rt::Status::ok)
      return rt::Error{rt::ExitCode::bad_input,
                       "room " + std::to_string(r) + ": the CRF answers " + rt::name(status)};
    tally.count(rooms[r], marginals);
  }
  return tally.score();
}

std::span<const CrfKnob> crf_knobs() { return kKnobs; }

rt::Result<std::vector<SweepRow>> sweep(std::span<const LabelledPoints> rooms,
                                        const label::CrfParameters& base, std::span<const float> factors,
                                        const std::function<void(const SweepRow&)>& report) {
  std::vector<SweepRow> rows;
  for (const CrfKnob& knob : kKnobs)
    for (const float factor : factors) {
      label::CrfParameters parameters = base;
      float& value = knob.value(parameters);
      value = factor * (value == 0 ? 1 : value);  // a kernel that was left out comes back
      if (!is_valid(parameters)) continue;
      const auto score = score_crf(rooms, parameters);
      if (!score) return score.error();
      rows.push_back({knob.name, knob.value(parameters), *score});
      report(rows.back());
    }
  return rows;
}

double fit_objective(const CrfScore& score) {
  const evaluate::LabelMetrics& m = score.metrics;
  return (m.pixel_accuracy + m.mean_accuracy + m.mean_iu + m.frequency_weighted_iu) / 4 +
         1e-2 * score.mean_truth_probability;
}

rt::Result<label::CrfParameters> fit(std::span<const LabelledPoints> rooms, const label::CrfParameters& base,
                                     int rounds_max, const std::function<void(const SweepRow&)>& report) {
  label::CrfParameters best = base;
  const auto start = score_crf(rooms, best);
  if (!start) return start.error();
  double best_objective = fit_objective(*start);
  constexpr std::array<float, 3> kSteps{2.0F, 1.4142135F, 1.1892071F};
  std::size_t step = 0;
  for (int round = 0; round < rounds_max && step < kSteps.size(); ++round) {
    bool has_gained = false;
    for (const CrfKnob& knob : kKnobs) {
      const auto has_improved = [&](float candidate) -> rt::Result<bool> {
        label::CrfParameters trial = best;
        const float current = knob.value(trial);
        if (candidate != 0 && ((candidate < knob.least && candidate < current) ||
                               (candidate > knob.most && candidate > current)))
          return false;
        knob.value(trial) = candidate;
        if (!is_valid(trial)) return false;
        const auto score = score_crf(rooms, trial);
        if (!score) return score.error();
        if (fit_objective(*score) <= best_objective) return false;
        best = trial;
        best_objective = fit_objective(*score);
        has_gained = true;
        report({knob.name, candidate, *score});
        return true;
      };
      if (is_weight(knob)) {
        const auto other = has_improved(knob.value(best) == 0 ? 0.1F : 0);
        if (!other) return other.error();
      }
      for (const float factor : {kSteps[step], 1 / kSteps[step]}) {
        bool goes_on = knob.value(best) != 0, has_moved = false;
        while (goes_on) {
          const auto improved = has_improved(knob.value(best) * factor);
          if (!improved) return improved.error();
          goes_on = *improved;
          has_moved = has_moved || goes_on;
        }
        if (has_moved) break;
      }
    }
    if (!has_gained) ++step;
  }
  return best;
}

}  // namespace tactus::bench
