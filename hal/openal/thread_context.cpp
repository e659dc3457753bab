#include "hal/openal/thread_context.hpp"

#include <AL/al.h>
#include <AL/alext.h>

#include <cstdlib>

namespace tactus::hal::openal {
namespace {

struct Functions {
  PFNALCSETTHREADCONTEXTPROC set = nullptr;
  PFNALCGETTHREADCONTEXTPROC get = nullptr;
};

const Functions& functions() {
  static const Functions loaded = [] {
    setenv("ALSOFT_LOGLEVEL", "0", 0);  // read once, by the first call
    Functions found;
    if (alcIsExtensionPresent(nullptr, "ALC_EXT_thread_local_context") == ALC_TRUE) {
      found.set =
          reinterpret_cast<PFNALCSETTHREADCONTEXTPROC>(alcGetProcAddress(nullptr, "alcSetThreadContext"));
      found.get =
          reinterpret_cast<PFNALCGETTHREADCONTEXTPROC>(alcGetProcAddress(nullptr, "alcGetThreadContext"));
    }
    return found;
  }();
  return loaded;
}

}  // namespace

bool has_thread_contexts() { return functions().set != nullptr && functions().get != nullptr; }

ThreadContext::ThreadContext(ALCcontext* context) : before_(functions().get()) { functions().set(context); }

ThreadContext::~ThreadContext() { functions().set(before_); }

}  // namespace tactus::hal::openal
