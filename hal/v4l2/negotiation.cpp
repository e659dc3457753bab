#include "hal/v4l2/negotiation.hpp"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "hal/frames/convert.hpp"
#include "hal/v4l2/fourcc.hpp"

namespace tactus::hal::v4l2 {
namespace {

/// What a format says, whichever of the two calls it came by.
struct Facts {
  std::uint32_t fourcc, width, height, row_bytes, image_bytes, planes_count, field, colorspace, encoding, quantization;
};

Facts facts_of(const v4l2_format& format) {
  if (format.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
    const v4l2_pix_format_mplane& p = format.fmt.pix_mp;
    return {p.pixelformat, p.width,      p.height, p.plane_fmt[0].bytesperline, p.plane_fmt[0].sizeimage,
            p.num_planes,  p.field,      p.colorspace, p.ycbcr_enc,             p.quantization};
  }
  const v4l2_pix_format& p = format.fmt.pix;
  return {p.pixelformat, p.width, p.height, p.bytesperline, p.sizeimage, 1, p.field, p.colorspace, p.ycbcr_enc,
          p.quantization};
}

v4l2_format format_of(const ModeChoice& choice, bool is_multiplanar) {
  v4l2_format format{};
  const auto width = static_cast<std::uint32_t>(choice.width), height = static_cast<std::uint32_t>(choice.height);
  if (is_multiplanar) {
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    format.fmt.pix_mp.width = width;
    format.fmt.pix_mp.height = height;
    format.fmt.pix_mp.pixelformat = choice.fourcc;
    format.fmt.pix_mp.field = V4L2_FIELD_NONE;
    format.fmt.pix_mp.num_planes = 1;
  } else {
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = width;
    format.fmt.pix.height = height;
    format.fmt.pix.pixelformat = choice.fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
  }
  return format;
}

rt::Error unavailable(std::string message) { return {rt::ExitCode::device_unavailable, std::move(message)}; }

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

std::string hz_text(double hz) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g Hz", hz);
  return text;
}

/// What of the driver's answer cannot be worked with; empty: nothing.
std::string fault_of(const Facts& facts, const ModeChoice& choice) {
  const auto width = static_cast<std::uint32_t>(choice.width), height = static_cast<std::uint32_t>(choice.height);
  if (facts.fourcc != choice.fourcc || facts.width != width || facts.height != height)
    return "offers " + fourcc_text(choice.fourcc) + " " + size_text(width, height) + " but sets " +
           fourcc_text(facts.fourcc) + " " + size_text(facts.width, facts.height) + "; ask for that";
  if (facts.planes_count != 1) return "spreads a frame over several planes, which is not supported; choose another format";
  if (facts.field != V4L2_FIELD_NONE && facts.field != V4L2_FIELD_ANY)
    return "gives interlaced frames, which is not supported; choose another input of it";
  const std::size_t image_bytes = frames::packed_bytes(choice.format, choice.width, choice.height);
  if (facts.image_bytes == 0 || facts.image_bytes < image_bytes)
    return "announces frames of " + std::to_string(facts.image_bytes) + " bytes, too few for " + fourcc_text(facts.fourcc) +
           " " + size_text(width, height) + "; its driver is broken";
  return {};
}

/// Colour is converted as BT.601 limited range on every machine; what else the driver says of it, a person should know.
void note_color(const Facts& facts, PixelFormat format, std::vector<std::string>& notes) {
  if (format != PixelFormat::yuyv && format != PixelFormat::nv12) return;
  std::uint32_t encoding = facts.encoding;
  if (encoding == V4L2_YCBCR_ENC_DEFAULT) encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(facts.colorspace);
  const bool is_full = facts.quantization == V4L2_QUANTIZATION_FULL_RANGE;
  if (encoding == V4L2_YCBCR_ENC_601 && !is_full) return;
  notes.push_back(std::string("the device's colour is ") + (encoding == V4L2_YCBCR_ENC_601 ? "BT.601" : "not BT.601") +
                  (is_full ? " in full range" : " in limited range") +
                  "; it is converted as BT.601 in limited range, so shades are a little off");
}

bool set_interval(int fd, std::uint32_t type, Interval& interval) noexcept {
  v4l2_streamparm parameters{};
  parameters.type = type;
  if (call(fd, VIDIOC_G_PARM, &parameters) != 0) return false;
  v4l2_captureparm& capture = parameters.parm.capture;
  if ((capture.capability & V4L2_CAP_TIMEPERFRAME) == 0) return false;
  if (interval.denominator != 0) {
    capture.timeperframe = {interval.numerator, interval.denominator};
    if (call(fd, VIDIOC_S_PARM, &parameters) != 0) return false;
  }
  interval = {capture.timeperframe.numerator, capture.timeperframe.denominator};
  return true;
}

}  // namespace

