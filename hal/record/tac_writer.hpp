// The recorder: takes frames from the thread that reads the cameras, and writes them on a thread of its own.
//
//   reading thread --take(): copies--> [ring, sized at create()] --writer thread--> filter, zstd or JPEG --> one write
//
// Memory does not grow, whatever the disk does: what finds no room in the ring is dropped and counted, in the file too.
// Once a second what is written is handed to the disk (fdatasync): that is the most a power cut can take, where the kernel
// by itself would wait for half a minute; more often would keep flash busy with its own tables. A killed process loses
// only what was still in the ring.
#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "hal/camera.hpp"
#include "hal/record/chunk_file.hpp"
#include "hal/record/packer.hpp"
#include "hal/record/record_ring.hpp"
#include "hal/record/tac.hpp"
#include "rt/thread.hpp"

namespace tactus::hal::record {

enum class TacColor : std::uint8_t {
  as_it_came,  // lossless: mjpeg as it is, the others by differences and zstd
  jpeg         // mjpeg as it is, the others encoded: a tenth of the size
};

struct TacOptions {
  TacColor color = TacColor::as_it_came;
  int jpeg_quality = 95;
  /// Frames of either stream that may wait for the writer: half a second at 30 Hz, for a disk that is busy with a sync.
  std::size_t frames_waiting = 16;
  /// take() waits for room instead of dropping: for sources that wait themselves, such as files.
  bool waits_when_full = false;
};

class TacWriter final : public FrameTap {
 public:
  /// Creates the file and writes what is known of `sensor`: calibration, rate, gravity, true poses. The sensor is not
  /// kept; its cameras take the writer as their tap. Errors: bad_usage when the file exists; failed. Boot.
  static rt::Result<std::unique_ptr<TacWriter>> create(const std::filesystem::path& path, const Sensor& sensor,
                                                       const TacInfo& info, const TacOptions& options);
  /// Closes; close() would have said what went wrong.
  ~TacWriter() override;

  /// Copies the frame into the ring. No heap, no lock; one system call when the writer waits. A frame that finds no room,
  /// or comes after the recording has stopped, is counted as dropped; one that is not whole or not of the calibration's
  /// size as refused. One thread for both streams.
  void take(Stream stream, const RawFrame& frame) noexcept override;
  /// The material ids of the depth frame with this number, width * height of them. False: no room, or stopped. As take().
  bool add_labels(std::uint64_t sequence, std::span<const std::uint8_t> material_ids) noexcept;

  /// Writes what waits, the index and the end. One sentence when not all could be written, by a full disk say: what was
  /// written before can be played. Later calls answer the same. After the last take(), on any thread; may wait.
  rt::Result<void> close();

  /// Whether the writing has stopped, by a failure or close(): close() says why. Any thread.
  [[nodiscard]] bool has_stopped() const noexcept;

  struct Counts {
    std::array<EndCounts::OfStream, 2> streams;  // by Stream
    std::uint64_t file_bytes = 0;
  };
  /// So far. Any thread, wait-free.
  [[nodiscard]] Counts was() const noexcept;
  /// Ring, scratch and compressors, all taken at create().
  [[nodiscard]] std::size_t buffers_bytes() const { return buffers_bytes_; }

 private:
  struct Record;  // at the front of each record in the ring
  TacWriter(std::unique_ptr<ChunkFile> file, const Sensor& sensor, const TacOptions& options);
  rt::Result<void> start(const Sensor& sensor, const TacInfo& info);
  [[nodiscard]] std::span<std::uint8_t> room_for(std::size_t bytes) noexcept;
  void hand_over() noexcept;
  void write_until_closed();
  void write_record(std::span<const std::uint8_t> record);
  void write_frame(const Record& record, std::span<const std::uint8_t> bytes);
  bool to_jpeg(const Record& record, std::span<const std::uint8_t> bytes);

  /// Of one stream. Relaxed: each is a number of its own that publishes nothing.
  struct Tally {
    std::atomic<std::uint64_t> written{0}, dropped{0}, refused{0};
  };

  std::unique_ptr<ChunkFile> file_;  // the writer thread's while it runs
  TacOptions options_;
  std::array<FrameSize, 2> sizes_;  // by Stream; color: 0 when there is none
  RecordRing ring_;
  Packer depth_packer_;
  std::unique_ptr<Packer> color_packer_;
  std::vector<std::uint8_t> rgb_, jpeg_;
  std::size_t buffers_bytes_ = 0;
  std::array<Tally, 2> tallies_;
  std::atomic<std::uint64_t> file_bytes_{0};
  std::atomic<bool> has_stopped_{false}, is_closing_{false};
  sem_t filled_, freed_;  // a token per record in the ring and one for the end; one per record taken out
  rt::HostTime synced_;
  bool is_closed_ = false;
  rt::Result<void> closed_;
  rt::RtThread thread_;
};

}  // namespace tactus::hal::record
