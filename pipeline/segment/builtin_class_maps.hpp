// Class maps that come with the program, so that it runs from anywhere.
#pragma once

#include <span>
#include <string_view>

namespace tactus::segment {

struct BuiltinClassMap {
  const char* model_name_part;  // a network whose file name holds this has these classes
  const char* file;             // in pipeline/segment/models
  std::string_view toml;
};

extern const std::span<const BuiltinClassMap> kBuiltinClassMaps;

}  // namespace tactus::segment
