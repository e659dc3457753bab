#include "tests/guest/usb_camera/descriptors.hpp"

#include <initializer_list>

namespace tactus::guest {
namespace {

// Descriptor types and subtypes (USB 2.0 table 9-5, UVC 1.0 tables ).
enum : std::uint8_t { kDevice = 1, kConfiguration = 2, kString = 3, kInterface = 4, kEndpoint = 5, kAssociation = 11 };
constexpr std::uint8_t kClassInterface = 0x24;
enum : std::uint8_t { kControlHeader = 1, kInputTerminal = 2, kOutputTerminal = 3, kProcessingUnit = 5 };
enum : std::uint8_t { kInputHeader = 1, kUncompressedFormat = 4, kUncompressedFrame = 5, kColorMatching = 13 };
constexpr std::uint8_t kVideoClass = 14, kControlSubclass = 1, kStreamingSubclass = 2, kCollectionSubclass = 3;

class Writer {
 public:
  Writer& u8(std::initializer_list<unsigned> values) {
    for (const unsigned value : values) bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Writer& u16(std::uint32_t value) { return u8({value & 255, value >> 8 & 255}); }
  Writer& u32(std::uint32_t value) { return u16(value & 65535).u16(value >> 16); }
  Writer& append(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

// A whole descriptor; its length goes before it.
Bytes with_length(Bytes rest) {
  rest.insert(rest.begin(), static_cast<std::uint8_t>(rest.size() + 1));
  return rest;
}

// Entity numbers: a camera and a way out for each stream, colour through its processing unit.
unsigned camera_id(std::size_t stream) { return static_cast<unsigned>(3 * stream + 1); }
unsigned output_id(std::size_t stream) { return static_cast<unsigned>(3 * stream + 3); }

Bytes control_class(const CameraSpec& camera) {
  Writer terminals;
  for (std::size_t i = 0; i < camera.streams.size(); ++i) {
    const bool is_processed = camera.streams[i].format == hal::PixelFormat::yuyv;
    const unsigned source = is_processed ? processing_unit_of(i) : camera_id(i);
    // A camera without a lens that can be moved and without controls.
    terminals.append(with_length(Writer()
                                     .u8({kClassInterface, kInputTerminal, camera_id(i)})
                                     .u16(0x0201)
                                     .u8({0, 0})
                                     .u16(0).u16(0).u16(0)
                                     .u8({3, 0, 0, 0})
                                     .take()));
    if (is_processed) {
      terminals.append(with_length(Writer()
                                       .u8({kClassInterface, kProcessingUnit, processing_unit_of(i), camera_id(i)})
                                       .u16(0)
                                       .u8({2, 1, 0, 0})
                                       .take()));
    }
    terminals.append(with_length(
        Writer().u8({kClassInterface, kOutputTerminal, output_id(i)}).u16(0x0101).u8({0, source, 0}).take()));
  }
  const Bytes rest = terminals.take();
  const std::size_t header_bytes = 12 + camera.streams.size();
  Writer header;
  header.u8({kClassInterface, kControlHeader}).u16(0x0100);
  header.u16(static_cast<std::uint32_t>(header_bytes + rest.size())).u32(kClock_hz);
  header.u8({static_cast<unsigned>(camera.streams.size())});
  for (std::size_t i = 0; i < camera.streams.size(); ++i) header.u8({interface_of(i)});
  return Writer().append(with_length(header.take())).append(rest).take();
}

// The first four bytes of the format's GUID; the rest is that of all FourCC codes.
Bytes format_guid(hal::PixelFormat format) {
  const bool is_depth = format == hal::PixelFormat::depth16;
  Writer guid;
  guid.append(is_depth ? Bytes{'Z', '1', '6', ' '} : Bytes{'Y', 'U', 'Y', '2'});
  return guid.u8({0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71}).take();
}

Bytes streaming_class(const CameraSpec& camera, std::size_t stream) {
  const StreamSpec& spec = camera.streams[stream];
  Writer format;
  format.append(with_length(Writer()
                                .u8({kClassInterface, kUncompressedFormat, 1, 1})
                                .append(format_guid(spec.format))
                                .u8({16, 1, 0, 0, 0, 0})
                                .take()));
  const auto bits_per_second = [&](std::uint32_t interval) {
    return static_cast<std::uint32_t>(std::uint64_t{spec.frame_bytes()} * 8 * 10'000'000 / interval);
  };
  std::uint32_t shortest = camera.frame_intervals.front(), longest = shortest;
  for (const std::uint32_t interval : camera.frame_intervals) {
    shortest = interval < shortest ? interval : shortest;
    longest = interval > longest ? interval : longest;
  }
  Writer frame;
  frame.u8({kClassInterface, kUncompressedFrame, 1, 0});
  frame.u16(static_cast<std::uint32_t>(spec.width)).u16(static_cast<std::uint32_t>(spec.height));
  frame.u32(bits_per_second(longest)).u32(bits_per_second(shortest)).u32(spec.frame_bytes());
  frame.u32(camera.frame_intervals.front()).u8({static_cast<unsigned>(camera.frame_intervals.size())});
  for (const std::uint32_t interval : camera.frame_intervals) frame.u32(interval);
  format.append(with_length(frame.take()));
  // BT.709 primaries and transfer, the matrix of BT.601.
  format.append(with_length(Writer().u8({kClassInterface, kColorMatching, 1, 1, 4}).take()));
  const Bytes rest = format.take();

  constexpr std::size_t kHeaderBytes = 14;
  Writer header;
  header.u8({kClassInterface, kInputHeader, 1}).u16(static_cast<std::uint32_t>(kHeaderBytes + rest.size()));
  header.u8({0x80U | endpoint_of(stream), 0, output_id(stream), 0, 0, 0, 1, 0});
  return Writer().append(with_length(header.take())).append(rest).take();
}

Bytes interface(unsigned number, unsigned endpoints_count, unsigned subclass) {
  return with_length(Writer().u8({kInterface, number, 0, endpoints_count, kVideoClass, subclass, 0, 0}).take());
}

}  // namespace

Bytes device_descriptor() {
  // Vendor and product are those that pid.codes keeps for tests; strings 1, 2, 3.
  return with_length(Writer()
                         .u8({kDevice})
                         .u16(0x0200)
                         .u8({0xef, 2, 1, 64})
                         .u16(0x1209).u16(0x0001).u16(0x0100)
                         .u8({1, 2, 3, 1})
                         .take());
}

Bytes configuration_descriptor(const CameraSpec& camera) {
  const auto streams_count = static_cast<unsigned>(camera.streams.size());
  Writer body;
  body.append(with_length(Writer().u8({kAssociation, 0, streams_count + 1, kVideoClass, kCollectionSubclass, 0, 0}).take()));
  body.append(interface(0, 0, kControlSubclass)).append(control_class(camera));
  for (std::size_t i = 0; i < camera.streams.size(); ++i) {
    body.append(interface(interface_of(i), 1, kStreamingSubclass)).append(streaming_class(camera, i));
    body.append(with_length(Writer().u8({kEndpoint, 0x80U | endpoint_of(i), 2}).u16(512).u8({0}).take()));
  }
  const Bytes rest = body.take();
  constexpr std::size_t kHeaderBytes = 9;
  Writer header;
  header.u8({kConfiguration}).u16(static_cast<std::uint32_t>(kHeaderBytes + rest.size()));
  header.u8({streams_count + 1, 1, 0, 0x80, 50});  // powered by the bus, 100 mA
  return Writer().append(with_length(header.take())).append(rest).take();
}

Bytes string_descriptor(const CameraSpec& camera, std::uint8_t index) {
  if (index == 0) return {4, kString, 0x09, 0x04};  // US English alone
  const std::string text = index == 1 ? "tactus" : index == 2 ? camera.name : index == 3 ? camera.serial_number : "";
  if (text.empty()) return {};
  Writer letters;
  letters.u8({kString});
  for (const char letter : text) letters.u8({static_cast<unsigned char>(letter), 0});
  return with_length(letters.take());
}

}  // namespace tactus::guest
