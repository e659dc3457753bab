// One session of the pipeline under either runner.
#pragma once

#include <atomic>
#include <cstdint>

#include "firmware_host/presenter.hpp"
#include "firmware_host/recorder.hpp"
#include "pipeline/pipeline.hpp"
#include "rt/clock.hpp"

namespace tactus::firmware {

/// Set by SIGINT and SIGTERM: the session ends after the frame at hand.
extern std::atomic<bool> interrupted;
/// Boot, before files are written: from here on these signals end the session, not the program, and a file
/// that grows beyond what the system allows is a write that fails. Forgets an interruption of a session
/// before.
void catch_signals();

/// One thread, fixed order, nothing dropped; virtual time advances by the sensor's frame interval. A device that goes away
/// is waited for, 30 s at most; then the session ends as at the source's end. Returns wall seconds.
double run_lockstep(Pipeline& pipeline, double frame_rate_hz, std::uint64_t frames_expected, Presenter& presenter,
                    Recorder* recorder);

/// A thread each; recordings are paced by their own timestamps and drop what comes too late, devices are waited for as above. `recorder` may be null.
rt::Result<double> run_realtime(Pipeline& pipeline, double frame_rate_hz, bool is_live, std::uint64_t frames_expected,
                                Presenter& presenter, Recorder* recorder);

}  // namespace tactus::firmware
