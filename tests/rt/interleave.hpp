// Explores every interleaving of two threads over a lock-free type, at the granularity of each atomic access,
// and under each interleaving every value that the memory model lets a load return.
//
// How. The type under test is built from ModelAtomic instead of std::atomic. Each access stops its thread (a
// coroutine) and asks the explorer who goes on. One run from start to end is one schedule; the explorer runs
// the scenario again and again, each time changing the last decision that still has an alternative
// (depth-first search), until none is left. Schedules that differ only in the order of independent accesses
// (other variable, or both loads) are equivalent; sleep sets (Godefroid 1996) run one of each class. Every
// class is run: the search is exhaustive, not sampled.
//
// Memory orders. Each variable keeps all values ever stored, each with the view of its writer; each thread
// has a view: the oldest value of each variable that it may still read. A load may answer any value not older
// than the view allows (a decision like the others); acquire takes over the view that came with a release
// (through read-modify-writes: release sequences). This is the view machine of the C++ memory model without
// load buffering and without fences (Kang et al. 2017, "A promising semantics", sections 2-3 less the
// promises), values appended in the order stored. Sequentially consistent executions are the special case in
// which every load answers the newest value, so they are all included.
//
// Plain memory. Watched is a payload that knows who touched it when (vector clocks) and reports two accesses,
// one of them a write, that no acquire and release order: a data race, even where the values happen to be
// right.
#pragma once

#include <ucontext.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "rt/assert.hpp"
#include "rt/slice.hpp"

namespace tactus::test {

/// The coroutines are switched behind ThreadSanitizer's back, which it does not survive; and in one real
/// thread there is nothing for it to see. The other builds explore.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kCanExplore = false;
#else
inline constexpr bool kCanExplore = true;
#endif

class Explorer {
 public:
  static constexpr int kThreadsCount = 2;
  static constexpr int kMainThread = kThreadsCount;  // set-up and check
  static constexpr int kVariablesMax = 24;
  static constexpr int kAccessesMax = 400;  // in one schedule; more means a loop that does not end

  enum class Access : std::uint8_t { load, store, update };
  using Clocks = std::array<std::uint16_t, kThreadsCount + 1>;
  struct View {
    std::array<std::uint16_t, kVariablesMax> oldest{};
    Clocks clocks{};
    void join(const View& other) {
      for (std::size_t i = 0; i < oldest.size(); ++i) oldest[i] = std::max(oldest[i], other.oldest[i]);
      for (std::size_t i = 0; i < clocks.size(); ++i) clocks[i] = std::max(clocks[i], other.clocks[i]);
    }
  };
  struct Value {
    std::uint64_t bits = 0;
    View view;
  };

  struct Outcome {
    std::uint64_t schedules_count = 0;  // executed from start to end
    std::uint64_t pruned_count = 0;     // abandoned: equivalent to one executed
    bool is_complete = false;
    std::string failure;  // the first one, with its schedule; empty when there was none
  };

  /// With ignore_orders every access is treated as relaxed: a type whose orders matter must then fail, which
  /// shows that the exploration can see it.
  explicit Explorer(bool ignore_orders = false) : ignore_orders_(ignore_orders) { current_ = this; }
  ~Explorer() { current_ = nullptr; }
  Explorer(const Explorer&) = delete;
  Explorer& operator=(const Explorer&) = delete;
  static Explorer& current() {
    TACTUS_ASSERT(current_ != nullptr);
    return *current_;
  }

