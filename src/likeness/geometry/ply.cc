#include "likeness/geometry/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct ScalarName {
  std::string_view name;
  Scalar scalar;
};

constexpr ScalarName kScalarNames[] = {
    {"char", Scalar::kInt8},      {"int8", Scalar::kInt8},       {"uchar", Scalar::kUint8},
    {"uint8", Scalar::kUint8},    {"short", Scalar::kInt16},     {"int16", Scalar::kInt16},
    {"ushort", Scalar::kUint16},  {"uint16", Scalar::kUint16},   {"int", Scalar::kInt32},
    {"int32", Scalar::kInt32},    {"uint", Scalar::kUint32},     {"uint32", Scalar::kUint32},
    {"float", Scalar::kFloat32},  {"float32", Scalar::kFloat32}, {"double", Scalar::kFloat64},
    {"float64", Scalar::kFloat64}};

size_t Bytes(Scalar scalar) {
  constexpr size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<size_t>(scalar)];
}

struct Property {
  std::string name;
  Scalar scalar = Scalar::kFloat32;
  std::optional<Scalar> count;  // of a list's length
};

struct Element {
  std::string name;
  int64_t count = 0;
  std::vector<Property> properties;

  // The least that one row takes. In ASCII every value has a digit and what parts it from the next.
  size_t LeastBytes(PlyEncoding encoding) const {
    size_t bytes = 0;
    for (const Property& p : properties) {
      bytes += encoding == PlyEncoding::kAscii ? 2 : Bytes(p.count ? *p.count : p.scalar);
    }
    return bytes;
  }
};

struct Header {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<Element> elements;
};

Scalar ParseScalar(const TextLines& lines, std::string_view word) {
  for (const ScalarName& known : kScalarNames) {
    if (known.name == word) return known.scalar;
  }
  lines.Fail("a property of a type that PLY does not have");
}

PlyEncoding ParseEncoding(const TextLines& lines, std::string_view word) {
  if (word == "ascii") return PlyEncoding::kAscii;
  if (word == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (word == "binary_big_endian") return PlyEncoding::kBigEndian;
  lines.Fail("expected 'format ascii', 'binary_little_endian' or 'binary_big_endian'");
}

Property ParseProperty(const TextLines& lines, const std::vector<std::string_view>& words) {
  Property property;
  if (words.size() == 5 && words[1] == "list") {
    property.count = ParseScalar(lines, words[2]);
    if (*property.count >= Scalar::kFloat32) lines.Fail("the length of a list must be a whole number");
    property.scalar = ParseScalar(lines, words[3]);
  } else if (words.size() == 3) {
    property.scalar = ParseScalar(lines, words[1]);
  } else {
    lines.Fail("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  }
  property.name = words.back();
  return property;
}

// `bytes` is cut to what follows the header.
Header ParseHeader(const fs::path& path, std::string_view* bytes) {
  constexpr size_t kMostHeader = 1 << 16;
  constexpr std::string_view kEnd = "end_header";
  const std::string_view start = bytes->substr(0, kMostHeader);
  const size_t end = start.find(kEnd);
  const size_t line_end = end == std::string_view::npos ? end : start.find('\n', end);
  if (!start.starts_with("ply") || line_end == std::string_view::npos) {
    throw FileError(path, "is no PLY: expected 'ply' and a header that ends with 'end_header'");
  }
  Header header;
  bool has_format = false;
  TextLines lines(path, start.substr(0, end));
  while (lines.Next()) {
    const auto words = lines.Words();
    if (words.empty() || words[0] == "ply" || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "format" && words.size() == 3) {
      header.encoding = ParseEncoding(lines, words[1]);
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      header.elements.push_back({std::string(words[1]), lines.Integer(words[2]), {}});
      if (header.elements.back().count < 0) lines.Fail("an element cannot occur less than 0 times");
    } else if (words[0] == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(ParseProperty(lines, words));
    } else {
      lines.Fail("a header line that is not understood");
    }
  }
  if (!has_format) throw FileError(path, "is no PLY: its header has no line 'format'");
  bytes->remove_prefix(line_end + 1);
  return header;
}

// The values behind the header, one after the other.
class Values {
 public:
  Values(const fs::path& path, std::string_view bytes, PlyEncoding encoding)
      : path_(path), rest_(bytes), encoding_(encoding) {}

  size_t left() const { return rest_.size(); }

  double Next(Scalar scalar) { return encoding_ == PlyEncoding::kAscii ? NextWord() : NextBinary(scalar); }

 private:
  double NextWord() {
    const size_t begin = std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size());
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    double value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || code != std::errc() || end != word.data() + word.size()) {
      throw FileError(path_, word.empty() ? "ends before its last value" : "holds a word where a number is expected");
    }
    rest_.remove_prefix(word.size());
    return value;
  }

  double NextBinary(Scalar scalar) {
    const size_t size = Bytes(scalar);
    if (rest_.size() < size) throw FileError(path_, "ends before its last value");
    char bytes[8] = {};
    std::memcpy(bytes, rest_.data(), size);
    rest_.remove_prefix(size);
    static_assert(std::endian::native == std::endian::little);
    if (encoding_ == PlyEncoding::kBigEndian) std::reverse(bytes, bytes + size);
    const auto as = [&]<typename T>(T value) {
      std::memcpy(&value, bytes, sizeof(T));
      return static_cast<double>(value);
    };
    switch (scalar) {
      case Scalar::kInt8:
        return as(int8_t{});
      case Scalar::kUint8:
        return as(uint8_t{});
      case Scalar::kInt16:
        return as(int16_t{});
      case Scalar::kUint16:
        return as(uint16_t{});
      case Scalar::kInt32:
        return as(int32_t{});
      case Scalar::kUint32:
        return as(uint32_t{});
      case Scalar::kFloat32:
        return as(float{});
      case Scalar::kFloat64:
        return as(double{});
    }
    return 0;
  }

  const fs::path& path_;
  std::string_view rest_;
  const PlyEncoding encoding_;
};

size_t ListLength(const fs::path& path, Values* values, Scalar type) {
  const double length = values->Next(type);
  if (!(length >= 0 && length <= static_cast<double>(values->left())) || length != std::floor(length)) {
    throw FileError(path, "holds a list that is longer than the file");
  }
  return static_cast<size_t>(length);
}

void SkipRow(const fs::path& path, const Element& element, Values* values) {
  for (const Property& property : element.properties) {
    const size_t count = property.count ? ListLength(path, values, *property.count) : 1;
    for (size_t i = 0; i < count; ++i) values->Next(property.scalar);
  }
}

Vertices ReadVertices(const fs::path& path, const Element& element, Values* values) {
  std::vector<int> axis_of(element.properties.size(), -1);
  int found = 0;
  for (size_t i = 0; i < axis_of.size(); ++i) {
    const Property& property = element.properties[i];
    if (property.count) throw FileError(path, "has a list among the properties of its vertices");
    for (int axis = 0; axis < 3; ++axis) {
      if (property.name == std::string_view("xyz").substr(static_cast<size_t>(axis), 1)) {
        axis_of[i] = axis;
        found |= 1 << axis;
      }
    }
  }
  if (found != 7) throw FileError(path, "expected vertices with properties x, y and z");
  Vertices vertices(static_cast<Eigen::Index>(element.count), 3);
  for (Eigen::Index row = 0; row < vertices.rows(); ++row) {
    for (size_t i = 0; i < axis_of.size(); ++i) {
      const auto value = static_cast<float>(values->Next(element.properties[i].scalar));
      if (axis_of[i] < 0) continue;
      if (!std::isfinite(value)) throw FileError(path, fmt::format("vertex {} is not finite", row));
      vertices(row, axis_of[i]) = value;
    }
  }
  return vertices;
}

bool IsFaceList(const Property& property) {
  return property.count && (property.name == "vertex_indices" || property.name == "vertex_index");
}

// Fans of triangles; their indices are checked when all vertices are known.
void ReadFace(const fs::path& path, const Element& element, Values* values, std::vector<Eigen::Vector3i>* triangles) {
  for (const Property& property : element.properties) {
    const size_t count = property.count ? ListLength(path, values, *property.count) : 1;
    int first = -1, previous = -1;
    for (size_t i = 0; i < count; ++i) {
      const double value = values->Next(property.scalar);
      if (!IsFaceList(property)) continue;
      if (!(value >= 0 && value <= 2147483647.0))
        throw FileError(path, "a face refers to a vertex that does not exist");
      const auto index = static_cast<int>(value);
      if (i == 0) first = index;
      if (i >= 2) triangles->emplace_back(first, previous, index);
      previous = index;
    }
  }
}

template <typename T>
void AppendBytes(std::string* bytes, T value, PlyEncoding encoding) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (encoding == PlyEncoding::kBigEndian) std::reverse(raw, raw + sizeof(T));
  bytes->append(raw, sizeof(T));
}

}  // namespace

