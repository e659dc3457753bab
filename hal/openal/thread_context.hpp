// An OpenAL context made current for one scope on one thread, so that two devices do not disturb each other.
#pragma once

#include <AL/alc.h>

namespace tactus::hal::openal {

/// Whether OpenAL has a current context per thread (ALC_EXT_thread_local_context); without it there is one
/// per process and nothing here can work. Silences the library's own log on stderr unless the user has set
/// ALSOFT_LOGLEVEL: what is wrong is said in one sentence by whoever asked. Boot; call it before anything
/// else of OpenAL.
bool has_thread_contexts();

/// Restores what was current before.
class ThreadContext {
 public:
  explicit ThreadContext(ALCcontext* context);
  ThreadContext(const ThreadContext&) = delete;
  ThreadContext& operator=(const ThreadContext&) = delete;
  ~ThreadContext();

 private:
  ALCcontext* before_;
};

}  // namespace tactus::hal::openal
