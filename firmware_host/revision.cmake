# Writes OUTPUT with the git revision of SOURCE_DIR; "unknown" where git or the repository is absent.
set(revision "unknown")
find_program(GIT git)
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} describe --always --dirty --abbrev=12 --exclude=*
                  OUTPUT_VARIABLE described RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed)
    set(revision ${described})
  endif()
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[
#include "firmware_host/machine.hpp"
namespace tactus::firmware {
const char* revision() { return "@VERSION@ (@revision@)"; }
}  // namespace tactus::firmware
]] @ONLY)