  /// Scenario: constructed for each schedule; first() and second() run as the two threads; check() runs after
  /// both. It is never destroyed (a schedule may be abandoned with its threads half-way), so it must own no
  /// heap memory.
  template <typename Scenario>
  Outcome explore(std::uint64_t schedules_max = 20'000'000) {
    const rt::PanicHandler handler_before = rt::panic_handler;
    rt::panic_handler = &Explorer::on_panic;
    const std::unique_ptr<void, decltype(&std::free)> memory(
        std::aligned_alloc(alignof(Scenario), rt::round_up(sizeof(Scenario), alignof(Scenario))), &std::free);
    while (outcome_.schedules_count < schedules_max) {
      begin_schedule();
      auto* const scenario = new (memory.get()) Scenario();
      bodies_[0] = [scenario] { scenario->first(); };
      bodies_[1] = [scenario] { scenario->second(); };
      if (run_threads()) {
        for (const View& view : views_) views_[kMainThread].join(view);
        scenario->check();
        ++outcome_.schedules_count;
      } else {
        ++outcome_.pruned_count;
      }
      if (!outcome_.failure.empty()) break;
      if (!advance()) {
        outcome_.is_complete = true;
        break;
      }
    }
    rt::panic_handler = handler_before;
    return outcome_;
  }

  void require(bool condition, const char* what) {
    if (!condition) fail(what);
  }

  // For ModelAtomic.
  int add_variable(std::uint64_t bits) {
    TACTUS_ASSERT(variables_count_ < kVariablesMax);
    auto& history = histories_[static_cast<std::size_t>(variables_count_)];
    history.clear();
    history.push_back({bits, {}});
    return variables_count_++;
  }

  std::uint64_t load(int variable, std::memory_order order) {
    stop_before(variable, Access::load);
    auto& history = history_of(variable);
    const std::size_t oldest = view().oldest[static_cast<std::size_t>(variable)];
    const std::size_t newest = history.size() - 1;
    const std::size_t age = thread_ == kMainThread ? 0 : choose(newest - oldest + 1);
    read(variable, newest - age, order);
    return history[newest - age].bits;
  }

  void store(int variable, std::uint64_t bits, std::memory_order order) {
    stop_before(variable, Access::store);
    append(variable, bits, order, nullptr);
  }

  template <typename Change>
  std::uint64_t update(int variable, std::memory_order order, Change change) {
    stop_before(variable, Access::update);
    const std::size_t newest = history_of(variable).size() - 1;
    read(variable, newest, order);
    const Value before = history_of(variable)[newest];
    append(variable, change(before.bits), order, &before);
    return before.bits;
  }

  bool compare_exchange(int variable, std::uint64_t& expected, std::uint64_t desired,
                        std::memory_order success, std::memory_order failure) {
    stop_before(variable, Access::update);
    auto& history = history_of(variable);
    // It succeeds on the newest value only; it may fail on any value it may still read.
    std::array<std::size_t, kAccessesMax + 1> candidates;
    std::size_t candidates_count = 0;
    const std::size_t newest = history.size() - 1;
    const std::size_t oldest =
        thread_ == kMainThread ? newest : view().oldest[static_cast<std::size_t>(variable)];
    for (std::size_t i = newest + 1; i-- > oldest;) {
      if (i == newest || history[i].bits != expected) candidates[candidates_count++] = i;
    }
    const std::size_t index = candidates[choose(candidates_count)];
    const bool succeeds = history[index].bits == expected;
    read(variable, index, succeeds ? success : failure);
    const Value before = history[index];
    if (succeeds) append(variable, desired, success, &before);
    expected = before.bits;
    return succeeds;
  }

  // For Watched.
  [[nodiscard]] int thread() const { return thread_; }
  [[nodiscard]] const Clocks& clocks() const { return views_[static_cast<std::size_t>(thread_)].clocks; }
  void fail(const std::string& what) {
    if (!outcome_.failure.empty()) return;
    outcome_.failure = what + "; schedule:";
    static constexpr const char* kNames[] = {":load", ":store", ":update"};
    for (const Step& step : log_) {
      outcome_.failure += step.thread == 0 ? " a" : " b";
      outcome_.failure += kNames[static_cast<int>(step.access)] + std::to_string(step.variable);
    }
  }

