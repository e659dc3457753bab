#include "firmware_host/run.hpp"

#include <utility>

#include "firmware_host/run_outputs.hpp"
#include "firmware_host/session.hpp"

namespace tactus::firmware {

rt::Result<std::string> run(const RunOptions& options) {
  SessionRequest request;
  request.options = options;
  request.draws = !options.out.empty();
  request.takes_pictures = !options.out.empty();
  if (app_of(options) != interact::App::none && !options.out.empty()) {
    request.movie = options.out / "video.mp4";
    request.sound = options.out / "sound.wav";
  }
  auto session = Session::open(std::move(request));
  if (!session) return session.error();

  // Outputs are opened before the session: a folder that cannot be written must not cost a session.
  auto outputs = RunOutputs::create(options.out);
  if (!outputs) return outputs.error();
  if (auto played = (*session)->play(); !played) return played.error();

  RunFacts facts{&options,
                 &(*session)->settings(),
                 &(*session)->source().labels,
                 &(*session)->booted().plan,
                 &(*session)->booted().arena,
                 (*session)->source().gravity.origin,
                 (*session)->wall_s(),
                 std::move((*session)->pictures()),
                 std::move((*session)->notes()),
                 (*session)->pictures_recorded(),
                 (*session)->film_name(),
                 (*session)->sound_name(),
                 (*session)->recording(),
                 (*session)->faults()};
  auto written = outputs->write(facts, (*session)->pipeline(), (*session)->source().sensor);
  // A film that failed does not keep the rest from being written.
  if (written && !(*session)->recorded()) return (*session)->recorded().error();
  if (written && !(*session)->recording_closed()) return (*session)->recording_closed().error();
  return written;
}

}  // namespace tactus::firmware
