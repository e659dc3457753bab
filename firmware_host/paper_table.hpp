// The accuracy table that the paper prints (sec. V-A), for setting ours beside it.
#pragma once

#include <array>

#include "firmware_host/label_methods.hpp"

namespace tactus::firmware {

struct PaperRow {
  LabelMethod method;  // ours of the same kind
  const char* name;
  std::array<double, 4> percent;  // pixel accuracy, mean accuracy, mean IU, frequency-weighted IU
};

/// Chen et al. 2018: 25 key-frames of a real office and bedroom, their network, their manual labels. Another
/// set than any of ours: what compares are the order of the methods and the steps between them.
inline constexpr std::array<PaperRow, 4> kPaperTable = {
    {{LabelMethod::net, "FCN", {81.61, 63.69, 49.54, 76.16}},
     {LabelMethod::net_crf2d, "CRF-RNN", {85.68, 51.73, 41.32, 79.76}},
     {LabelMethod::fused, "Ours_noCRF", {87.86, 70.69, 54.81, 81.86}},
     {LabelMethod::fused_crf3d, "Ours", {89.42, 72.06, 56.32, 84.30}}}};

}  // namespace tactus::firmware
