#include "firmware_host/progress.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

namespace tactus::firmware {
namespace {

/// A stream whose bytes can be looked at.
class MemoryStream {
 public:
  MemoryStream() : file_(open_memstream(&data_, &size_)) {}
  ~MemoryStream() {
    std::fclose(file_);
    std::free(data_);
  }
  MemoryStream(const MemoryStream&) = delete;
  MemoryStream& operator=(const MemoryStream&) = delete;
  std::FILE* file() { return file_; }
  std::string text() {
    std::fflush(file_);
    return {data_, size_};
  }

 private:
  char* data_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* file_;
};

TEST(Progress, SaysNothingWhenPiped) {
  rt::ManualClock clock;
  MemoryStream stream;
  {
    // A memory stream is no terminal: the constructor that asks the stream must see that.
    Progress sut("work", 10, rt::Clock::manual(clock), std::tmpfile());
    Progress piped("work", 10, rt::Clock::manual(clock), stream.file(), false);
    for (std::uint64_t i = 0; i < 10; ++i) {
      clock.advance(rt::Duration{1'000'000'000});
      sut.update(i);
      piped.update(i);
    }
  }
  EXPECT_EQ(stream.text(), "");
}

TEST(Progress, ShowsShareAndTimeLeftAndErasesItself) {
  rt::ManualClock clock;
  MemoryStream stream;
  {
    Progress sut("reading", 200, rt::Clock::manual(clock), stream.file(), true);
    clock.advance(rt::Duration{10'000'000'000});
    sut.update(50);
    EXPECT_NE(stream.text().find("reading [======                  ]  25 %  50/200  30 s left"),
              std::string::npos)
        << stream.text();
  }
  EXPECT_TRUE(stream.text().ends_with("\r\033[K"));
}

TEST(Progress, IsRewrittenAtMostTenTimesASecond) {
  rt::ManualClock clock;
  MemoryStream stream;
  Progress sut("x", 0, rt::Clock::manual(clock), stream.file(), true);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    sut.update(i);
    clock.advance(rt::Duration{1'000'000});
  }
  const std::string text = stream.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 10);
}

}  // namespace
}  // namespace tactus::firmware
