#include "pipeline/evaluate/mesh.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "pipeline/evaluate/text.hpp"

namespace tactus::evaluate {
namespace {

enum class Scalar : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

constexpr std::size_t kScalarBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
constexpr std::size_t bytes_of(Scalar s) { return kScalarBytes[static_cast<std::size_t>(s)]; }

bool parse_scalar(std::string_view word, Scalar& scalar) {
  static constexpr std::pair<std::string_view, Scalar> kNames[] = {
      {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
      {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
      {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
      {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64}};
  for (const auto& [name, value] : kNames) {
    if (name != word) continue;
    scalar = value;
    return true;
  }
  return false;
}

struct Property {
  std::string_view name;
  Scalar type = Scalar::u8;
  std::optional<Scalar> list_count_type;  // set for lists
};

struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Format : std::uint8_t { ascii, little_endian, big_endian };

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

/// Values one after another, whatever the format. Every read says whether there was one.
class ValueReader {
 public:
  ValueReader(std::string_view body, Format format) : rest_(body), format_(format) {}

  bool read(Scalar type, double& value) {
    if (format_ == Format::ascii) return read_word(value);
    const std::size_t bytes = bytes_of(type);
    if (rest_.size() < bytes) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t from = format_ == Format::little_endian ? i : bytes - 1 - i;
      bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(rest_[from])) << (8 * i);
    }
    rest_.remove_prefix(bytes);
    switch (type) {
      case Scalar::i8:
        value = static_cast<std::int8_t>(bits);
        break;
      case Scalar::i16:
        value = static_cast<std::int16_t>(bits);
        break;
      case Scalar::i32:
        value = static_cast<std::int32_t>(bits);
        break;
      case Scalar::u8:
      case Scalar::u16:
      case Scalar::u32:
        value = static_cast<double>(bits);
        break;
      case Scalar::f32:
        value = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
        break;
      case Scalar::f64:
        value = std::bit_cast<double>(bits);
        break;
    }
    return true;
  }

  [[nodiscard]] std::size_t bytes_left() const { return rest_.size(); }

 private:
  bool read_word(double& value) {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return false;
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    return parse_number(word, value);
  }

  std::string_view rest_;
  Format format_;
};

/// The header, or a sentence. On success `text` is what follows end_header.
std::optional<std::string> parse_header(std::string_view& text, Header& header) {
  if (take_line(text) != "ply") return "this is not a PLY file (the first line is not 'ply').";
  bool has_format = false;
  for (std::size_t line_number = 2; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string here = "header line " + std::to_string(line_number) + ": ";
    const std::string_view keyword = take_word(line);
    if (keyword == "end_header") {
      return has_format ? std::nullopt : std::optional<std::string>("the header names no format.");
    }
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) continue;
    if (keyword == "format") {
      const std::string_view format = take_word(line);
      if (format == "ascii")
        header.format = Format::ascii;
      else if (format == "binary_little_endian")
        header.format = Format::little_endian;
      else if (format == "binary_big_endian")
        header.format = Format::big_endian;
      else
        return here + "unknown format.";
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = take_word(line);
      if (!parse_number(take_word(line), element.count)) return here + "the element has no valid count.";
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) return here + "a property before any element.";
      Property property;
      std::string_view type = take_word(line);
      if (type == "list") {
        Scalar count_type{};
        if (!parse_scalar(take_word(line), count_type)) return here + "unknown type of a list count.";
        if (count_type == Scalar::f32 || count_type == Scalar::f64)
          return here + "a list count must be an integer.";
        property.list_count_type = count_type;
        type = take_word(line);
      }
      if (!parse_scalar(type, property.type)) return here + "unknown property type.";
      property.name = take_word(line);
      if (property.name.empty()) return here + "a property without a name.";
      header.elements.back().properties.push_back(property);
    } else {
      return here + "unknown keyword.";
    }
  }
  return "the header does not end.";
}

std::size_t index_of(const Element& element, std::string_view name) {
  for (std::size_t i = 0; i < element.properties.size(); ++i)
    if (element.properties[i].name == name) return i;
  return element.properties.size();
}

MaterialId to_label(double value) {
  return value >= 0 && value < kMaterialCount ? static_cast<MaterialId>(value) : kUnknownMaterial;
}

std::string truncated(const Element& element, std::uint64_t row) {
  return "the file ends, or holds something that is not a number, in " + std::string(element.name) + " " +
         std::to_string(row) + " of " + std::to_string(element.count) + ".";
}

std::optional<std::string> read_vertices(const Element& element, ValueReader& values, Mesh& mesh) {
  const std::size_t x = index_of(element, "x"), y = index_of(element, "y"), z = index_of(element, "z");
  const std::size_t label = index_of(element, "label"), count = element.properties.size();
  if (x == count || y == count || z == count) return "the vertices have no x, y and z.";
  for (const Property& property : element.properties)
    if (property.list_count_type) return "lists in vertices are not supported.";
  std::vector<double> row(count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (std::size_t p = 0; p < count; ++p)
      if (!values.read(element.properties[p].type, row[p])) return truncated(element, i);
    const Vec3f position{static_cast<float>(row[x]), static_cast<float>(row[y]), static_cast<float>(row[z])};
    if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) {
      return "vertex " + std::to_string(i) + " has a coordinate that is not finite.";
    }
    mesh.vertices_m.push_back(position);
    if (label < count) mesh.vertex_labels.push_back(to_label(row[label]));
  }
  return std::nullopt;
}

