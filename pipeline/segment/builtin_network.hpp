// The material network that comes with the program, inside it, so that it labels rooms from anywhere.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace tactus::segment {

/// The bytes of models/tactus_materials.tflite, aligned to 16 as read_tflite wants them; they live as long as
/// the program. Phase: any; thread-safe.
std::span<const std::byte> builtin_network() noexcept;

/// What messages and the summary call it; also the name under which --model finds it.
inline constexpr std::string_view kBuiltinNetworkName = "tactus_materials";

}  // namespace tactus::segment