std::uint32_t Agreement::fourcc() const { return facts_of(format).fourcc; }

rt::Result<Agreement> agree(int fd, const NodeInfo& info, const ModeWish& wish, std::string_view device) {
  const std::string who(device);
  const bool is_multiplanar = info.is_multiplanar();
  const auto choice = choose_mode(enumerate_offers(fd, is_multiplanar, wish.mode), wish, device);
  if (!choice) return choice.error();

  Agreement out;
  out.format = format_of(*choice, is_multiplanar);
  if (const int error = call(fd, VIDIOC_S_FMT, &out.format); error != 0)
    return unavailable(error == EBUSY ? who + " is in use by another program; close it first"
                                      : who + " refuses " + fourcc_text(choice->fourcc) + ": " + std::strerror(error));
  const Facts facts = facts_of(out.format);
  if (const std::string fault = fault_of(facts, *choice); !fault.empty()) return unavailable(who + " " + fault);
  out.pixel_format = choice->format;
  out.width = choice->width;
  out.height = choice->height;
  out.image_bytes = facts.image_bytes;
  // Some drivers leave the row's length out where no padding is possible.
  const std::size_t packed_row_bytes = frames::packed_bytes(choice->format, choice->width, 1) /
                                       (choice->format == PixelFormat::nv12 ? 2 : 1);
  if (choice->format != PixelFormat::mjpeg) out.row_bytes = facts.row_bytes > 0 ? facts.row_bytes : packed_row_bytes;

  out.interval = choice->interval;
  const bool is_set = set_interval(fd, out.format.type, out.interval);
  if (is_set && out.interval.hz() > 0) out.frame_rate_hz = out.interval.hz();
  const double wished_hz = wish.mode.frame_rate_hz;
  if (wished_hz > 0 && !is_set)
    return unavailable(who + " does not let its frame rate be set; leave the rate out");
  if (wished_hz > 0 && std::fabs(out.frame_rate_hz - wished_hz) > 0.01 * wished_hz)
    return unavailable(who + " was asked for " + hz_text(wished_hz) + " and sets " + hz_text(out.frame_rate_hz) +
                       "; ask for that, or for another size");
  if (!is_set) {
    out.interval = {};
    out.notes.push_back("the driver does not tell its frame rate; 30 Hz is assumed");
  }
  note_color(facts, out.pixel_format, out.notes);
  return out;
}

bool restore(int fd, const Agreement& agreement) noexcept {
  v4l2_format format = agreement.format;
  if (call(fd, VIDIOC_S_FMT, &format) != 0) return false;
  const Facts now = facts_of(format), before = facts_of(agreement.format);
  if (now.fourcc != before.fourcc || now.width != before.width || now.height != before.height ||
      now.row_bytes != before.row_bytes || now.image_bytes > before.image_bytes)
    return false;
  Interval interval = agreement.interval;
  if (interval.denominator != 0) (void)set_interval(fd, format.type, interval);
  return true;
}

}  // namespace tactus::hal::v4l2
