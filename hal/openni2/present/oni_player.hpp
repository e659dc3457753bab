// One stream of an .oni file, played by the library frame after frame: as fast as it is read and without loss.
#pragma once

#include <OniCAPI.h>

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "hal/openni2/present/frame_buffers.hpp"
#include "hal/openni2/present/library.hpp"

namespace tactus::hal::openni2 {

/// Whether it is one that OniPlayer gave to the library.
bool is_recording_uri(const char* uri);

/// The library's player reads both streams of a file together and drops of one what was not taken while the other was
/// read. So each stream has a player of its own, and the player finds no memory for a frame before the last one was taken.
/// Thread-bound; the library's calls are made by its own thread.
class OniPlayer {
 public:
  /// `frame_bytes`: of a frame without compression. Error bad_input: the library refuses the file. Boot.
  static rt::Result<std::unique_ptr<OniPlayer>> open(const std::filesystem::path& file, OniSensorType sensor,
                                                     std::size_t frame_bytes);
  OniPlayer(const OniPlayer&) = delete;
  OniPlayer& operator=(const OniPlayer&) = delete;
  ~OniPlayer();

  /// The next frame, valid until the next call; null when the player has given none for five seconds.
  const OniFrame* next();

 private:
  /// Lets the player's thread have one buffer at a time; given to the library as its allocator.
  class Gate {
   public:
    explicit Gate(std::size_t frame_bytes) : buffers(frame_bytes, 3) {}
    void* take(std::size_t bytes);
    void open_once();
    void open_for_good();
    FrameBuffers buffers;

   private:
    std::mutex mutex_;  // guards the others
    std::condition_variable opened_;
    bool is_frame_untaken_ = false, is_closing_ = false;
  };

  OniPlayer(Library& library, int file, std::size_t frame_bytes);
  rt::Result<void> start(OniSensorType sensor, const std::string& name);
  bool start_stream(const std::string& uri, OniSensorType sensor);

  Library& library_;
  int file_;
  Gate gate_;
  OniDeviceHandle device_ = nullptr;
  OniStreamHandle stream_ = nullptr;
  OniFrame* frame_ = nullptr;
};

}  // namespace tactus::hal::openni2
