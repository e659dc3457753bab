#include "hal/egl/sigpipe_guard.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace tactus::hal::egl {
namespace {

void write_to_broken_pipe() {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  close(ends[0]);
  const char byte = 0;
  EXPECT_EQ(write(ends[1], &byte, 1), -1);
  EXPECT_EQ(errno, EPIPE);
  close(ends[1]);
}

TEST(SigpipeGuard, BrokenPipeWithinItIsOnlyAnErrorAndNothingIsLeftBehind) {
  signal(SIGPIPE, SIG_DFL);
  for (int i = 0; i < 2; ++i) {
    const SigpipeGuard outer;
    const SigpipeGuard inner;
    write_to_broken_pipe();
  }
  sigset_t set;
  sigpending(&set);
  EXPECT_EQ(sigismember(&set, SIGPIPE), 0);
  pthread_sigmask(SIG_BLOCK, nullptr, &set);
  EXPECT_EQ(sigismember(&set, SIGPIPE), 0);
}

TEST(SigpipeGuardDeathTest, BrokenPipeOutsideOfItStillEndsTheProgram) {
  EXPECT_EXIT(
      {
        signal(SIGPIPE, SIG_DFL);
        { const SigpipeGuard guard; }
        write_to_broken_pipe();
      },
      testing::KilledBySignal(SIGPIPE), "");
}

}  // namespace
}  // namespace tactus::hal::egl
