// Which of a device's modes are ours to use, and which one is meant.
#pragma once

#include <OniCAPI.h>

#include <optional>
#include <span>
#include <string>

#include "hal/live_camera.hpp"
#include "hal/raw_frame.hpp"

namespace tactus::hal::openni2 {

/// Nothing for formats that are no metric depth or that the pipeline cannot convert.
std::optional<PixelFormat> format_of(OniPixelFormat format);

/// "depth 1 mm 640x480 30 Hz"
std::string to_string(const OniVideoMode& mode);

/// The mode with what is asked for, of one kind (depth or colour); where several fit, the one that is set, then 640x480 at
/// 30 Hz, then the first. Nothing when none fits.
std::optional<OniVideoMode> choose_mode(std::span<const OniVideoMode> modes, const OniVideoMode& current,
                                        const ModeRequest& request);

/// Colour beside a depth mode: its size and rate where there is such a mode, else its size, else any.
std::optional<OniVideoMode> choose_color_mode(std::span<const OniVideoMode> modes, const OniVideoMode& current,
                                              const OniVideoMode& depth);

}  // namespace tactus::hal::openni2
