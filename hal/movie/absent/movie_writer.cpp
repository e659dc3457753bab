// Stands in where libav was not there at configure time: says so, writes nothing.
#include "hal/movie/movie_writer.hpp"

namespace tactus::hal {

struct MovieWriter::State {};

MovieWriter::MovieWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MovieWriter::MovieWriter(MovieWriter&&) noexcept = default;
MovieWriter::~MovieWriter() = default;

rt::Result<MovieWriter> MovieWriter::create(const std::filesystem::path& file, const MovieFormat&) {
  return rt::Error{rt::ExitCode::device_unavailable,
                   file.string() +
                       ": this program was built without libavformat and libavcodec and writes no films; "
                       "build it where they are installed, or run without a film."};
}

void MovieWriter::write_picture(std::uint64_t, std::span<const std::uint8_t>) { TACTUS_ASSERT(false); }
void MovieWriter::write_sound(std::span<const float>) { TACTUS_ASSERT(false); }
rt::Result<void> MovieWriter::close() {
  TACTUS_ASSERT(false);
  return {};
}

}  // namespace tactus::hal
