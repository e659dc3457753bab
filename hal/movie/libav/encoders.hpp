// Opens the two encoders of a film and makes the frames that they take.
#pragma once

#include <cstdint>
#include <span>

#include "hal/movie/libav/handles.hpp"
#include "hal/movie/movie_writer.hpp"

namespace tactus::hal::libav {

/// An open encoder and the one frame that its input goes through.
struct Encoder {
  Handle<AVCodecContext> codec;
  Handle<AVFrame> frame;
};

/// BT.709, 4:2:0, one thread, time base 1 / frame rate. Errors: bad_usage, device_unavailable.
rt::Result<Encoder> open_picture_encoder(const MovieFormat& format);
/// From 8-bit RGB to the encoder's frame. Null: out of memory.
Handle<SwsContext> make_colour_converter(const MovieFormat& format);

/// AAC, 160 kbit/s, time base 1 / sample rate. Errors: bad_usage, device_unavailable.
rt::Result<Encoder> open_sound_encoder(const SoundFormat& format);

}  // namespace tactus::hal::libav
