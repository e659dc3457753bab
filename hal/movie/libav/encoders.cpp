#include "hal/movie/libav/encoders.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::hal::libav {
namespace {

constexpr int kPixelFormat = AV_PIX_FMT_YUV420P;
constexpr std::int64_t kSoundBitRateBps = 160000;
// MPEG-4 part 2 keeps a picture's time in 16 bits; 30000 / 1001 fits.
constexpr int kTimeBaseMax = 65535;
constexpr double kKeyPictureEveryS = 2;  // how far a player jumps wrong at most

rt::Error unavailable(std::string what) {
  return {rt::ExitCode::device_unavailable,
          "no film can be written: " + std::move(what) + "; run without a film."};
}
rt::Error bad_usage(std::string what) { return {rt::ExitCode::bad_usage, std::move(what)}; }

const AVCodec* find_first(std::span<const char* const> names) {
  for (const char* name : names)
    if (const AVCodec* codec = avcodec_find_encoder_by_name(name)) return codec;
  return nullptr;
}

Handle<AVCodecContext> make_context(const AVCodec* codec) {
  Handle<AVCodecContext> context(avcodec_alloc_context3(codec));
  if (context == nullptr) return context;
  // One thread and no version strings: the same input gives the same bytes, and no core is taken from
  // tracking.
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_BITEXACT | AV_CODEC_FLAG_GLOBAL_HEADER;
  return context;
}

rt::Result<Encoder> open(Handle<AVCodecContext> codec, Handle<AVFrame> frame, AVDictionary* options) {
  const int status = avcodec_open2(codec.get(), nullptr, &options);
  av_dict_free(&options);
  if (status < 0)
    return unavailable(std::string("the encoder ") + codec->codec->name + " does not open (" +
                       words_of(status) + ")");
  if (codec->codec_type == AVMEDIA_TYPE_AUDIO) frame->nb_samples = codec->frame_size;
  if (av_frame_get_buffer(frame.get(), 0) < 0) return unavailable("out of memory");
  return Encoder{std::move(codec), std::move(frame)};
}

}  // namespace

rt::Result<Encoder> open_picture_encoder(const MovieFormat& format) {
  if (format.width_px < 2 || format.height_px < 2 || format.width_px % 2 != 0 || format.height_px % 2 != 0)
    return bad_usage("a film of " + std::to_string(format.width_px) + " x " +
                     std::to_string(format.height_px) +
                     " pixels cannot be written; both numbers must be even and at least 2.");
  if (!(format.frame_rate_hz >= 1 && format.frame_rate_hz <= 1000))
    return bad_usage("a film of " + std::to_string(format.frame_rate_hz) +
                     " pictures a second cannot be written; name 1 to 1000.");
  const AVCodec* found = find_first(format.picture_encoders);
  if (found == nullptr) {
    std::string names;
    for (const char* name : format.picture_encoders) names += (names.empty() ? "" : ", ") + std::string(name);
    return unavailable("this machine's libavcodec has none of the encoders " + names);
  }
  auto codec = make_context(found);
  Handle<AVFrame> frame(av_frame_alloc());
  if (codec == nullptr || frame == nullptr) return unavailable("out of memory");
  codec->width = frame->width = format.width_px;
  codec->height = frame->height = format.height_px;
  codec->pix_fmt = static_cast<AVPixelFormat>(kPixelFormat);
  frame->format = kPixelFormat;
  codec->framerate = av_d2q(format.frame_rate_hz, kTimeBaseMax);
  codec->time_base = av_inv_q(codec->framerate);
  codec->color_range = AVCOL_RANGE_MPEG;
  codec->colorspace = AVCOL_SPC_BT709;
  codec->color_primaries = AVCOL_PRI_BT709;
  codec->color_trc = AVCOL_TRC_BT709;
  codec->gop_size = std::max(1, static_cast<int>(std::lround(kKeyPictureEveryS * format.frame_rate_hz)));
  // In the order of showing: the last packet's length is then the last picture's, and the film begins at 0
  // everywhere.
  codec->max_b_frames = 0;
  AVDictionary* options = nullptr;
  if (found->id == AV_CODEC_ID_H264) {
    av_dict_set(&options, "preset", "veryfast", 0);
    av_dict_set(&options, "crf", "20", 0);
  } else {
    codec->flags |= AV_CODEC_FLAG_QSCALE;
    codec->global_quality = 3 * FF_QP2LAMBDA;
  }
  return open(std::move(codec), std::move(frame), options);
}

Handle<SwsContext> make_colour_converter(const MovieFormat& format) {
  Handle<SwsContext> scaler(
      sws_getContext(format.width_px, format.height_px, AV_PIX_FMT_RGB24, format.width_px, format.height_px,
                     static_cast<AVPixelFormat>(kPixelFormat), SWS_AREA | SWS_ACCURATE_RND | SWS_BITEXACT,
                     nullptr, nullptr, nullptr));
  if (scaler != nullptr) {
    const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
    sws_setColorspaceDetails(scaler.get(), bt709, 1, bt709, 0, 0, 1 << 16, 1 << 16);
  }
  return scaler;
}

rt::Result<Encoder> open_sound_encoder(const SoundFormat& format) {
  if (format.channels_count != 2)
    return bad_usage("a film's sound has 2 channels or, without sound, 0, not " +
                     std::to_string(format.channels_count) + ".");
  const AVCodec* found = avcodec_find_encoder(AV_CODEC_ID_AAC);
  if (found == nullptr) return unavailable("this machine's libavcodec has no AAC");
  const int* rate_hz = found->supported_samplerates;
  while (rate_hz != nullptr && *rate_hz != 0 && *rate_hz != format.sample_rate_hz) ++rate_hz;
  if (rate_hz != nullptr && *rate_hz == 0)
    return bad_usage("a film's sound cannot have " + std::to_string(format.sample_rate_hz) +
                     " samples a second; 48000 and 44100 are possible.");
  auto codec = make_context(found);
  Handle<AVFrame> frame(av_frame_alloc());
  if (codec == nullptr || frame == nullptr) return unavailable("out of memory");
  codec->sample_rate = frame->sample_rate = format.sample_rate_hz;
  codec->sample_fmt = AV_SAMPLE_FMT_FLTP;
  frame->format = AV_SAMPLE_FMT_FLTP;
  av_channel_layout_default(&codec->ch_layout, format.channels_count);
  av_channel_layout_default(&frame->ch_layout, format.channels_count);
  codec->time_base = {1, format.sample_rate_hz};
  codec->bit_rate = kSoundBitRateBps;
  return open(std::move(codec), std::move(frame), nullptr);
}

}  // namespace tactus::hal::libav
