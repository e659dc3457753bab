#include "rt/memory_plan.hpp"

#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace tactus::rt {
namespace {

// Appends like snprintf into what is left of `out`, and counts what it would have written.
class TextWriter {
 public:
  explicit TextWriter(std::span<char> out) : out_(out) {
    if (!out_.empty()) out_[0] = '\0';
  }

  __attribute__((format(printf, 2, 3))) void append(const char* format, ...) {
    const std::size_t used = length_ < out_.size() ? length_ : out_.size();
    va_list arguments;
    va_start(arguments, format);
    const int written = std::vsnprintf(out_.data() + used, out_.size() - used, format, arguments);
    va_end(arguments);
    TACTUS_ASSERT(written >= 0);
    length_ += static_cast<std::size_t>(written);
  }

  [[nodiscard]] std::size_t length() const { return length_; }

 private:
  std::span<char> out_;
  std::size_t length_ = 0;
};

double mebibytes(std::size_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

}  // namespace

void MemoryPlan::add(const MemoryRow& row) {
  TACTUS_ASSERT(!is_carved_);
  TACTUS_ASSERT(find(row.name) == nullptr);
  rows_.push_back(row);
  states_.push_back({});
}

std::size_t MemoryPlan::index_of(const char* name) const {
  std::size_t index = 0;
  while (index < rows_.size() && std::strcmp(rows_[index].name, name) != 0) ++index;
  return index;
}

const MemoryRow* MemoryPlan::find(const char* name) const {
  const std::size_t index = index_of(name);
  return index < rows_.size() ? &rows_[index] : nullptr;
}

std::size_t MemoryPlan::total_bytes() const {
  std::size_t sum = 0;
  for (const MemoryRow& row : rows_) sum += row.bytes();
  return sum;
}

std::size_t MemoryPlan::arena_bytes() const {
  std::size_t offset = 0;
  for (const MemoryRow& row : rows_) {
    if (!row.is_outside_arena) offset = round_up(offset, row.alignment) + row.bytes();
  }
  return offset;
}

void MemoryPlan::carve(Arena& arena) {
  TACTUS_ASSERT(!is_carved_);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_[i].is_outside_arena) states_[i].memory = arena.carve(rows_[i].bytes(), rows_[i].alignment);
  }
  is_carved_ = true;
}

Slice MemoryPlan::take(const char* name) {
  TACTUS_ASSERT(is_carved_);
  const std::size_t index = index_of(name);
  TACTUS_ASSERT(index < rows_.size() && !rows_[index].is_outside_arena);
  TACTUS_ASSERT(!states_[index].was_taken);
  states_[index].was_taken = true;
  return states_[index].memory;
}

void MemoryPlan::set_high_water(const char* name, std::size_t count) {
  const std::size_t index = index_of(name);
  TACTUS_ASSERT(index < rows_.size());
  states_[index].has_high_water = true;
  states_[index].high_water_count = count;
}

std::size_t MemoryPlan::print(std::span<char> out) const {
  TextWriter text(out);
  text.append("%-24s %10s %12s %10s %10s  %-12s %s\n", "row", "count", "bytes each", "MiB", "used", "owner",
              "count = sum of holders; why");
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const MemoryRow& row = rows_[i];
    text.append("%-24s %10zu %12zu %10.3f ", row.name, row.count(), row.bytes_each, mebibytes(row.bytes()));
    if (states_[i].has_high_water) {
      text.append("%10zu", states_[i].high_water_count);
    } else {
      text.append("%10s", "-");
    }
    text.append("  %-12s ", row.owner);
    const char* separator = "";
    for (const Holder& holder : row.holders) {
      text.append("%s%s %zu", separator, holder.name, holder.count);
      separator = " + ";
    }
    if (row.is_outside_arena) text.append(" (outside the arena, measured)");
    text.append("%s%s\n", row.why[0] != '\0' ? "; " : "", row.why);
  }
  text.append("%-24s %10s %12s %10.3f  of which in the arena %.3f\n", "total", "", "",
              mebibytes(total_bytes()), mebibytes(arena_bytes()));
  return text.length();
}

}  // namespace tactus::rt
