// A recording being read: which chunks it holds and where, whatever became of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/camera.hpp"
#include "hal/record/chunk.hpp"
#include "hal/record/file_header.hpp"
#include "rt/status.hpp"

namespace tactus::hal::record {

/// Immutable once open: any number of threads reads chunks.
class TacFile {
 public:
  /// By the index where there is a whole one, else by the header of each chunk. Errors as open_tac. Boot.
  static rt::Result<std::shared_ptr<const TacFile>> open(const std::filesystem::path& path);
  ~TacFile();
  TacFile(const TacFile&) = delete;
  TacFile& operator=(const TacFile&) = delete;

  /// Reads the chunk into `buffer`, which must have chunk_bytes(), and checks it. `payload` lies in the buffer. Null, or
  /// what is wrong. No heap. Any thread.
  const char* read_chunk(const IndexEntry& entry, std::span<std::uint8_t> buffer,
                         std::span<const std::uint8_t>& payload) const;
  /// 0 for one that is too large to be read.
  static std::size_t chunk_bytes(const IndexEntry& entry);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const FileHeader& header() const { return header_; }
  /// Frames, labels and truth, in the order of the file.
  [[nodiscard]] const std::vector<IndexEntry>& entries() const { return entries_; }
  /// The true poses that are sound: finite, later than the one before.
  [[nodiscard]] const std::vector<TruthPose>& truth() const { return truth_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t chunks_count() const { return chunks_count_; }
  /// Nothing when the recording was cut off.
  [[nodiscard]] const std::optional<EndCounts>& end() const { return end_; }
  [[nodiscard]] std::uint64_t damaged_bytes() const { return damaged_bytes_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  TacFile(std::filesystem::path path, int descriptor, std::uint64_t bytes);
  bool read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) const;
  [[nodiscard]] std::optional<ChunkHeader> header_at(std::uint64_t offset) const;
  std::optional<std::vector<std::uint8_t>> payload_of(const IndexEntry& entry) const;
  rt::Result<void> read_file_header();
  void find_end();
  bool read_index();
  void scan();
  [[nodiscard]] std::uint64_t next_chunk_after(std::uint64_t offset) const;
  void drop_unwritten_tail();
  void read_truth();

  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t bytes_, first_offset_ = 0;  // of the chunk after the header's
  FileHeader header_;
  std::vector<IndexEntry> entries_;
  std::vector<TruthPose> truth_;
  std::uint64_t chunks_count_ = 0, damaged_bytes_ = 0;
  std::optional<EndCounts> end_;
  std::vector<std::string> notes_;
};

}  // namespace tactus::hal::record
