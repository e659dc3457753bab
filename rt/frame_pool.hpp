// Frames stay where they are; ids travel. One writer fills a frame, then any number of readers share it, and
// the last one to let go returns it.
//
// Design.
//   FrameId        { generation : 26 | slot : 6 }      what edges carry
//   slot's state   { generation : 26 | holders : 6 }   holders: 0 nobody, 1..62 readers, 63 the writer
//   free_          64 bits, one per slot, 1 = free
//
//   try_lease:  take the lowest bit out of free_ (CAS)  ->  generation + 1, writer
//   share:      writer -> 1 reader                          the frame is now read-only
//   copy, drop: holders + 1, holders - 1;  at 0: put the bit back into free_ (one fetch_or)
//
// Why a bit set and not a linked free list: setting a bit needs no loop, and taking and putting back the same
// bit in between changes nothing, so the ABA problem of a list head does not exist. 64 frames are plenty.
//
// Why holders and generation share a word: "the id is current and somebody holds it" and "now I hold it too"
// are one step; with two words the last holder could leave between the check and the count.
//
// Who sees what:
// - The writer fills the frame -> share(): store(release) => ref(), adopt(): load(acquire) -> readers read.
//   The id itself must come over something that releases and acquires, as all edges here do: over a relaxed
//   variable it could overtake share(), and ref() would assert.
// - A reader reads the frame -> holders - 1 (release) => the one who brings it to 0 (acquire, in the same
//   fetch_sub) -> free_.fetch_or(release) => try_lease: CAS(acquire) -> the next writer fills it. Without the
//   first pair a reader's last reads could happen after the next writer's first write; without the second the
//   next writer might not even see that the holders went to 0. Updates of free_ by other threads in between
//   are read-modify-writes and carry the release on (release sequence).
// - holders + 1 is relaxed: whoever copies a Ref holds one, so the count cannot reach 0 meanwhile.
//
// Progress: share, copy, drop and return are wait-free; try_lease and ref are lock-free (they repeat only
// when another thread leased, returned or counted). No frame left is an answer, counted; nothing else is done
// at that moment.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "rt/assert.hpp"
#include "rt/atomics.hpp"
#include "rt/edge.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// Names one filling of one slot: when the slot is used again the generation differs, so a stale id is
/// caught.
struct FrameId {
  static constexpr std::uint32_t kSlotBits = 6;
  static constexpr std::uint32_t kSlotMask = (1U << kSlotBits) - 1;

  std::uint32_t bits = 0;

  [[nodiscard]] constexpr std::uint32_t slot() const { return bits & kSlotMask; }
  [[nodiscard]] constexpr std::uint32_t generation() const { return bits >> kSlotBits; }
  friend constexpr bool operator==(FrameId, FrameId) = default;
};

/// A fixed set of frames of type T (which holds spans into planned memory when it is big).
template <typename T, typename Atomics = StdAtomics>
class FramePool {
  static_assert(std::is_trivially_destructible_v<T>, "lives in planned memory");

  static constexpr std::uint32_t kHoldersMask = FrameId::kSlotMask;
  static constexpr std::uint32_t kWriter = kHoldersMask;
  static constexpr std::uint32_t kReadersMax = kWriter - 1;

  struct alignas(kCacheLineBytes) Slot {
    typename Atomics::template Atomic<std::uint32_t> state{0};
    T frame{};
  };

 public:
  static constexpr std::size_t kFramesMax = 64;

  /// A counted reader. Copying counts one more, destroying one less; the last one returns the frame to the
  /// pool.
  class Ref {
   public:
    Ref() = default;
    Ref(const Ref& other) noexcept : pool_(other.pool_), id_(other.id_) {
      if (pool_ != nullptr) pool_->add_reader(id_);
    }
    Ref(Ref&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), id_(other.id_) {}
    Ref& operator=(Ref other) noexcept {
      std::swap(pool_, other.pool_);
      std::swap(id_, other.id_);
      return *this;
    }
    ~Ref() {
      if (pool_ != nullptr) pool_->drop_reader(id_);
    }

