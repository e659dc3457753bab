// The kernel's virtual USB host controller, which takes devices that sit at the other end of a socket.
#pragma once

#include "rt/status.hpp"

namespace tactus::guest {

/// Hands `socket` to the kernel as a high-speed device on `port` (0 to 7) of the first controller. Waits up to 10 s for a
/// device that was there before to be gone. Errors: no such controller (modprobe vhci-hcd), no permission.
rt::Result<void> attach_to_port(int port, int socket);

}  // namespace tactus::guest
