// A recording being written: whole chunks, one after the other, and the index of them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/record/chunk.hpp"
#include "rt/status.hpp"

namespace tactus::hal::record {

/// Thread-bound. After a failure the file ends with its last whole chunk, and nothing more is appended but its end.
class ChunkFile {
 public:
  /// Creates the file, its magic and its name in the folder on disk. bad_usage when it exists; failed when it cannot be
  /// written.
  static rt::Result<std::unique_ptr<ChunkFile>> create(const std::filesystem::path& path);
  ~ChunkFile();
  ChunkFile(const ChunkFile&) = delete;
  ChunkFile& operator=(const ChunkFile&) = delete;

  /// Writes one chunk in one system call, so that a killed process leaves at most one torn; fills in payload_bytes and
  /// the checksums. Frames, labels and truth go to the index, which is written when kIndexEntries have come. False when it
  /// cannot be written.
  bool append(ChunkHeader header, std::span<const std::uint8_t> payload);
  /// Hands what is written to the disk and waits for it. False when that fails.
  bool sync();
  /// Last index, end and sync. After a failure it is tried too: what the torn chunk gave back is often room enough. False
  /// when it cannot be written.
  bool finish(const std::array<EndCounts::OfStream, 2>& streams);

  /// One sentence; empty while all is well.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] std::uint64_t bytes() const { return end_; }
  [[nodiscard]] std::size_t memory_bytes() const { return index_.capacity(); }

 private:
  ChunkFile(std::filesystem::path path, int descriptor);
  bool write(std::span<const std::uint8_t> first, std::span<const std::uint8_t> second);
  bool write_chunk(ChunkHeader header, std::span<const std::uint8_t> payload);
  bool write_index();
  bool fail(int error);

  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t end_ = 0;  // behind the last whole chunk
  std::uint64_t chunks_count_ = 0, last_index_offset_ = 0;
  std::vector<std::uint8_t> index_;  // the payload of the index to be written next
  std::string failure_;
};

}  // namespace tactus::hal::record
