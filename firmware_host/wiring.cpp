#include "firmware_host/wiring.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "pipeline/wiring.hpp"

namespace tactus::firmware {
namespace {

const char* name_of(const std::optional<Stage>& stage) { return stage ? budget_of(*stage).name : "anyone"; }

std::string padded(std::string_view text, std::size_t width) {
  std::string out(text);
  out.resize(std::max(width, out.size()), ' ');
  return out + "  ";
}

std::string depth_of(const WiringEdge& edge) { return edge.depth == 0 ? "-" : std::to_string(edge.depth); }

const char* when_late_of(const StageBudget& budget) {
  return budget.when_late == rt::WhenLate::skip ? "skipped when late" : "runs even when late";
}

std::string text_of_wiring() {
  std::string out = "Threads, and the stages that each runs in this order:\n";
  for (const WiringThread& thread : kWiringThreads) {
    out += "  " + padded(thread.name, 8) + padded(thread.schedule, 8) + "when " + thread.round + "\n";
    for (const StageBudget& budget : kBudgets) {
      if (std::strcmp(budget.thread, thread.name) != 0) continue;
      char numbers[64];
      std::snprintf(numbers, sizeof(numbers), "p99 %3.0f ms, max %3.0f ms", budget.p99.milliseconds(),
                    budget.max.milliseconds());
      out += "    " + padded(budget.name, 9) + padded(numbers, 24) + when_late_of(budget) + "\n";
    }
  }
  out += "\nEdges:\n  " + padded("from", 9) + padded("to", 9) + padded("type", 14) + padded("depth", 5) +
         padded("carries", 40) + "when full\n";
  for (const WiringEdge& edge : kWiringEdges)
    out += "  " + padded(name_of(edge.from), 9) + padded(name_of(edge.to), 9) + padded(edge.type, 14) +
           padded(depth_of(edge), 5) + padded(edge.carries, 40) + edge.when_full + "\n";
  return out +
         "\nA call passes its result on within the thread; depth - is a state that is read where it is.\n";
}

std::string dot_of_wiring() {
  std::string out =
      "digraph tactus {\n  rankdir=LR;\n  node [shape=box, fontname=\"sans-serif\"];\n"
      "  edge [fontname=\"sans-serif\", fontsize=10];\n";
  for (const WiringThread& thread : kWiringThreads) {
    out += "  subgraph \"cluster_" + std::string(thread.name) + "\" {\n    label=\"" + thread.name + " (" +
           thread.schedule + ")\";\n";
    for (const StageBudget& budget : kBudgets)
      if (std::strcmp(budget.thread, thread.name) == 0) out += "    \"" + std::string(budget.name) + "\";\n";
    out += "  }\n";
  }
  out += "  \"anyone\" [shape=plaintext];\n";
  for (const WiringEdge& edge : kWiringEdges) {
    const bool is_call = std::strcmp(edge.type, "call") == 0;
    out += "  \"" + std::string(name_of(edge.from)) + "\" -> \"" + name_of(edge.to) + "\" [label=\"" +
           (is_call ? "" : edge.type + (edge.depth > 0 ? " x" + depth_of(edge) : std::string()) + "\\n") +
           edge.carries + "\"" + (is_call ? ", style=dashed" : "") + "];\n";
  }
  return out + "}\n";
}

}  // namespace

rt::Result<std::string> wiring(const WiringOptions& options) {
  return options.is_dot ? dot_of_wiring() : text_of_wiring();
}

}  // namespace tactus::firmware
