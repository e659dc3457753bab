// The two ways to fail: Status while running (closed set, no words), Result at boot (one sentence for a person).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "rt/assert.hpp"

namespace tactus::rt {

/// What a step answers. No strings: codes are counted per stage, words belong to boot.
enum class [[nodiscard]] Status : std::uint8_t {
  ok,
  skipped,       ///< nothing to do, by policy
  late,          ///< the deadline had passed before the work began
  full,          ///< a fixed structure had no room; the policy of its owner was applied
  stale,         ///< the input is older than what is already known
  timeout,       ///< nothing arrived in time
  device_lost,   ///< the device went away; it may come back
  unsupported,   ///< the device or file cannot do this
  corrupt,       ///< bytes from outside are not what they claim; the item was rejected
  lost,          ///< tracking has no trustworthy pose
  end_of_stream  ///< a recording is over
};
inline constexpr int kStatusCount = 11;

constexpr const char* name(Status status) {
  constexpr const char* kNames[kStatusCount] = {"ok",          "skipped", "late",  "full",   "stale",        "timeout",
                                                "device_lost", "unsupported", "corrupt", "lost", "end_of_stream"};
  return kNames[static_cast<int>(status)];
}

/// Exit codes of the program (README); a boot error carries the one it leads to.
enum class ExitCode : int {
  done = 0,
  failed = 1,
  bad_usage = 2,
  bad_input = 3,
  device_unavailable = 4,
  budget_exceeded = 5
};

/// One sentence a person can act on: what, where (file, line, key), what to do.
struct Error {
  ExitCode code = ExitCode::failed;
  std::string message;
};

/// A value, or the sentence that says why there is none. Boot and command line only (it may allocate).
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor): return value; reads best
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor): return Error{...}

  [[nodiscard]] bool has_value() const { return state_.index() == 0; }
  explicit operator bool() const { return has_value(); }
  T& value() {
    TACTUS_ASSERT(has_value());
    return *std::get_if<0>(&state_);
  }
  const T& value() const {
    TACTUS_ASSERT(has_value());
    return *std::get_if<0>(&state_);
  }
  const Error& error() const {
    TACTUS_ASSERT(!has_value());
    return *std::get_if<1>(&state_);
  }
  T& operator*() { return value(); }
  const T& operator*() const { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), failed_(true) {}  // NOLINT: for `return Error{...}`

  [[nodiscard]] bool has_value() const { return !failed_; }
  explicit operator bool() const { return has_value(); }
  const Error& error() const {
    TACTUS_ASSERT(failed_);
    return error_;
  }

 private:
  Error error_;
  bool failed_ = false;
};

}  // namespace tactus::rt
