#include "tests/hal/movie/film_reader.hpp"

#include <cmath>
#include <stdexcept>

#include "hal/movie/libav/handles.hpp"

namespace tactus::hal::testing {
namespace {

using libav::Handle;

void require(int status) {
  if (status < 0) throw std::runtime_error(libav::words_of(status));
}

struct Close {
  void operator()(AVFormatContext* container) const { avformat_close_input(&container); }
};

std::vector<std::uint8_t> to_rgb(const AVFrame& frame) {
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(3 * frame.width * frame.height));
  const Handle<SwsContext> scaler(sws_getContext(
      frame.width, frame.height, static_cast<AVPixelFormat>(frame.format), frame.width, frame.height,
      AV_PIX_FMT_RGB24, SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr));
  const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
  sws_setColorspaceDetails(scaler.get(), bt709, 0, bt709, 1, 0, 1 << 16, 1 << 16);
  std::uint8_t* planes[] = {rgb.data(), nullptr, nullptr, nullptr};
  const int strides[] = {3 * frame.width, 0, 0, 0};
  require(sws_scale(scaler.get(), frame.data, frame.linesize, 0, frame.height, planes, strides));
  return rgb;
}

}  // namespace

Film read_film(const std::filesystem::path& file) {
  AVFormatContext* opened = nullptr;
  require(avformat_open_input(&opened, file.c_str(), nullptr, nullptr));
  const std::unique_ptr<AVFormatContext, Close> container(opened);
  require(avformat_find_stream_info(opened, nullptr));
  Film film;
  std::vector<Handle<AVCodecContext>> codecs;
  for (unsigned i = 0; i < opened->nb_streams; ++i) {
    const AVStream& stream = *opened->streams[i];
    const AVCodec* codec = avcodec_find_decoder(stream.codecpar->codec_id);
    codecs.emplace_back(avcodec_alloc_context3(codec));
    require(avcodec_parameters_to_context(codecs[i].get(), stream.codecpar));
    codecs[i]->pkt_timebase = stream.time_base;  // what AAC adds in front is cut off by it
    require(avcodec_open2(codecs[i].get(), codec, nullptr));
    const double duration_s = static_cast<double>(stream.duration) * av_q2d(stream.time_base);
    if (codecs[i]->codec_type == AVMEDIA_TYPE_VIDEO) {
      film.picture_codec = codec->name;
      film.width_px = codecs[i]->width;
      film.height_px = codecs[i]->height;
      film.picture_duration_s = duration_s;
    } else {
      film.sound_codec = codec->name;
      film.sample_rate_hz = codecs[i]->sample_rate;
      film.sound_duration_s = duration_s;
    }
  }
  const Handle<AVPacket> packet(av_packet_alloc());
  const Handle<AVFrame> frame(av_frame_alloc());
  const auto drain = [&](unsigned i) {
    const AVRational time_base = opened->streams[i]->time_base;
    while (avcodec_receive_frame(codecs[i].get(), frame.get()) == 0) {
      const double time_s = static_cast<double>(frame->pts) * av_q2d(time_base);
      if (codecs[i]->codec_type == AVMEDIA_TYPE_VIDEO) {
        film.pictures.push_back({time_s, to_rgb(*frame)});
        continue;
      }
      if (film.sound[0].empty()) film.sound_start_s = time_s;
      for (std::size_t c = 0; c < 2; ++c) {
        const auto* row = reinterpret_cast<const float*>(frame->data[c]);
        film.sound[c].insert(film.sound[c].end(), row, row + frame->nb_samples);
      }
    }
  };
  while (av_read_frame(opened, packet.get()) == 0) {
    const auto i = static_cast<unsigned>(packet->stream_index);
    require(avcodec_send_packet(codecs[i].get(), packet.get()));
    av_packet_unref(packet.get());
    drain(i);
  }
  for (unsigned i = 0; i < codecs.size(); ++i) {
    require(avcodec_send_packet(codecs[i].get(), nullptr));
    drain(i);
  }
  return film;
}

}  // namespace tactus::hal::testing
