#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>

namespace tactus::hal::openni2 {
namespace {

int run_probe(const char* word) {
  const int status = std::system((std::string(TACTUS_EXIT_PROBE) + " " + word).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(OpenNi2Process, ThatOpenedAndClosedADevice_ExitsCleanTenTimesInARow) {
  for (int i = 0; i < 10; ++i) EXPECT_EQ(run_probe("closed"), 0) << i;
}

TEST(OpenNi2Process, ThatExitsWithADeviceOpen_ExitsCleanToo) {
  for (int i = 0; i < 10; ++i) EXPECT_EQ(run_probe("open"), 0) << i;
}

}  // namespace
}  // namespace tactus::hal::openni2