 private:
  struct Decision {
    bool is_schedule = false;
    std::size_t choice = 0;
    std::size_t count = 0;    // values: how many
    unsigned candidates = 0;  // threads: bits of those neither finished nor asleep
    unsigned done = 0;        // threads: bits of those tried before `choice`
    unsigned asleep = 0;
  };
  struct Step {
    int thread;
    Access access;
    int variable;
  };
  struct Pending {
    int variable = -1;
    Access access = Access::load;
    bool is_finished = false;
  };

  static bool is_independent(const Pending& a, const Pending& b) {
    return a.variable != b.variable || (a.access == Access::load && b.access == Access::load);
  }

  void begin_schedule() {
    variables_count_ = 0;
    views_ = {};
    for (View& view : views_) view.clocks = {};
    for (std::size_t t = 0; t < views_.size(); ++t) views_[t].clocks[t] = 1;
    thread_ = kMainThread;
    depth_ = 0;
    accesses_count_ = 0;
    log_.clear();
    is_abandoned_ = false;
  }

  // False when the schedule was abandoned: redundant, or failed in the middle.
  bool run_threads() {
    for (std::size_t t = 0; t < kThreadsCount; ++t) {
      views_[t].join(views_[kMainThread]);
      pending_[t] = {};
      start_thread(t);
      resume(t);  // up to its first atomic access
      if (is_abandoned_) return false;
    }
    views_[kMainThread].clocks[kMainThread]++;
    unsigned asleep = 0;
    for (;;) {
      unsigned unfinished = 0;
      for (unsigned t = 0; t < kThreadsCount; ++t) unfinished |= pending_[t].is_finished ? 0U : 1U << t;
      if (unfinished == 0) return true;
      if ((unfinished & ~asleep) == 0) return false;
      const std::size_t thread = choose_thread(unfinished, asleep);
      const Decision& decision = decisions_[depth_ - 1];
      unsigned asleep_next = 0;
      for (unsigned t = 0; t < kThreadsCount; ++t) {
        const bool is_asleep = ((decision.asleep | decision.done) >> t & 1) != 0;
        if (is_asleep && is_independent(pending_[t], pending_[thread])) asleep_next |= 1U << t;
      }
      asleep = asleep_next;
      if (++accesses_count_ > kAccessesMax) {
        fail("endless loop");
        return false;
      }
      resume(thread);
      if (is_abandoned_) return false;
    }
  }

  std::size_t choose_thread(unsigned unfinished, unsigned asleep) {
    if (depth_ == decisions_.size()) {
      Decision decision;
      decision.is_schedule = true;
      decision.asleep = asleep;
      decision.candidates = unfinished & ~asleep;
      decision.choice = (decision.candidates & 1) != 0 ? 0 : 1;
      decisions_.push_back(decision);
    }
    const Decision& decision = decisions_[depth_++];
    TACTUS_ASSERT(decision.is_schedule && decision.candidates == (unfinished & ~asleep));
    return decision.choice;
  }

  std::size_t choose(std::size_t count) {
    if (count == 1) return 0;
    if (depth_ == decisions_.size()) {
      Decision decision;
      decision.count = count;
      decisions_.push_back(decision);
    }
    const Decision& decision = decisions_[depth_++];
    TACTUS_ASSERT(!decision.is_schedule && decision.count == count);
    return decision.choice;
  }

  // To the next schedule in depth-first order; false when there is none.
  bool advance() {
    while (!decisions_.empty()) {
      Decision& last = decisions_.back();
      if (last.is_schedule) {
        last.done |= 1U << last.choice;
        const unsigned left = last.candidates & ~last.done;
        if (left != 0) {
          last.choice = (left & 1) != 0 ? 0 : 1;
          return true;
        }
      } else if (last.choice + 1 < last.count) {
        ++last.choice;
        return true;
      }
      decisions_.pop_back();
    }
    return false;
  }