PlyFile ParsePly(const fs::path& path_for_errors, std::string_view bytes) {
  const Header header = ParseHeader(path_for_errors, &bytes);
  Values values(path_for_errors, bytes, header.encoding);
  PlyFile ply;
  for (const Element& element : header.elements) {
    const size_t least = element.LeastBytes(header.encoding);
    // The last ASCII value needs nothing behind it.
    if (element.count > 0 && (least == 0 || static_cast<uint64_t>(element.count) > (values.left() + 1) / least)) {
      throw FileError(path_for_errors,
                      fmt::format("claims {} times '{}', more than its {} bytes hold: cut off or damaged",
                                  element.count, element.name, values.left()));
    }
    if (element.name == "vertex" && ply.vertices.rows() == 0) {
      ply.vertices = ReadVertices(path_for_errors, element, &values);
      continue;
    }
    for (int64_t i = 0; i < element.count; ++i) {
      if (element.name == "face") {
        ReadFace(path_for_errors, element, &values, &ply.triangles);
      } else {
        SkipRow(path_for_errors, element, &values);
      }
    }
  }
  if (ply.vertices.rows() == 0) throw FileError(path_for_errors, "holds no vertices");
  for (const Eigen::Vector3i& triangle : ply.triangles) {
    if (triangle.maxCoeff() >= ply.vertices.rows()) {
      throw FileError(path_for_errors, fmt::format("a face refers to vertex {}, but there are {}", triangle.maxCoeff(),
                                                   ply.vertices.rows()));
    }
  }
  return ply;
}

std::string EncodePly(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, PlyEncoding encoding) {
  constexpr const char* kFormats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  std::string bytes =
      fmt::format("ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
                  kFormats[static_cast<size_t>(encoding)], vertices.rows());
  if (!triangles.empty()) {
    bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\n", triangles.size());
  }
  bytes += "end_header\n";
  const bool ascii = encoding == PlyEncoding::kAscii;
  for (const auto& v : vertices.rowwise()) {
    if (ascii) {
      bytes += fmt::format("{} {} {}\n", v[0], v[1], v[2]);
    } else {
      for (const float value : v) AppendBytes(&bytes, value, encoding);
    }
  }
  for (const Eigen::Vector3i& t : triangles) {
    if (ascii) {
      bytes += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    } else {
      bytes += '\3';
      for (const int index : t) AppendBytes(&bytes, int32_t{index}, encoding);
    }
  }
  return bytes;
}

}  // namespace likeness
