#include "pipeline/segment/builtin_network.hpp"

// The assembler copies the file in: a C array of three million numbers would take the compiler a minute. The
// build file names the file here and rebuilds this one when it changes.
asm(".pushsection .rodata, \"a\"\n"
    ".balign 16\n"
    ".globl tactus_builtin_network_begin\n"
    ".globl tactus_builtin_network_end\n"
    "tactus_builtin_network_begin:\n"
    ".incbin \"" TACTUS_BUILTIN_NETWORK_FILE
    "\"\n"
    "tactus_builtin_network_end:\n"
    ".byte 0\n"
    ".popsection\n");

extern "C" {
extern const std::byte tactus_builtin_network_begin[];
extern const std::byte tactus_builtin_network_end[];
}

namespace tactus::segment {

std::span<const std::byte> builtin_network() noexcept {
  return {tactus_builtin_network_begin, tactus_builtin_network_end};
}

}  // namespace tactus::segment
