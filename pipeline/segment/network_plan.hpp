// Which operators of a model run, and where each of their tensors lies in memory: decided once, at boot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/segment/tflite_model.hpp"
#include "rt/status.hpp"

namespace tactus::segment {

/// score coordinate = scale * input coordinate + offset, in pixels with integers at pixel centres.
struct AxisMap {
  float scale = 1;
  float offset = 0;
  friend bool operator==(const AxisMap&, const AxisMap&) = default;
};

/// Where a tensor lies. A tensor that only feeds a concatenation is computed in place among the channels of
/// the joined tensor, so that the concatenation (which XNNPACK lacks for 8 bits) costs nothing and is exact.
struct Placement {
  std::int32_t block = -1;       // -1: this tensor is not needed
  std::size_t offset_bytes = 0;  // from the start of the block
  std::size_t pixel_stride = 0;  // elements from one pixel to the next; >= channels
};

/// A piece of the tensor memory, in use from operator `first_use` to `last_use` (positions in `operators`;
/// -1: before the first, that is the input and constants). Blocks whose uses do not overlap share memory.
struct Block {
  std::size_t bytes = 0;
  std::int32_t first_use = 0;
  std::int32_t last_use = 0;
  std::size_t offset_bytes = 0;
};

struct NetworkPlan {
  std::int32_t input = -1;  // tensor indices
  std::int32_t scores = -1;
  AxisMap score_rows, score_columns;    // from input pixels to score pixels, as the cut operators had it
  std::vector<std::int32_t> operators;  // indices into Model::operators, in running order
  std::vector<Placement> placements;    // per tensor of the model
  std::vector<Block> blocks;
  std::size_t tensor_bytes = 0;         // of all blocks together
  std::size_t operators_cut_count = 0;  // at the end, and others that do not lead to the scores
};

/// XNNPACK may read (never write) up to 16 bytes beyond a tensor.
inline constexpr std::size_t kTensorSlackBytes = 64;

/// Cuts the model before its last resize, argmax, cast, softmax and (de)quantisation, so that it gives class
/// scores at the resolution where they are computed; drops operators that do not lead there; places tensors
/// first-fit by falling size. Error (bad_input): the model has not one image input and one chain of scores,
/// or needs an operator that is unknown. Phase: boot. Pure.
rt::Result<NetworkPlan> plan_network(const Model& model);

}  // namespace tactus::segment
