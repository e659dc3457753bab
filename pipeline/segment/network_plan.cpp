#include "pipeline/segment/network_plan.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "rt/slice.hpp"

namespace tactus::segment {
namespace {

std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// What the resize does to one axis: source = scale * destination + offset (TensorFlow's three conventions).
AxisMap resize_axis(const Operator& op, std::int32_t source, std::int32_t destination) {
  if (op.align_corners && destination > 1)
    return {static_cast<float>(source - 1) / static_cast<float>(destination - 1), 0};
  const float ratio = static_cast<float>(source) / static_cast<float>(destination);
  return {ratio, op.half_pixel_centers ? 0.5F * ratio - 0.5F : 0.0F};
}

AxisMap half_pixel_axis(std::int32_t source, std::int32_t destination) {
  const float ratio = static_cast<float>(source) / static_cast<float>(destination);
  return {ratio, 0.5F * ratio - 0.5F};
}

AxisMap after(const AxisMap& outer, const AxisMap& inner) {
  return {outer.scale * inner.scale, outer.scale * inner.offset + outer.offset};
}

/// Inputs that carry activations (as opposed to filters, biases, sizes, axes).
std::size_t activation_inputs_count(const Operator& op) {
  switch (op.kind) {
    case OperatorKind::add:
    case OperatorKind::mul:
      return 2;
    case OperatorKind::concatenation:
      return op.inputs.size();
    default:
      return 1;
  }
}

/// Operators whose pixels may lie apart, on both sides: all but those that XNNPACK or we treat as one dense
/// run.
bool can_stride(OperatorKind kind) {
  return kind != OperatorKind::add && kind != OperatorKind::mul && kind != OperatorKind::reshape;
}

bool same_quantization(const Tensor& a, const Tensor& b) {
  return a.type == b.type && a.scale() == b.scale() && a.zero_point() == b.zero_point();
}

class Planner {
 public:
  explicit Planner(const Model& model)
      : model_(model), producer_(model.tensors.size(), -1), users_(model.tensors.size()) {}

  rt::Result<NetworkPlan> plan() {
    for (std::size_t i = 0; i < model_.operators.size(); ++i)
      for (const std::int32_t output : model_.operators[i].outputs)
        producer_[at(output)] = static_cast<std::int32_t>(i);
    if (model_.inputs.size() != 1)
      return bad("has " + std::to_string(model_.inputs.size()) + " inputs, expected one image");
    plan_.input = model_.inputs[0];
    const Tensor& image = model_.tensors[at(plan_.input)];
    if (image.rank != 4 || image.shape.dims[0] != 1 || image.shape.channels() != 3)
      return bad("its input '" + image.name + "' is not one image of 3 channels (1 x height x width x 3)");
    cut();
    if (std::string what = choose_operators(); !what.empty()) return bad(what);
    if (std::string what = place_tensors(); !what.empty()) return bad(what);
    place_blocks();
    return std::move(plan_);
  }

 private:
  rt::Error bad(const std::string& what) const {
    return {rt::ExitCode::bad_input, model_.file + ": " + what};
  }
  const Shape& shape(std::int32_t tensor) const { return model_.tensors[at(tensor)].shape; }

  void cut() {
    std::int32_t tensor = model_.outputs[0];
    AxisMap rows, columns;
    bool resized = false;
    for (std::int32_t producer = producer_[at(tensor)]; producer >= 0; producer = producer_[at(tensor)]) {
      const Operator& op = model_.operators[at(producer)];
      const bool after_scores = op.kind == OperatorKind::arg_max || op.kind == OperatorKind::cast ||
                                op.kind == OperatorKind::softmax || op.kind == OperatorKind::dequantize ||
                                op.kind == OperatorKind::quantize || op.kind == OperatorKind::resize_bilinear;
      if (!after_scores || op.inputs.empty() || op.inputs[0] < 0 ||
          model_.tensors[at(op.inputs[0])].is_constant())
        break;
      if (op.kind == OperatorKind::resize_bilinear) {
        if (!resized) {
          rows = half_pixel_axis(shape(tensor).height(), shape(plan_.input).height());
          columns = half_pixel_axis(shape(tensor).width(), shape(plan_.input).width());
          resized = true;
        }
        rows = after(resize_axis(op, shape(op.inputs[0]).height(), shape(tensor).height()), rows);
        columns = after(resize_axis(op, shape(op.inputs[0]).width(), shape(tensor).width()), columns);
      }
      tensor = op.inputs[0];
    }
    if (!resized) {
      rows = half_pixel_axis(shape(tensor).height(), shape(plan_.input).height());
      columns = half_pixel_axis(shape(tensor).width(), shape(plan_.input).width());
    }
    plan_.scores = tensor;
    plan_.score_rows = rows;
    plan_.score_columns = columns;
  }

