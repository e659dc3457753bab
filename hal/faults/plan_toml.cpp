// parse_faults alone: the one file here that knows the TOML library.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "hal/faults/faults.hpp"
#include "hal/toml/toml_text.hpp"

namespace tactus::hal::faults {
namespace {

constexpr std::size_t kFaultsMax = 64;
constexpr double kDelayMsMax = 60'000;         // a minute late is another session
constexpr double kJumpMsMax = 31'536'000'000;  // a year, as when a clock is set for the first time
constexpr std::int64_t kFramesMax = 1'000'000'000;

std::string number_text(double value) {
  const std::string text = std::to_string(value);
  const auto last = text.find_last_not_of('0');
  return text.substr(0, text[last] == '.' ? last : last + 1);
}

rt::Duration from_ms(double ms) { return {static_cast<std::int64_t>(std::llround(ms * 1e6))}; }

/// Reads keys out of one table and keeps the first complaint.
class TableReader {
 public:
  TableReader(const toml::table& table, const std::string& file) : table_(table), file_(file) {}

  [[nodiscard]] const std::optional<rt::Error>& error() const { return error_; }
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  void refuse_other_keys(std::initializer_list<std::string_view> known, const std::string& where) {
    for (const auto& [key, node] : table_)
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        complain(node, "'" + std::string(key.str()) + "' is no key of " + where);
  }

  /// Leaves `out` alone where the key is absent.
  void whole(std::string_view key, std::int64_t low, std::uint64_t& out) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return;
    const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
    if (!value || *value < low || *value > kFramesMax)
      return complain(*node, std::string(key) + " must be a whole number from " + std::to_string(low) + " to " +
                                 std::to_string(kFramesMax));
    out = static_cast<std::uint64_t>(*value);
  }

  void number(std::string_view key, double low, double high, double& out) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return;
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high))
      return complain(*node, std::string(key) + " must be a number from " + number_text(low) + " to " +
                                 number_text(high));
    out = *value;
  }

  void duration(std::string_view key, double low_ms, double high_ms, rt::Duration& out) {
    double ms = 0;
    number(key, low_ms, high_ms, ms);
    if (has(key)) out = from_ms(ms);
  }

  /// Which of the names; `out` stays where the key is absent.
  template <typename Names>
  void choice(std::string_view key, const Names& names, std::size_t& out) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return;
    const auto value = node->value<std::string_view>();
    const auto found = value ? std::find(std::begin(names), std::end(names), *value) : std::end(names);
    if (found == std::end(names)) {
      std::string list;
      for (const std::string_view name : names) list += (list.empty() ? "" : ", ") + std::string(name);
      return complain(*node, std::string(key) + " must be one of " + list);
    }
    out = static_cast<std::size_t>(found - std::begin(names));
  }

  void complain(const toml::node& at, const std::string& what) {
    if (error_) return;
    error_ = rt::Error{rt::ExitCode::bad_usage, file_ + ":" + std::to_string(at.source().begin.line) + ": " + what + "."};
  }
  void complain(const std::string& what) { complain(table_, what); }

 private:
  const toml::table& table_;
  const std::string& file_;
  std::optional<rt::Error> error_;
};

/// Keys that belong to some kinds only.
void read_numbers_of_kind(TableReader& reader, Fault& fault) {
  using enum FaultKind;
  const auto belongs = [&](std::string_view key, bool does) {
    if (reader.has(key) && !does)
      reader.complain(std::string(key) + " says nothing to a fault of kind " +
                      std::string(kFaultNames[static_cast<std::size_t>(fault.kind)]));
  };
  const bool is_slow = fault.kind == late || fault.kind == slow_consumer;
  belongs("delay_ms", is_slow);
  belongs("jump_ms", fault.kind == clock_jump);
  belongs("share", fault.kind == corrupt_bytes);
  belongs("away_frames", fault.kind == unplug);
  belongs("away_ms", fault.kind == unplug);

  reader.duration("delay_ms", 0.001, kDelayMsMax, fault.delay);
  if (is_slow && !reader.has("delay_ms")) reader.complain("delay_ms is missing");
  reader.duration("jump_ms", -kJumpMsMax, kJumpMsMax, fault.jump);
  if (fault.kind == clock_jump && fault.jump.ns == 0) reader.complain("jump_ms is missing, or 0");
  reader.number("share", 0, 1, fault.share);
  reader.whole("away_frames", 1, fault.away_frames);
  reader.duration("away_ms", 0.001, kJumpMsMax, fault.away);
  if (fault.kind == unplug && reader.has("away_frames") == reader.has("away_ms"))
    reader.complain("one of away_frames and away_ms says for how long it is away");
}

rt::Result<Fault> read_fault(const toml::table& table, const std::string& file) {
  Fault fault;
  TableReader reader(table, file);
  reader.refuse_other_keys({"kind", "stream", "first", "count", "every", "probability", "delay_ms", "jump_ms", "share",
                            "away_frames", "away_ms"},
                           "[[fault]]");
  std::size_t kind = 0, stream = 2;
  if (!reader.has("kind")) reader.complain("kind is missing");
  reader.choice("kind", kFaultNames, kind);
  fault.kind = static_cast<FaultKind>(kind);
  constexpr std::string_view kStreams[] = {"depth", "color", "both"};
  reader.choice("stream", kStreams, stream);
  fault.hits_depth = stream != 1;
  fault.hits_color = stream != 0;
  if (fault.kind == FaultKind::color_without_depth) {
    if (stream == 1) reader.complain("color_without_depth is a fault of the depth stream");
    fault.hits_color = false;
  }

  reader.whole("every", 1, fault.every);
  if (reader.has("every")) fault.first = fault.every;
  reader.whole("first", 0, fault.first);
  if (!reader.has("every") && !reader.has("probability")) {
    if (!reader.has("first")) reader.complain("first, every or probability says which frames are hit");
    fault.count = 1;
  }
  reader.whole("count", 1, fault.count);
  reader.number("probability", 0, 1, fault.probability);
  read_numbers_of_kind(reader, fault);
  if (reader.error()) return *reader.error();
  return fault;
}

}  // namespace

rt::Result<FaultPlan> parse_faults(std::string_view text, const std::string& file) {
  const auto root = parse_toml(text, file, rt::ExitCode::bad_usage);
  if (!root) return root.error();
  FaultPlan plan;
  TableReader reader(*root, file);
  reader.refuse_other_keys({"seed", "fault"}, "a file of faults; it holds seed and tables [[fault]]");
  reader.whole("seed", 0, plan.seed);
  const toml::node* faults = root->get("fault");
  const toml::array* list = faults != nullptr ? faults->as_array() : nullptr;
  if (faults != nullptr && (list == nullptr || list->size() > kFaultsMax || !list->is_homogeneous<toml::table>()))
    reader.complain(*faults, "fault must be 1 to " + std::to_string(kFaultsMax) + " tables [[fault]]");
  if (reader.error()) return *reader.error();
  if (list == nullptr) return plan;
  for (const toml::node& node : *list) {
    auto fault = read_fault(*node.as_table(), file);
    if (!fault) return fault.error();
    plan.faults.push_back(*fault);
  }
  return plan;
}

rt::Result<FaultPlan> load_faults(const std::string& file) {
  const auto text = read_settings_file(file, "file of faults");
  if (!text) return text.error();
  return parse_faults(*text, file);
}

}  // namespace tactus::hal::faults
