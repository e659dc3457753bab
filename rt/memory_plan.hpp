// The memory table: what is planned, how much, for whom and why that count.
#pragma once

#include <cstddef>
#include <span>

#include "rt/arena.hpp"
#include "rt/slice.hpp"
#include "rt/static_vector.hpp"

namespace tactus::rt {

/// One addend of a row's count: who holds how many at the worst moment.
struct Holder {
  const char* name = "";
  std::size_t count = 0;
};

/// One row. The count is never a bare number: it is the sum of what each holder needs at once.
struct MemoryRow {
  const char* name = "";
  StaticVector<Holder, 8> holders;
  std::size_t bytes_each = 0;
  std::size_t alignment = kCacheLineBytes;
  const char* owner = "";  ///< the component that binds it
  const char* why = "";    ///< the sum behind bytes_each or the counts, in words
  /// A guest that cannot be fenced in (EGL drivers): measured and counted, not carved from the arena.
  bool is_outside_arena = false;

  [[nodiscard]] constexpr std::size_t count() const {
    std::size_t sum = 0;
    for (const Holder& holder : holders) sum += holder.count;
    return sum;
  }
  /// Whole cache lines, so that rows never share one.
  [[nodiscard]] constexpr std::size_t bytes() const {
    return round_up(count() * bytes_each, kCacheLineBytes);
  }
};

/// The whole table, in carving order. Boot only, one thread; names are string literals.
class MemoryPlan {
 public:
  static constexpr std::size_t kRowsMax = 64;

  /// Asserts that the name is new.
  void add(const MemoryRow& row);

  [[nodiscard]] std::span<const MemoryRow> rows() const { return rows_.span(); }
  [[nodiscard]] const MemoryRow* find(const char* name) const;
  /// Everything, guests outside the arena included.
  [[nodiscard]] std::size_t total_bytes() const;
  /// What Arena::reserve() must be asked for: rows inside the arena with their alignment padding.
  [[nodiscard]] std::size_t arena_bytes() const;

  /// Carves every row in table order; once.
  void carve(Arena& arena);
  /// The row's memory, after carve(). Asserts that the row exists and was not taken before.
  Slice take(const char* name);

  /// What was really used of a row, for the table at exit; answers of the owner's own high-water counter.
  void set_high_water(const char* name, std::size_t count);

  /// Writes the table as text, always terminated, cut when `out` is too small. Returns the characters it
  /// needs without the terminator, as snprintf does; `out` may be empty to ask.
  std::size_t print(std::span<char> out) const;

 private:
  struct RowState {
    Slice memory;
    bool was_taken = false;
    bool has_high_water = false;
    std::size_t high_water_count = 0;
  };
  [[nodiscard]] std::size_t index_of(const char* name) const;

  StaticVector<MemoryRow, kRowsMax> rows_;
  StaticVector<RowState, kRowsMax> states_;
  bool is_carved_ = false;
};

}  // namespace tactus::rt