  std::string choose_operators() {
    if (producer_[at(plan_.scores)] < 0) return "nothing is computed between its input and its scores";
    std::vector<bool> needed(model_.operators.size(), false);
    std::vector<std::int32_t> open = {producer_[at(plan_.scores)]};
    while (!open.empty()) {
      const std::int32_t i = open.back();
      open.pop_back();
      if (needed[at(i)]) continue;
      needed[at(i)] = true;
      const Operator& op = model_.operators[at(i)];
      if (op.kind == OperatorKind::other)
        return "operator " + std::to_string(i) + " has builtin code " + std::to_string(op.builtin_code) +
               ", which this program cannot run";
      for (std::size_t k = 0; k < activation_inputs_count(op); ++k)
        if (producer_[at(op.inputs[k])] >= 0) open.push_back(producer_[at(op.inputs[k])]);
    }
    for (std::size_t i = 0; i < needed.size(); ++i)
      if (needed[i]) plan_.operators.push_back(static_cast<std::int32_t>(i));
    plan_.operators_cut_count = model_.operators.size() - plan_.operators.size();
    for (const std::int32_t i : plan_.operators) {
      const Operator& op = model_.operators[at(i)];
      for (std::size_t k = 0; k < activation_inputs_count(op); ++k) users_[at(op.inputs[k])].push_back(i);
    }
    if (users_[at(plan_.input)].empty()) return "its scores do not depend on its input";
    return {};
  }

  /// The concatenation among whose channels the tensor can be computed in place, or -1.
  std::int32_t home_of(std::int32_t tensor) const {
    const std::int32_t producer = producer_[at(tensor)];
    if (tensor == plan_.scores || producer < 0 || !can_stride(model_.operators[at(producer)].kind)) return -1;
    // The result of a concatenation is the home of others; homes are not nested.
    if (model_.operators[at(producer)].kind == OperatorKind::concatenation) return -1;
    std::int32_t home = -1;
    for (const std::int32_t user : users_[at(tensor)]) {
      const Operator& op = model_.operators[at(user)];
      if (!can_stride(op.kind)) return -1;
      if (op.kind != OperatorKind::concatenation) continue;
      if (home >= 0) return -1;  // twice in one, or in two
      if (!same_quantization(model_.tensors[at(tensor)], model_.tensors[at(op.outputs[0])])) return -1;
      home = user;
    }
    return home;
  }

