#include "likeness/base/npy.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "\x93NUMPY";

// What follows `'key':` in the header, a Python dictionary on one line.
std::string_view ValueOf(const fs::path& path, std::string_view header, std::string_view key) {
  const size_t at = header.find(fmt::format("'{}'", key));
  const size_t colon = at == std::string_view::npos ? at : header.find(':', at);
  if (colon == std::string_view::npos) throw FileError(path, fmt::format("its header does not say '{}'", key));
  return Trim(header.substr(colon + 1));
}

std::vector<int64_t> ParseShape(const fs::path& path, std::string_view text) {
  const size_t close = text.find(')');
  if (!text.starts_with('(') || close == std::string_view::npos) throw FileError(path, "its header has no shape (...)");
  std::string_view rest = Trim(text.substr(1, close - 1));
  std::vector<int64_t> shape;
  while (!rest.empty()) {
    int64_t side = 0;
    const auto [end, code] = std::from_chars(rest.data(), rest.data() + rest.size(), side);
    rest = Trim(rest.substr(static_cast<size_t>(end - rest.data())));
    if (code != std::errc() || side < 0 || (!rest.empty() && rest.front() != ',')) {
      throw FileError(path, "its header has a shape that is not understood");
    }
    shape.push_back(side);
    if (!rest.empty()) rest = Trim(rest.substr(1));
  }
  return shape;
}

template <typename T>
void Decode(std::string_view bytes, bool big_endian, std::vector<double>* values) {
  for (size_t i = 0; i < values->size(); ++i) {
    char raw[sizeof(T)];
    std::memcpy(raw, bytes.data() + i * sizeof(T), sizeof(T));
    if (big_endian) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    (*values)[i] = static_cast<double>(value);
  }
}

// From the first index running fastest to the last one.
std::vector<double> ColumnsToRows(const std::vector<int64_t>& shape, const std::vector<double>& columns) {
  std::vector<double> rows(columns.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    size_t rest = i, from = 0;
    for (size_t k = shape.size(); k-- > 0;) {
      size_t stride = 1;
      for (size_t j = 0; j < k; ++j) stride *= static_cast<size_t>(shape[j]);
      from += rest % static_cast<size_t>(shape[k]) * stride;
      rest /= static_cast<size_t>(shape[k]);
    }
    rows[i] = columns[from];
  }
  return rows;
}

}  // namespace

NpyArray ParseNpy(const fs::path& path_for_errors, std::string_view bytes) {
  constexpr size_t kFixed = 8;  // magic and version
  if (!bytes.starts_with(kMagic) || bytes.size() < kFixed + 4) throw FileError(path_for_errors, "is no .npy file");
  const size_t length_bytes = bytes[6] == 1 ? 2 : 4;
  size_t length = 0;
  for (size_t i = length_bytes; i-- > 0;) length = length << 8 | static_cast<uint8_t>(bytes[kFixed + i]);
  const size_t start = kFixed + length_bytes;
  if (length > bytes.size() - start) throw FileError(path_for_errors, "ends inside its header");
  const std::string_view header = bytes.substr(start, length);
  bytes.remove_prefix(start + length);

  const std::string_view type = ValueOf(path_for_errors, header, "descr").substr(0, 5);
  const bool known = type.size() == 5 && (type[1] == '<' || type[1] == '>') && type[2] == 'f';
  if (!known || (type[3] != '4' && type[3] != '8')) {
    throw FileError(path_for_errors, fmt::format("holds values of type {}; expected '<f4' or '<f8'", type));
  }
  const bool single = type[3] == '4';
  NpyArray array;
  array.shape = ParseShape(path_for_errors, ValueOf(path_for_errors, header, "shape"));
  const size_t most = bytes.size() / (single ? 4 : 8);
  size_t count = 1;
  for (const int64_t side : array.shape) {
    count = side == 0 ? 0 : count > most / static_cast<size_t>(side) ? most + 1 : count * static_cast<size_t>(side);
  }
  if (count > most || count * (single ? 4 : 8) != bytes.size()) {
    throw FileError(path_for_errors, fmt::format("holds {} bytes of values, which its shape ({}) does not fit",
                                                 bytes.size(), fmt::join(array.shape, ", ")));
  }
  array.values.resize(count);
  if (single) {
    Decode<float>(bytes, type[1] == '>', &array.values);
  } else {
    Decode<double>(bytes, type[1] == '>', &array.values);
  }
  if (ValueOf(path_for_errors, header, "fortran_order").starts_with("True")) {
    array.values = ColumnsToRows(array.shape, array.values);
  }
  return array;
}

std::string EncodeNpy(const std::vector<int64_t>& shape, const std::vector<float>& values) {
  int64_t count = 1;
  for (const int64_t side : shape) count *= side;
  LIKENESS_CHECK(count == static_cast<int64_t>(values.size()));
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}{}), }}",
                                   fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  constexpr size_t kAlignment = 64, kBefore = 10;
  header.append(kAlignment - 1 - (kBefore + header.size()) % kAlignment, ' ');
  header += '\n';
  std::string bytes(kMagic);
  bytes += '\1';
  bytes += '\0';
  bytes += static_cast<char>(header.size() & 255);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return bytes;
}

}  // namespace likeness
