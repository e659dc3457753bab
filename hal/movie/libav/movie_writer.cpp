// The film by libavformat: one MP4 with its index at the front, so that it plays while it is being loaded.
#include "hal/movie/movie_writer.hpp"

#include <algorithm>
#include <cmath>

#include "hal/movie/libav/encoders.hpp"

namespace tactus::hal {

using libav::Handle;

struct MovieWriter::State {
  std::filesystem::path file;
  MovieFormat format;
  libav::Encoder picture, sound;  // sound.codec: null in a silent film
  Handle<SwsContext> to_yuv;
  Handle<AVFormatContext> container;
  Handle<AVPacket> packet;
  std::int64_t last_index = -1;
  std::int64_t sound_frames_count = 0;  // sample frames taken
  int frame_fill = 0;                   // of them in sound.frame, not yet encoded
  int error = 0;                        // the first one; libav's code

  void keep(int status) {
    if (error == 0 && status < 0) error = status;
  }
  // Sends one frame (null: the end) and writes what comes out.
  void encode(AVCodecContext& codec, const AVFrame* frame, int stream);
  void encode_sound_frame();
  void encode_picture(std::int64_t index);
  void end_together();
  void finish();
};

void MovieWriter::State::encode(AVCodecContext& codec, const AVFrame* frame, int stream) {
  if (error != 0) return;
  keep(avcodec_send_frame(&codec, frame));
  while (error == 0) {
    const int status = avcodec_receive_packet(&codec, packet.get());
    if (status == AVERROR(EAGAIN) || status == AVERROR_EOF) return;
    keep(status);
    if (error != 0) return;
    packet->stream_index = stream;
    if (packet->duration == 0)
      packet->duration = 1;  // a picture's; the container asks for the last one's alone
    av_packet_rescale_ts(packet.get(), codec.time_base, container->streams[stream]->time_base);
    keep(av_interleaved_write_frame(container.get(), packet.get()));
    keep(container->pb->error);
  }
}

void MovieWriter::State::encode_sound_frame() {
  sound.frame->nb_samples = frame_fill;
  sound.frame->pts = sound_frames_count - frame_fill;
  encode(*sound.codec, sound.frame.get(), 1);
  frame_fill = 0;
}

void MovieWriter::State::encode_picture(std::int64_t index) {
  last_index = index;
  picture.frame->pts = index;
  encode(*picture.codec, picture.frame.get(), 0);
}

// The last picture stands until no sound is left; then silence fills up what is left of that picture.
void MovieWriter::State::end_together() {
  if (sound.codec == nullptr) return;
  const AVRational sample_s = sound.codec->time_base, picture_s = picture.codec->time_base;
  const std::int64_t pictures_count = av_rescale_q_rnd(sound_frames_count, sample_s, picture_s, AV_ROUND_UP);
  if (pictures_count - 1 > last_index) encode_picture(pictures_count - 1);
  std::int64_t missing = av_rescale_q(last_index + 1, picture_s, sample_s) - sound_frames_count;
  while (missing > 0 && error == 0) {
    keep(av_frame_make_writable(sound.frame.get()));
    if (error != 0) return;
    const int count = static_cast<int>(std::min<std::int64_t>(missing, sound.codec->frame_size - frame_fill));
    av_samples_set_silence(sound.frame->data, frame_fill, count, 2, AV_SAMPLE_FMT_FLTP);
    frame_fill += count;
    sound_frames_count += count;
    missing -= count;
    if (frame_fill == sound.codec->frame_size) encode_sound_frame();
  }
  if (frame_fill > 0) encode_sound_frame();
}

void MovieWriter::State::finish() {
  if (last_index >= 0) end_together();
  encode(*picture.codec, nullptr, 0);
  if (sound.codec != nullptr) encode(*sound.codec, nullptr, 1);
  avio_flush(container->pb);
  keep(container->pb->error);
  // The trailer reads the file again to move its index to the front: not worth it where bytes are missing.
  if (error == 0) keep(av_write_trailer(container.get()));
  keep(container->pb->error);
  keep(avio_closep(&container->pb));
}

rt::Result<MovieWriter> MovieWriter::create(const std::filesystem::path& file, const MovieFormat& format) {
  av_log_set_level(AV_LOG_QUIET);
  auto state = std::make_unique<State>();
  state->file = file;
  state->format = format;
  auto picture = libav::open_picture_encoder(format);
  if (!picture) return picture.error();
  state->picture = std::move(*picture);
  if (format.sound.channels_count != 0) {
    auto sound = libav::open_sound_encoder(format.sound);
    if (!sound) return sound.error();
    state->sound = std::move(*sound);
  }
  state->to_yuv = libav::make_colour_converter(format);
  state->packet.reset(av_packet_alloc());
  AVFormatContext* container = nullptr;
  int status = avformat_alloc_output_context2(&container, nullptr, "mp4", file.c_str());
  state->container.reset(container);
  const auto cannot = [&](int error) {
    return rt::Error{rt::ExitCode::failed,
                     file.string() + ": the film cannot be created (" + libav::words_of(error) + ")."};
  };
  if (status < 0 || state->to_yuv == nullptr || state->packet == nullptr)
    return cannot(status < 0 ? status : AVERROR(ENOMEM));
  container->flags |= AVFMT_FLAG_BITEXACT;
  for (const libav::Encoder* encoder : {&state->picture, &state->sound}) {
    if (encoder->codec == nullptr) continue;
    AVStream* stream = avformat_new_stream(container, nullptr);
    if (stream == nullptr) return cannot(AVERROR(ENOMEM));
    stream->time_base = encoder->codec->time_base;
    if (encoder->codec->codec_type == AVMEDIA_TYPE_VIDEO) stream->avg_frame_rate = encoder->codec->framerate;
    status = avcodec_parameters_from_context(stream->codecpar, encoder->codec.get());
    if (status < 0) return cannot(status);
  }
  // libav takes a path for an address: a colon in it would name a protocol.
  status = avio_open(&container->pb, ("file:" + file.string()).c_str(), AVIO_FLAG_WRITE);
  if (status < 0) return cannot(status);
  av_freep(&container->url);
  container->url = av_strdup(("file:" + file.string()).c_str());
  AVDictionary* options = nullptr;
  av_dict_set(&options, "movflags", "+faststart", 0);
  status = avformat_write_header(container, &options);
  av_dict_free(&options);
  if (status < 0) return cannot(status);
  return MovieWriter(std::move(state));
}

MovieWriter::MovieWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MovieWriter::MovieWriter(MovieWriter&&) noexcept = default;
MovieWriter::~MovieWriter() {
  if (state_ != nullptr && state_->container->pb != nullptr) state_->finish();
}

void MovieWriter::write_picture(std::uint64_t index, std::span<const std::uint8_t> rgb) {
  State& film = *state_;
  const int stride = 3 * film.format.width_px;
  TACTUS_ASSERT(rgb.size() ==
                static_cast<std::size_t>(stride) * static_cast<std::size_t>(film.format.height_px));
  TACTUS_ASSERT(static_cast<std::int64_t>(index) > film.last_index);
  film.keep(av_frame_make_writable(film.picture.frame.get()));
  if (film.error != 0) return;
  const std::uint8_t* planes[] = {rgb.data(), nullptr, nullptr, nullptr};
  const int strides[] = {stride, 0, 0, 0};
  film.keep(sws_scale(film.to_yuv.get(), planes, strides, 0, film.format.height_px, film.picture.frame->data,
                      film.picture.frame->linesize));
  film.encode_picture(static_cast<std::int64_t>(index));
}

void MovieWriter::write_sound(std::span<const float> samples) {
  State& film = *state_;
  TACTUS_ASSERT(samples.size() % 2 == 0);
  TACTUS_ASSERT(film.sound.codec != nullptr || samples.empty());
  while (!samples.empty() && film.error == 0) {
    AVFrame& frame = *film.sound.frame;
    film.keep(av_frame_make_writable(&frame));
    if (film.error != 0) return;
    const std::size_t room = static_cast<std::size_t>(film.sound.codec->frame_size - film.frame_fill);
    const std::size_t count = std::min(room, samples.size() / 2);
    auto* left = reinterpret_cast<float*>(frame.data[0]) + film.frame_fill;
    auto* right = reinterpret_cast<float*>(frame.data[1]) + film.frame_fill;
    for (std::size_t i = 0; i < count; ++i) {
      left[i] = samples[2 * i];
      right[i] = samples[2 * i + 1];
    }
    film.frame_fill += static_cast<int>(count);
    film.sound_frames_count += static_cast<std::int64_t>(count);
    samples = samples.subspan(2 * count);
    if (film.frame_fill == film.sound.codec->frame_size) film.encode_sound_frame();
  }
}

rt::Result<void> MovieWriter::close() {
  State& film = *state_;
  TACTUS_ASSERT(film.container->pb != nullptr);
  film.finish();
  if (film.error != 0)
    return rt::Error{rt::ExitCode::failed, film.file.string() + ": the film could not be written (" +
                                               libav::words_of(film.error) + "); is the disk full?"};
  if (film.last_index < 0)
    return rt::Error{rt::ExitCode::failed,
                     film.file.string() + ": the film holds no picture; none was written to it."};
  return {};
}

}  // namespace tactus::hal