    explicit operator bool() const noexcept { return pool_ != nullptr; }
    const T& operator*() const noexcept { return *get(); }
    const T* operator->() const noexcept { return get(); }
    [[nodiscard]] FrameId id() const noexcept { return id_; }
    /// Turns the reference into an id that still counts, to travel on an edge; adopt() turns it back.
    [[nodiscard]] FrameId into_id() && noexcept {
      TACTUS_ASSERT(pool_ != nullptr);
      pool_ = nullptr;
      return id_;
    }

   private:
    friend class FramePool;
    Ref(FramePool* pool, FrameId id) noexcept : pool_(pool), id_(id) {}
    [[nodiscard]] const T* get() const noexcept {
      TACTUS_ASSERT(pool_ != nullptr);
      return &pool_->slots_[id_.slot()].frame;
    }
    FramePool* pool_ = nullptr;
    FrameId id_;
  };

  /// The one writer of a frame. Move-only; unshared, it returns the frame when destroyed.
  class Lease {
   public:
    Lease(Lease&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), id_(other.id_) {}
    Lease& operator=(Lease&& other) noexcept {
      std::swap(pool_, other.pool_);
      std::swap(id_, other.id_);
      return *this;
    }
    ~Lease() {
      if (pool_ != nullptr) pool_->abandon(id_);
    }

    T& operator*() const noexcept { return *get(); }
    T* operator->() const noexcept { return get(); }
    [[nodiscard]] FrameId id() const noexcept { return id_; }
    /// Writing is over, reading begins.
    [[nodiscard]] Ref share() && noexcept {
      TACTUS_ASSERT(pool_ != nullptr);
      FramePool* const pool = std::exchange(pool_, nullptr);
      pool->share(id_);
      return Ref(pool, id_);
    }

   private:
    friend class FramePool;
    Lease(FramePool* pool, FrameId id) noexcept : pool_(pool), id_(id) {}
    [[nodiscard]] T* get() const noexcept {
      TACTUS_ASSERT(pool_ != nullptr);
      return &pool_->slots_[id_.slot()].frame;
    }
    FramePool* pool_;
    FrameId id_;
  };

  FramePool() = default;
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;

  static constexpr std::size_t bytes_needed(std::size_t frames_count) { return bytes_of<Slot>(frames_count); }

  /// Boot, before any other call.
  void bind(Slice& memory, std::size_t frames_count) {
    TACTUS_ASSERT(frames_count > 0 && frames_count <= kFramesMax && slots_.empty());
    slots_ = memory.take<Slot>(frames_count);
    // Relaxed: boot comes before every other thread.
    free_.store(~std::uint64_t{0} >> (kFramesMax - frames_count), std::memory_order_relaxed);
  }

  /// The frame in a slot, to give it its memory. Boot, before the first lease.
  [[nodiscard]] T& frame_at_boot(std::size_t slot_index) {
    TACTUS_ASSERT(slot_index < slots_.size() && counter_.was().pushed == 0);
    return slots_[slot_index].frame;
  }

  /// A frame to fill, or nothing (counted) when all are held. Step, any thread, lock-free.
  [[nodiscard]] std::optional<Lease> try_lease() noexcept {
    // Relaxed: a guess that the CAS confirms.
    std::uint64_t free = free_.load(std::memory_order_relaxed);
    while (free != 0) {
      // Acquire pairs with the fetch_or in return_slot(): the last reader is done before we write. Failure is
      // relaxed: the new value is a guess again.
      if (free_.compare_exchange_weak(free, free & (free - 1), std::memory_order_acquire,
                                      std::memory_order_relaxed)) {
        const auto slot = static_cast<std::uint32_t>(std::countr_zero(free));
        const std::uint64_t free_count = static_cast<std::uint64_t>(std::popcount(free)) - 1;
        counter_.count_pushed(slots_.size() - free_count);
        return Lease(this, begin_generation(slot));
      }
    }
    counter_.count_dropped();
    return std::nullopt;
  }

  /// Takes over the count that came with an id from into_id(). Asserts that the id is current. Step, any
  /// thread, wait-free.
  [[nodiscard]] Ref adopt(FrameId id) noexcept {
    // Acquire pairs with the release in share(): the frame's contents.
    const std::uint32_t state = slot_of(id).load(std::memory_order_acquire);
    assert_is_read(state, id);
    return Ref(this, id);
  }

