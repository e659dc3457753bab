// The camera as the pipeline reads it: frames in order, losses counted, the way back after an unplugging.
#pragma once

#include <memory>
#include <optional>

#include "hal/camera.hpp"
#include "hal/libcamera/present/keeper.hpp"

namespace tactus::hal::libcamera {

class LibcameraColor final : public ColorCamera {
 public:
  /// Boot. `session` is the one that `keeper` opened.
  LibcameraColor(std::shared_ptr<lc::CameraManager> manager, std::unique_ptr<Wake> wake, std::unique_ptr<Keeper> keeper,
                 Session& session);

  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) override;
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override;
  void skip() override;
  [[nodiscard]] const CameraCounters& counters() const override { return counters_; }

 private:
  /// Makes held_ the next good frame. ok | timeout | corrupt | device_lost.
  rt::Status hold(rt::Duration timeout);
  /// What becomes of a frame just taken: held (ok), corrupt, or passed over (stale).
  rt::Status judge(std::uint32_t index);
  bool is_back(rt::HostTime deadline);
  rt::Status lose();
  void give_back(std::uint32_t index);
  /// Keeps the first sentence about a rejected frame.
  void say(std::uint64_t sequence, const char* what);

  std::shared_ptr<lc::CameraManager> manager_;  // destroyed after all that uses it
  std::unique_ptr<Wake> wake_;
  std::unique_ptr<Keeper> keeper_;
  Session* session_;  // null while the camera is away
  std::optional<std::uint32_t> held_;
  FrameHeader header_;                // of the held frame
  std::uint64_t sequence_base_ = 0;   // what is added to the session's numbers
  std::uint64_t sequence_next_ = 0;   // the smallest that may come
  bool has_begun_ = false;
  rt::SensorTime time_last_;
  rt::HostTime next_search_;
  CameraCounters counters_;
};

}  // namespace tactus::hal::libcamera
