// Hands the chunks of one job at a time to whoever asks, each chunk once: the heart of the worker pool.
//
// Design. One 64-bit ticket {chunks_count : 32 | next : 32} is all that threads race for:
//
//   publish (one thread)     job fields, done = 0, then ticket = {count, 0}          store(release)
//   try_claim (any thread)   ticket {count, k} -> {count, k + 1}, chunk k is ours    CAS(acquire)
//   finish (the claimer)     done + 1; whoever makes it `count` ends the job         fetch_add(acq_rel)
//
// - A thread looks at the job's fields only between its claim and its finish. The job cannot end before that
//   finish, and the next one is published only after the end, so the fields stand still while anyone looks:
//   plain memory suffices.
// - A claimer may have slept since it read the ticket, and a later job may have the same count and position:
//   then the CAS succeeds and rightly claims a chunk of the later job, whose fields it sees because that CAS
//   read what publish released (through other claims, which are read-modify-writes and carry it on).
// - finish releases what the chunk wrote and the last one acquires it from all others: whoever is told that
//   the job has ended sees every result.
//
// try_claim: lock-free (repeats only when another thread claimed). finish, publish: wait-free.
#pragma once

#include <cstdint>
#include <optional>

#include "rt/assert.hpp"
#include "rt/atomics.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

template <typename Atomics = StdAtomics>
class ChunkDispenser {
 public:
  struct Claim {
    std::uint32_t chunk_index;
    std::uint32_t chunks_count;
  };

  /// Starts a job; the one before must have ended. The publishing thread.
  void publish(std::uint32_t chunks_count) noexcept {
    // Relaxed: published by the ticket; nobody touches it between jobs.
    done_count_.store(0, std::memory_order_relaxed);
    // Pairs with the acquire in try_claim(): the job's fields and the zero above come first.
    ticket_.store(static_cast<std::uint64_t>(chunks_count) << 32, std::memory_order_release);
  }

  /// The next chunk, or nothing when all have been handed out. Any thread.
  [[nodiscard]] std::optional<Claim> try_claim() noexcept {
    // Relaxed: a guess that the CAS confirms. Failure is relaxed for the same reason.
    std::uint64_t ticket = ticket_.load(std::memory_order_relaxed);
    for (;;) {
      const Claim claim{static_cast<std::uint32_t>(ticket), static_cast<std::uint32_t>(ticket >> 32)};
      if (claim.chunk_index >= claim.chunks_count) return std::nullopt;
      // Acquire pairs with the release in publish(): the job's fields.
      if (ticket_.compare_exchange_weak(ticket, ticket + 1, std::memory_order_acquire,
                                        std::memory_order_relaxed)) {
        return claim;
      }
    }
  }

  /// True for exactly one caller per job: the one whose chunk was the last to be finished.
  [[nodiscard]] bool finish(const Claim& claim) noexcept {
    // Release: our chunk's results. Acquire: the last one has everybody's.
    const std::uint32_t before = done_count_.fetch_add(1, std::memory_order_acq_rel);
    TACTUS_ASSERT(before < claim.chunks_count);
    return before + 1 == claim.chunks_count;
  }

 private:
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> ticket_{0};
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint32_t> done_count_{0};
};

}  // namespace tactus::rt