  /// For an id that nobody will read any more, such as one that an edge pushed out. As adopt().
  void drop(FrameId id) noexcept { static_cast<void>(adopt(id)); }

  /// One more reader of a frame that somebody is known to hold (asserts it, and that the id is current).
  /// Step, any thread, lock-free.
  [[nodiscard]] Ref ref(FrameId id) noexcept {
    auto& state = slot_of(id);
    // Acquire as below. Not older than the share() of this id: whatever brought us the id brought that too.
    std::uint32_t seen = state.load(std::memory_order_acquire);
    do {
      assert_is_read(seen, id);
      TACTUS_ASSERT((seen & kHoldersMask) < kReadersMax);
      // Acquire pairs with the release in share(): the frame's contents.
    } while (
        !state.compare_exchange_weak(seen, seen + 1, std::memory_order_acquire, std::memory_order_acquire));
    return Ref(this, id);
  }

  /// pushed: leases given; dropped: leases refused because all frames were held; high_water: most frames held
  /// at once.
  [[nodiscard]] EdgeCounts was() const noexcept { return counter_.was(); }
  [[nodiscard]] std::size_t frames_count() const noexcept { return slots_.size(); }
  /// Racy unless all other threads rest. Relaxed: a number for reports and tests.
  [[nodiscard]] std::size_t was_free_count() const noexcept {
    return static_cast<std::size_t>(std::popcount(free_.load(std::memory_order_relaxed)));
  }

 private:
  typename Atomics::template Atomic<std::uint32_t>& slot_of(FrameId id) noexcept {
    TACTUS_ASSERT(id.slot() < slots_.size());
    return slots_[id.slot()].state;
  }

  static void assert_is_read(std::uint32_t state, FrameId id) noexcept {
    const std::uint32_t generation_in_slot = state >> FrameId::kSlotBits;
    const std::uint32_t holders = state & kHoldersMask;
    TACTUS_ASSERT(generation_in_slot == id.generation());
    TACTUS_ASSERT(holders >= 1 && holders <= kReadersMax);
  }

  FrameId begin_generation(std::uint32_t slot) noexcept {
    auto& state = slots_[slot].state;
    // Relaxed: the CAS on free_ made the slot ours and showed us its last state.
    const std::uint32_t generation = (state.load(std::memory_order_relaxed) >> FrameId::kSlotBits) + 1;
    const std::uint32_t shifted = generation
                                  << FrameId::kSlotBits;  // wraps after 67 million fillings of one slot
    // Relaxed: nobody else may look at a leased slot; share() publishes.
    state.store(shifted | kWriter, std::memory_order_relaxed);
    return {shifted | slot};
  }

  void share(FrameId id) noexcept {
    // Release pairs with the acquire in ref() and adopt(): contents before readers.
    slot_of(id).store((id.generation() << FrameId::kSlotBits) | 1, std::memory_order_release);
  }

  void add_reader(FrameId id) noexcept {
    // Relaxed: the caller's own reference keeps the frame alive and readable.
    const std::uint32_t before = slot_of(id).fetch_add(1, std::memory_order_relaxed);
    assert_is_read(before, id);
    TACTUS_ASSERT((before & kHoldersMask) < kReadersMax);
  }

  void drop_reader(FrameId id) noexcept {
    // Release: our reads are over. Acquire: whoever gets to 0 has seen that all others' are.
    const std::uint32_t before = slot_of(id).fetch_sub(1, std::memory_order_acq_rel);
    assert_is_read(before, id);
    if ((before & kHoldersMask) == 1) return_slot(id.slot());
  }

  void abandon(FrameId id) noexcept {
    // Relaxed: return_slot() publishes.
    slot_of(id).store(id.generation() << FrameId::kSlotBits, std::memory_order_relaxed);
    return_slot(id.slot());
  }

  void return_slot(std::uint32_t slot) noexcept {
    // Release pairs with the acquire CAS in try_lease(): all use of the frame is over before the next
    // filling.
    const std::uint64_t before = free_.fetch_or(std::uint64_t{1} << slot, std::memory_order_release);
    TACTUS_ASSERT((before >> slot & 1) == 0);
  }

  std::span<Slot> slots_;
  EdgeCounter counter_;
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> free_{0};
};

}  // namespace tactus::rt