  std::vector<Value>& history_of(int variable) { return histories_[static_cast<std::size_t>(variable)]; }
  View& view() { return views_[static_cast<std::size_t>(thread_)]; }
  [[nodiscard]] bool acquires(std::memory_order order) const {
    TACTUS_ASSERT(order != std::memory_order_seq_cst);  // no type here needs it, the model does not have it
    return !ignore_orders_ && (order == std::memory_order_acquire || order == std::memory_order_acq_rel);
  }
  [[nodiscard]] bool releases(std::memory_order order) const {
    TACTUS_ASSERT(order != std::memory_order_seq_cst);
    return !ignore_orders_ && (order == std::memory_order_release || order == std::memory_order_acq_rel);
  }

  void read(int variable, std::size_t index, std::memory_order order) {
    auto& oldest = view().oldest[static_cast<std::size_t>(variable)];
    oldest = std::max(oldest, static_cast<std::uint16_t>(index));
    if (acquires(order)) view().join(history_of(variable)[index].view);
  }

  void append(int variable, std::uint64_t bits, std::memory_order order, const Value* updated) {
    auto& history = history_of(variable);
    const auto index = static_cast<std::uint16_t>(history.size());
    view().oldest[static_cast<std::size_t>(variable)] = index;
    Value value{bits, {}};
    if (releases(order)) value.view = view();
    if (updated != nullptr) value.view.join(updated->view);  // release sequence
    value.view.oldest[static_cast<std::size_t>(variable)] = index;
    history.push_back(value);
    view().clocks[static_cast<std::size_t>(thread_)]++;  // what comes after is not covered by this release
  }

  void stop_before(int variable, Access access) {
    if (thread_ == kMainThread) return;
    const auto thread = static_cast<std::size_t>(thread_);
    pending_[thread] = {variable, access, false};
    swapcontext(&contexts_[thread], &main_context_);
    log_.push_back({thread_, access, variable});
  }

  static void thread_main() {
    Explorer& self = current();
    const auto thread = static_cast<std::size_t>(self.thread_);
    self.bodies_[thread]();
    self.pending_[thread].is_finished = true;
    swapcontext(&self.contexts_[thread], &self.main_context_);
    std::abort();  // a finished thread is never resumed
  }

  void start_thread(std::size_t thread) {
    if (stacks_[thread] == nullptr) stacks_[thread] = std::make_unique<char[]>(kStackBytes);
    getcontext(&contexts_[thread]);
    contexts_[thread].uc_stack.ss_sp = stacks_[thread].get();
    contexts_[thread].uc_stack.ss_size = kStackBytes;
    contexts_[thread].uc_link = nullptr;
    makecontext(&contexts_[thread], &Explorer::thread_main, 0);
  }

  void resume(std::size_t thread) {
    thread_ = static_cast<int>(thread);
    swapcontext(&main_context_, &contexts_[thread]);
    thread_ = kMainThread;
  }

  // An assertion of the type under test: the schedule ends here, its threads are never resumed.
  static void on_panic(const char* expression, const char* file, int line) {
    Explorer& self = current();
    if (self.thread_ == kMainThread) rt::abort_with_message(expression, file, line);
    self.fail(std::string("assertion failed: ") + expression);
    self.is_abandoned_ = true;
    swapcontext(&self.contexts_[static_cast<std::size_t>(self.thread_)], &self.main_context_);
    std::abort();
  }

  static constexpr std::size_t kStackBytes = 256 * 1024;
  static inline Explorer* current_ = nullptr;

  bool ignore_orders_;
  Outcome outcome_;
  std::vector<Decision> decisions_;
  std::size_t depth_ = 0;

  std::array<std::vector<Value>, kVariablesMax> histories_;
  int variables_count_ = 0;
  std::array<View, kThreadsCount + 1> views_;
  std::array<Pending, kThreadsCount> pending_;
  int thread_ = kMainThread;
  int accesses_count_ = 0;
  bool is_abandoned_ = false;
  std::vector<Step> log_;

