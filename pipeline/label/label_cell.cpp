#include "pipeline/label/label_cell.hpp"

#include <algorithm>

#include "pipeline/label/cost_tables.hpp"
#include "rt/assert.hpp"

namespace tactus::label {
namespace {

constexpr int kIdBits = 5, kKeptCostBits = 9;
constexpr int kKeptCostShift = kKeptMaterials * kIdBits;                                // 20
constexpr int kOtherCostShift = kKeptCostShift + (kKeptMaterials - 1) * kKeptCostBits;  // 47
constexpr int kObservationsShift = kOtherCostShift + 10;                                // 57
static_assert(kObservationsShift + 7 == 64);
static_assert(kMaterialCount <= 1 << kIdBits);

constexpr std::uint32_t id_at(LabelWord word, int rank) {
  return static_cast<std::uint32_t>(word >> (rank * kIdBits)) & 31u;
}
constexpr std::uint32_t kept_cost(LabelWord word, int rank) {  // rank 0 is the best: cost 0
  return rank == 0 ? 0
                   : static_cast<std::uint32_t>(word >> (kKeptCostShift + (rank - 1) * kKeptCostBits)) &
                         kKeptCostMax;
}
constexpr std::uint32_t other_cost(LabelWord word) {
  return static_cast<std::uint32_t>(word >> kOtherCostShift) & kOtherCostMax;
}

struct Ranked {
  std::array<std::uint32_t, kKeptMaterials> id;
  std::array<std::uint32_t, kKeptMaterials> cost;  // relative to the best
  std::uint32_t other_cost;
};

LabelWord pack(const Ranked& ranked, std::uint32_t observations_count) {
  LabelWord word = 0;
  for (int rank = 0; rank < kKeptMaterials; ++rank)
    word |= LabelWord{ranked.id[static_cast<std::size_t>(rank)]} << (rank * kIdBits);
  for (int rank = 1; rank < kKeptMaterials; ++rank)
    word |= LabelWord{std::min(ranked.cost[static_cast<std::size_t>(rank)], kKeptCostMax)}
            << (kKeptCostShift + (rank - 1) * kKeptCostBits);
  word |= LabelWord{std::min(ranked.other_cost, kOtherCostMax)} << kOtherCostShift;
  return word | LabelWord{std::min(observations_count, kObservationsMax)} << kObservationsShift;
}

// Ranks 23 costs. A key is cost * 32 + id, so that one comparison orders by cost and then by id.
Ranked rank_costs(const std::array<std::uint32_t, kMaterialCount>& key) {
  std::uint32_t k0 = ~0u, k1 = ~0u, k2 = ~0u, k3 = ~0u, k4 = ~0u;
  for (const std::uint32_t k : key) {
    k4 = std::min(k4, std::max(k3, k));
    k3 = std::min(k3, std::max(k2, k));
    k2 = std::min(k2, std::max(k1, k));
    k1 = std::min(k1, std::max(k0, k));
    k0 = std::min(k0, k);
  }
  // -ln of the mean of exp(-cost) over the other 19, from the least of them, in Q16.
  const std::uint32_t least = k4 >> kIdBits, best_cost = k0 >> kIdBits;
  std::uint32_t sum = 0;
  for (const std::uint32_t k : key)
    if (k > k3) sum += kExpQ16[std::min<std::uint32_t>((k >> kIdBits) - least, kExpQ16.size() - 1)];
  const std::uint32_t mean_above_least = cost_of_mean(sum);
  return {{k0 & 31u, k1 & 31u, k2 & 31u, k3 & 31u},
          {0, (k1 >> kIdBits) - best_cost, (k2 >> kIdBits) - best_cost, (k3 >> kIdBits) - best_cost},
          least - best_cost + mean_above_least};
}

}  // namespace

ObservationCosts costs_of(std::span<const std::uint8_t, kMaterialCount> probability) noexcept {
  ObservationCosts costs;
  for (std::size_t i = 0; i < kMaterialCount; ++i) costs.cost[i] = kCostOfByte[probability[i]];
  return costs;
}

ObservationCosts costs_in(LabelWord word) noexcept {
  ObservationCosts costs;
  if (word == 0) return costs;
  costs.cost.fill(static_cast<std::uint16_t>(other_cost(word)));
  for (int rank = 0; rank < kKeptMaterials; ++rank)
    costs.cost[id_at(word, rank)] = static_cast<std::uint16_t>(kept_cost(word, rank));
  return costs;
}

LabelWord fuse(LabelWord prior, const ObservationCosts& observation) noexcept {
  const ObservationCosts before = costs_in(prior);
  std::array<std::uint32_t, kMaterialCount> key;
  for (std::uint32_t i = 0; i < kMaterialCount; ++i)
    key[i] = (std::uint32_t{before.cost[i]} + observation.cost[i]) << kIdBits | i;
  return pack(rank_costs(key), observations(prior) + 1u);
}

LabelWord replace(LabelWord prior, const ObservationCosts& observation) noexcept {
  std::array<std::uint32_t, kMaterialCount> key;
  for (std::uint32_t i = 0; i < kMaterialCount; ++i)
    key[i] = std::uint32_t{observation.cost[i]} << kIdBits | i;
  return pack(rank_costs(key), observations(prior) + 1u);
}

bool is_label_word(LabelWord word) noexcept {
  if (word == 0) return true;
  for (int rank = 0; rank < kKeptMaterials; ++rank) {
    if (id_at(word, rank) >= kMaterialCount) return false;
    for (int before = 0; before < rank; ++before)
      if (id_at(word, before) == id_at(word, rank)) return false;
    if (rank > 0 && kept_cost(word, rank) < kept_cost(word, rank - 1)) return false;
  }
  return observations(word) > 0;
}

void decode(LabelWord word, MaterialDistribution& distribution) noexcept {
  if (word == 0) {
    distribution.fill(1.0f / kMaterialCount);
    return;
  }
  const float scale = confidence(word);
  distribution.fill(kExp[other_cost(word)] * scale);
  for (int rank = 0; rank < kKeptMaterials; ++rank)
    distribution[id_at(word, rank)] = kExp[kept_cost(word, rank)] * scale;
}

float confidence(LabelWord word) noexcept {
  if (word == 0) return 0;
  float sum = 1.0f + kExp[kept_cost(word, 1)];
  sum += kExp[kept_cost(word, 2)];
  sum += kExp[kept_cost(word, 3)];
  sum += static_cast<float>(kOtherMaterials) * kExp[other_cost(word)];
  return 1.0f / sum;
}

LabelWord encode(const MaterialDistribution& distribution, std::uint32_t n) noexcept {
  if (n == 0) return 0;
  std::array<std::uint32_t, kMaterialCount> order;
  for (std::uint32_t i = 0; i < kMaterialCount; ++i) order[i] = i;
  std::partial_sort(order.begin(), order.begin() + kKeptMaterials, order.end(),
                    [&](std::uint32_t a, std::uint32_t b) {
                      return distribution[a] != distribution[b] ? distribution[a] > distribution[b] : a < b;
                    });
  const float most = distribution[order[0]];
  TACTUS_ASSERT(most > 0 && most <= 3e38f);
  Ranked ranked{};
  float others = 0;
  for (std::uint32_t i = 0; i < kMaterialCount; ++i) {
    bool is_kept = false;
    for (std::size_t rank = 0; rank < kKeptMaterials; ++rank) is_kept = is_kept || order[rank] == i;
    if (!is_kept) others += distribution[i] / most;
  }
  for (std::size_t rank = 0; rank < kKeptMaterials; ++rank) {
    ranked.id[rank] = order[rank];
    ranked.cost[rank] = cost_of_ratio(distribution[order[rank]] / most);
  }
  ranked.other_cost = cost_of_ratio(others / static_cast<float>(kOtherMaterials));
  return pack(ranked, n);
}

}  // namespace tactus::label
