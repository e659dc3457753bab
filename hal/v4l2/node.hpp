// A /dev/video node: opened, asked who it is and what it offers, and found again under another number. What a lost device
// needs while running (open_node, read_info, find_node) makes no heap call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/v4l2/modes.hpp"

namespace tactus::hal::v4l2 {

/// A file descriptor with one owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor() { close(); }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  void close() noexcept;

 private:
  int fd_ = -1;
};

/// ioctl, again when a signal interrupts it. 0, or the error's number.
int call(int fd, unsigned long request, void* argument) noexcept;

/// Who a node is. Text as the driver says it, 0 at the end.
struct NodeInfo {
  std::array<char, 16> driver{};
  std::array<char, 32> card{};
  std::array<char, 32> bus_info{};
  std::uint32_t capabilities = 0;  // of this node
  int index = -1;                  // which of its device's nodes, from sysfs; -1: unknown

  [[nodiscard]] bool is_capture() const;      // of images, and not a codec's
  [[nodiscard]] bool is_multiplanar() const;  // captures through the multi-planar calls only
  [[nodiscard]] bool is_metadata() const;
};

using NodePath = std::array<char, 288>;

/// Opens without waiting for frames. errno's number in `error`.
Descriptor open_node(const char* path, int& error) noexcept;

/// 0, or the error's number.
int read_info(int fd, NodeInfo& info) noexcept;

/// Opens the node of the same driver at the same bus with this index that `is_wanted`; looks at the first 256 numbers, opens
/// only nodes with the right index. Its path goes to `path`. Not open: there is none.
Descriptor find_node(const NodeInfo& wanted, bool (NodeInfo::*is_wanted)() const, NodePath& path) noexcept;

/// What `text` has room for of a file; empty: there is none. No heap.
std::string_view read_file(const char* path, std::span<char> text) noexcept;

/// The text of a small file of sysfs beside the node behind `fd`, such as "index" or "device/../descriptors", read into
/// `text`; empty: none. No heap.
std::string_view read_beside(int fd, const char* file, std::span<char> text) noexcept;

/// All formats with sizes and intervals. Ranges of sizes tell the intervals at the size nearest to `mode`'s. Boot.
std::vector<FormatOffer> enumerate_offers(int fd, bool is_multiplanar, const ModeRequest& mode);

/// "/dev/video0 (Card)" for sentences. Boot.
std::string name_for_people(std::string_view path, const NodeInfo& info);

/// Why a node did not open, in one sentence that says what to do. Boot.
std::string open_trouble(const std::string& path, int error);

}  // namespace tactus::hal::v4l2