std::optional<std::string> read_faces(const Element& element, ValueReader& values, Mesh& mesh) {
  const std::size_t count = element.properties.size();
  std::size_t indices = index_of(element, "vertex_indices");
  if (indices == count) indices = index_of(element, "vertex_index");
  if (indices == count || !element.properties[indices].list_count_type)
    return "the faces have no vertex_indices list.";
  const std::size_t label = index_of(element, "label");
  if (label < count && element.properties[label].list_count_type)
    return "the label of a face must be one number.";
  std::vector<std::uint32_t> corners;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    corners.clear();
    MaterialId face_label = kUnknownMaterial;
    for (std::size_t p = 0; p < count; ++p) {
      const Property& property = element.properties[p];
      double length = 1, value = 0;
      if (property.list_count_type && !values.read(*property.list_count_type, length))
        return truncated(element, i);
      if (!(length >= 0 && length <= static_cast<double>(values.bytes_left()))) return truncated(element, i);
      for (double k = 0; k < length; ++k) {
        if (!values.read(property.type, value)) return truncated(element, i);
        if (p != indices) continue;
        if (!(value >= 0 && value < static_cast<double>(mesh.vertices_m.size())) ||
            value != std::floor(value)) {
          return "face " + std::to_string(i) + " names a vertex that does not exist (there are " +
                 std::to_string(mesh.vertices_m.size()) + ").";
        }
        corners.push_back(static_cast<std::uint32_t>(value));
      }
      if (p == label) face_label = to_label(value);
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
      if (label < count) mesh.triangle_labels.push_back(face_label);
    }
  }
  return std::nullopt;
}

std::optional<std::string> skip(const Element& element, ValueReader& values) {
  double value = 0;
  for (std::uint64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
    for (const Property& property : element.properties) {
      double length = 1;
      if (property.list_count_type && !values.read(*property.list_count_type, length))
        return truncated(element, i);
      if (!(length >= 0)) return truncated(element, i);
      for (double k = 0; k < length; ++k)
        if (!values.read(property.type, value)) return truncated(element, i);
    }
  }
  return std::nullopt;
}

}  // namespace

MaterialId Mesh::triangle_label(std::size_t triangle) const {
  if (!triangle_labels.empty()) return triangle_labels[triangle];
  if (vertex_labels.empty()) return kUnknownMaterial;
  const auto& t = triangles[triangle];
  const MaterialId a = vertex_labels[t[0]], b = vertex_labels[t[1]], c = vertex_labels[t[2]];
  return b == c ? b : a;
}

rt::Result<Mesh> read_ply(const std::filesystem::path& file) {
  auto bytes = read_file(file);
  if (!bytes) return bytes.error();
  const auto bad = [&](const std::string& what) {
    return rt::Error{rt::ExitCode::bad_input, file.string() + ": " + what};
  };
  std::string_view text = *bytes;
  Header header;
  if (const auto what = parse_header(text, header)) return bad(*what);
  Mesh mesh;
  ValueReader values(text, header.format);
  bool has_vertices = false;
  for (const Element& element : header.elements) {
    std::optional<std::string> what;
    if (element.name == "vertex") {
      if (has_vertices) return bad("there are two vertex elements.");
      what = read_vertices(element, values, mesh);
      has_vertices = true;
    } else if (element.name == "face") {
      what = has_vertices ? read_faces(element, values, mesh)
                          : std::optional<std::string>("the faces come before the vertices.");
    } else {
      what = skip(element, values);
    }
    if (what) return bad(*what);
  }
  if (mesh.vertices_m.empty()) return bad("there is no vertex in this file.");
  if (mesh.vertices_m.size() > std::numeric_limits<std::uint32_t>::max())
    return bad("there are too many vertices.");
  return mesh;
}

}  // namespace tactus::evaluate