  std::array<std::function<void()>, kThreadsCount> bodies_;
  std::array<ucontext_t, kThreadsCount> contexts_{};
  ucontext_t main_context_{};
  std::array<std::unique_ptr<char[]>, kThreadsCount> stacks_;
};

/// Drop-in for std::atomic in a scenario.
template <typename T>
class ModelAtomic {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(std::uint64_t));

 public:
  ModelAtomic(T value = T())
      : variable_(Explorer::current().add_variable(to_bits(value))) {}  // NOLINT: as std::atomic
  ModelAtomic(const ModelAtomic&) = delete;
  ModelAtomic& operator=(const ModelAtomic&) = delete;

  T load(std::memory_order order) const { return from_bits(Explorer::current().load(variable_, order)); }
  void store(T value, std::memory_order order) {
    Explorer::current().store(variable_, to_bits(value), order);
  }
  T exchange(T value, std::memory_order order) {
    return update(order, [value](T) { return value; });
  }
  T fetch_add(T value, std::memory_order order) {
    return update(order, [value](T before) { return static_cast<T>(before + value); });
  }
  T fetch_sub(T value, std::memory_order order) {
    return update(order, [value](T before) { return static_cast<T>(before - value); });
  }
  T fetch_or(T value, std::memory_order order) {
    return update(order, [value](T before) { return static_cast<T>(before | value); });
  }
  bool compare_exchange_strong(T& expected, T desired, std::memory_order success, std::memory_order failure) {
    std::uint64_t bits = to_bits(expected);
    const bool succeeded =
        Explorer::current().compare_exchange(variable_, bits, to_bits(desired), success, failure);
    if (!succeeded) expected = from_bits(bits);
    return succeeded;
  }
  bool compare_exchange_weak(T& expected, T desired, std::memory_order success, std::memory_order failure) {
    return compare_exchange_strong(expected, desired, success, failure);
  }

 private:
  static std::uint64_t to_bits(T value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof value);
    return bits;
  }
  static T from_bits(std::uint64_t bits) {
    T value;
    std::memcpy(static_cast<void*>(&value), &bits, sizeof value);
    return value;
  }
  template <typename Change>
  T update(std::memory_order order, Change change) {
    return from_bits(Explorer::current().update(
        variable_, order, [&](std::uint64_t before) { return to_bits(change(from_bits(before))); }));
  }

  int variable_;
};

struct ModelAtomics {
  template <typename T>
  using Atomic = ModelAtomic<T>;
};

/// A payload in plain memory that reports data races.
class Watched {
 public:
  Watched(int value = 0) noexcept : value_(value) { note_write(); }  // NOLINT: reads best
  Watched(const Watched& other) noexcept : value_(other.get()) { note_write(); }
  Watched& operator=(const Watched& other) noexcept {
    const int value = other.get();
    note_write();
    value_ = value;
    return *this;
  }
  [[nodiscard]] int get() const noexcept {
    Explorer& explorer = Explorer::current();
    const auto& clocks = explorer.clocks();
    if (clocks[writer_] < written_)
      explorer.fail("data race: read of " + std::to_string(value_) + " while it is written");
    const auto self = static_cast<std::size_t>(explorer.thread());
    read_[self] = clocks[self];
    return value_;
  }

 private:
  void note_write() noexcept {
    Explorer& explorer = Explorer::current();
    const auto& clocks = explorer.clocks();
    if (clocks[writer_] < written_) explorer.fail("data race: two writes over " + std::to_string(value_));
    for (std::size_t t = 0; t < read_.size(); ++t) {
      if (clocks[t] < read_[t])
        explorer.fail("data race: write while " + std::to_string(value_) + " is read");
    }
    writer_ = static_cast<std::size_t>(explorer.thread());
    written_ = clocks[writer_];
  }

  int value_;
  std::size_t writer_ = 0;
  std::uint16_t written_ = 0;
  mutable Explorer::Clocks read_{};
};

}  // namespace tactus::test
