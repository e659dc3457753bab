// What the colour frames of a source are called: label images carry the same names.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "rt/status.hpp"

namespace tactus::firmware {

/// Name without its folder and extension by sequence number of the colour camera: of a recording the files'
/// own
/// (`rgb/000012.jpg` is 000012, `frame-000012.color.jpg` is frame-000012.color). Boot.
class ColorNames {
 public:
  static rt::Result<ColorNames> of(const std::string& source);
  /// Of a synthetic source what `tactus convert` calls them: the number in six digits.
  [[nodiscard]] std::string name(std::uint64_t sequence) const;

 private:
  std::map<std::uint64_t, std::string> names_;  // empty: synthetic
};

}  // namespace tactus::firmware
