// The four label metrics of the paper (section 5, after Long et al. 2015) from a confusion matrix.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "pipeline/label/material.hpp"

namespace tactus::evaluate {

/// Counts of (true, predicted) materials. A prediction of unknown (255, no surface) has a column of its own:
/// it counts as a miss of the true class and as a false positive of none. Pixels whose truth is unknown are
/// not counted.
class ConfusionMatrix {
 public:
  void add(MaterialId truth, MaterialId predicted, std::uint64_t count = 1) {
    if (truth >= kMaterialCount) return;
    const std::size_t column = predicted < kMaterialCount ? predicted : kUnknownColumn;
    counts_[truth * kColumns + column] += count;
  }
  void add(const ConfusionMatrix& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  }

  /// n_ij of the paper: pixels of class i predicted to be class j.
  [[nodiscard]] std::uint64_t count(std::size_t truth, std::size_t predicted) const {
    return counts_[truth * kColumns + predicted];
  }
  [[nodiscard]] std::uint64_t unknown_count(std::size_t truth) const {
    return counts_[truth * kColumns + kUnknownColumn];
  }

 private:
  static constexpr std::size_t kColumns = kMaterialCount + 1;
  static constexpr std::size_t kUnknownColumn = kMaterialCount;
  std::array<std::uint64_t, kMaterialCount * kColumns> counts_{};
};

struct LabelMetrics {
  double pixel_accuracy = 0;         // sum_i n_ii / sum_i t_i
  double mean_accuracy = 0;          // 1/n_cl sum_i n_ii / t_i
  double mean_iu = 0;                // 1/n_cl sum_i n_ii / (t_i + sum_j n_ji - n_ii)
  double frequency_weighted_iu = 0;  // 1/sum_k t_k sum_i t_i n_ii / (t_i + sum_j n_ji - n_ii)
  double predicted_share = 0;        // pixels with a known prediction / sum_i t_i
  std::uint64_t pixels_count = 0;    // sum_i t_i
  int classes_count = 0;             // n_cl: classes with t_i > 0; the others are left out of every mean
  std::array<std::uint64_t, kMaterialCount> truth_count{};  // t_i
  std::array<double, kMaterialCount> accuracy{};            // per class; 0 where t_i = 0
  std::array<double, kMaterialCount> iu{};                  // per class; 0 where t_i = 0
};

/// All zero when no pixel was counted.
LabelMetrics label_metrics(const ConfusionMatrix& confusion);

}  // namespace tactus::evaluate
