// A neural network that runs inside fixed memory: XNNPACK operators, one thread, no heap.
//
// The operators are created one by one (not through XNNPACK's subgraph, which plans its own memory and has no
// 8-bit concatenation): tensors lie where network_plan says, XNNPACK's own blocks in an XnnPool behind them.
//
//   float32            conv, depthwise, fully connected, add, mul, pools, mean, resize, relu(6), logistic,
//   hard swish int8 (QC8, QS8)    the same, weights per channel or per tensor; + quantize uint8 (QU8) the
//   same, weights per tensor
//
// Same result on every machine? int8 with int8 weights: yes. Convolutions add up in int32, exactly, and the
// one rounding at the end is float multiply, clamp, round to nearest even in XNNPACK's QC8 kernels (x86:
// cvtps2dq, arm64: fcvtns); tests compare it bit by bit with an integer reference on x86-64 (AVX-512) and
// arm64 (NEON, emulated), and the ADE20K network gave the same 524,288 scores for a photograph on both.
// Tables, pools and means are ours, in integers. uint8 networks: no, the NEON kernels of QU8 round by fixed
// point and differ by a step now and then. float32 networks: no, kernels use FMA where the processor has it
// and sum in the order of their tiles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/segment/network_plan.hpp"
#include "pipeline/segment/tflite_model.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::segment {

/// One end of a network: a dense tensor in its memory.
struct TensorView {
  std::span<std::byte> bytes;  // height x width x channels elements
  ElementType type = ElementType::other;
  Shape shape;
  float scale = 1;  // 8-bit: real = scale * (q - zero_point)
  std::int32_t zero_point = 0;
};

struct NetworkUse {
  std::size_t tensor_bytes = 0;  // inputs, results in between, scores; packed by life time
  std::size_t pool_bytes = 0;    // XNNPACK: packed weights, indirection tables, operators
  std::size_t own_bytes = 0;     // list of steps, tables
  std::size_t operators_count = 0;
  std::size_t operators_cut_count = 0;
};

/// A stage's engine, see segmenter.hpp for the stage. Thread-bound: one thread calls invoke().
class Network {
 public:
  /// Bytes that bind() needs on this machine (packed weights depend on its SIMD width): found by building the
  /// network once in borrowed memory. Error: as bind(). Phase: boot.
  static rt::Result<std::size_t> bytes_needed(const Model& model);

  /// Builds the network in `memory`, all of it. The model is not needed afterwards. Error (bad_input): an
  /// operator, type or quantisation that cannot run, by file and operator; (bad_usage): the memory is too
  /// small. Phase: boot. The networks of a process share nothing but XNNPACK's kernels.
  static rt::Result<Network> bind(const Model& model, rt::Slice memory);

  /// The image to fill before invoke(). Overwritten by it: fill it every time.
  [[nodiscard]] const TensorView& input() const { return input_; }
  /// The class scores that the last invoke() left.
  [[nodiscard]] const TensorView& scores() const { return scores_; }
  [[nodiscard]] AxisMap score_rows() const { return score_rows_; }
  [[nodiscard]] AxisMap score_columns() const { return score_columns_; }
  [[nodiscard]] const NetworkUse& use() const { return use_; }

  /// Runs the network. Phase: step. No heap, no lock; work is the same for every image. ok, or corrupt when
  /// XNNPACK reports an error (which it has no reason to, once set up).
  rt::Status invoke() noexcept;

  struct Step;  // one operator: XNNPACK's or ours

 private:
  Network() = default;

  std::span<Step> steps_;
  TensorView input_, scores_;
  AxisMap score_rows_, score_columns_;
  NetworkUse use_;
};

}  // namespace tactus::segment
