#include "pipeline/evaluate/labels.hpp"

namespace tactus::evaluate {

LabelMetrics label_metrics(const ConfusionMatrix& confusion) {
  LabelMetrics m;
  std::uint64_t correct_count = 0, known_count = 0;
  for (std::size_t i = 0; i < kMaterialCount; ++i) {
    std::uint64_t row = 0, column = 0;
    for (std::size_t j = 0; j < kMaterialCount; ++j) {
      row += confusion.count(i, j);
      column += confusion.count(j, i);
    }
    const std::uint64_t t = row + confusion.unknown_count(i);
    m.truth_count[i] = t;
    if (t == 0) continue;
    const std::uint64_t n_ii = confusion.count(i, i);
    m.accuracy[i] = static_cast<double>(n_ii) / static_cast<double>(t);
    m.iu[i] = static_cast<double>(n_ii) / static_cast<double>(t + column - n_ii);
    m.mean_accuracy += m.accuracy[i];
    m.mean_iu += m.iu[i];
    m.frequency_weighted_iu += static_cast<double>(t) * m.iu[i];
    m.pixels_count += t;
    correct_count += n_ii;
    known_count += row;
    ++m.classes_count;
  }
  if (m.classes_count == 0) return m;
  const auto pixels = static_cast<double>(m.pixels_count);
  m.mean_accuracy /= m.classes_count;
  m.mean_iu /= m.classes_count;
  m.frequency_weighted_iu /= pixels;
  m.pixel_accuracy = static_cast<double>(correct_count) / pixels;
  m.predicted_share = static_cast<double>(known_count) / pixels;
  return m;
}

}  // namespace tactus::evaluate
