// Opens a device, reads of it, and exits: closed before, or not at all when called with "open".
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "hal/openni2/openni2.hpp"
#include "tests/hal/openni2/driver_environment.hpp"

int main(int count, char** words) {
  using namespace tactus;
  hal::openni2::set_driver(hal::openni2::kSource, "4", true);
  auto sensor = hal::openni2::open_openni2({});
  if (!sensor) {
    std::fprintf(stderr, "%s\n", sensor.error().message.c_str());
    return 4;
  }
  std::vector<std::uint16_t> raw(std::size_t{320} * 240);
  hal::FrameHeader header;
  for (int i = 0; i < 3; ++i)
    if (sensor->depth->read(raw, header, {5'000'000'000}) != rt::Status::ok) return 5;
  if (count > 1 && std::strcmp(words[1], "open") == 0) std::exit(0);
  return 0;
}