  std::string place_tensors() {
    plan_.placements.resize(model_.tensors.size());
    const auto new_block = [&](std::int32_t tensor, std::int32_t first_use) {
      const Tensor& t = model_.tensors[at(tensor)];
      plan_.placements[at(tensor)] = {static_cast<std::int32_t>(plan_.blocks.size()), 0,
                                      static_cast<std::size_t>(t.shape.channels())};
      const std::size_t bytes = t.shape.elements_count() * bytes_per_element(t.type);
      plan_.blocks.push_back(
          {rt::round_up(bytes + kTensorSlackBytes, rt::kCacheLineBytes), first_use, first_use, 0});
    };
    new_block(plan_.input, -1);
    for (std::size_t position = 0; position < plan_.operators.size(); ++position) {
      const std::int32_t now = static_cast<std::int32_t>(position);
      const Operator& op = model_.operators[at(plan_.operators[position])];
      const std::int32_t output = op.outputs[0];
      for (std::size_t k = 0; k < activation_inputs_count(op); ++k)
        if (plan_.placements[at(op.inputs[k])].block < 0) new_block(op.inputs[k], -1);  // a constant
      for (const std::int32_t tensor : {op.inputs[0], output})
        if (model_.tensors[at(tensor)].type == ElementType::other || shape(tensor).dims[0] != 1)
          return "operator " + std::to_string(plan_.operators[position]) + " (" + name(op.kind) +
                 "): tensor '" + model_.tensors[at(tensor)].name +
                 "' has an element type or batch size that this program cannot run";
      if (plan_.placements[at(output)].block < 0) {
        if (op.kind == OperatorKind::reshape) {
          plan_.placements[at(output)] = plan_.placements[at(op.inputs[0])];
          plan_.placements[at(output)].pixel_stride = static_cast<std::size_t>(shape(output).channels());
        } else if (const std::int32_t home = home_of(output); home >= 0) {
          place_in_home(output, model_.operators[at(home)], now, new_block);
        } else {
          new_block(output, now);
        }
      }
      for (std::size_t k = 0; k < activation_inputs_count(op); ++k) touch(op.inputs[k], now);
      touch(output, now);
    }
    const std::int32_t end = static_cast<std::int32_t>(plan_.operators.size());
    touch(plan_.scores, end);
    // Constants are written once, at boot, so that they keep their memory; the input is written anew for
    // every image.
    for (std::size_t i = 0; i < model_.tensors.size(); ++i)
      if (model_.tensors[i].is_constant()) touch(static_cast<std::int32_t>(i), end);
    return {};
  }

  template <typename NewBlock>
  void place_in_home(std::int32_t tensor, const Operator& concat, std::int32_t now,
                     const NewBlock& new_block) {
    const std::int32_t joined = concat.outputs[0];
    if (plan_.placements[at(joined)].block < 0) new_block(joined, now);
    std::size_t channels_before = 0;
    for (const std::int32_t part : concat.inputs) {
      if (part == tensor) break;
      channels_before += static_cast<std::size_t>(shape(part).channels());
    }
    Placement placement = plan_.placements[at(joined)];
    placement.offset_bytes += channels_before * bytes_per_element(model_.tensors[at(tensor)].type);
    plan_.placements[at(tensor)] = placement;
  }

  void touch(std::int32_t tensor, std::int32_t now) {
    const std::int32_t block = plan_.placements[at(tensor)].block;
    if (block >= 0) plan_.blocks[at(block)].last_use = std::max(plan_.blocks[at(block)].last_use, now);
  }

  /// Greedy by size: the largest block first, each at the lowest offset where nothing that lives with it
  /// lies.
  void place_blocks() {
    std::vector<std::size_t> order(plan_.blocks.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return plan_.blocks[a].bytes > plan_.blocks[b].bytes;
    });
    std::vector<std::size_t> placed;  // by rising offset
    for (const std::size_t i : order) {
      Block& block = plan_.blocks[i];
      std::size_t offset = 0;
      for (const std::size_t j : placed) {
        const Block& other = plan_.blocks[j];
        if (other.last_use < block.first_use || block.last_use < other.first_use) continue;
        if (offset + block.bytes <= other.offset_bytes) break;
        offset = std::max(offset, other.offset_bytes + other.bytes);
      }
      block.offset_bytes = offset;
      placed.insert(std::upper_bound(placed.begin(), placed.end(), i,
                                     [&](std::size_t a, std::size_t b) {
                                       return plan_.blocks[a].offset_bytes < plan_.blocks[b].offset_bytes;
                                     }),
                    i);
      plan_.tensor_bytes = std::max(plan_.tensor_bytes, offset + block.bytes);
    }
  }

  const Model& model_;
  std::vector<std::int32_t> producer_;            // operator that computes a tensor, or -1
  std::vector<std::vector<std::int32_t>> users_;  // needed operators that read a tensor
  NetworkPlan plan_;
};

}  // namespace

rt::Result<NetworkPlan> plan_network(const Model& model) { return Planner(model).plan(); }

}  // namespace tactus::segment
