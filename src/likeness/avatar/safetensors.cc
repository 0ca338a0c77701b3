#include "likeness/avatar/safetensors.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/mapped_file.h"

namespace likeness {

namespace {

using nlohmann::json;

constexpr size_t kLengthBytes = 8;
constexpr uint64_t kMostHeaderBytes = 100'000'000;  // the reference reader's limit
constexpr size_t kAlignment = 64;
constexpr size_t kMostAxes = 8;
constexpr int kMostDepth = 3;  // file object, tensor, shape
constexpr char kMetadataKey[] = "__metadata__";

struct DTypeName {
  DType dtype;
  const char* name;
  size_t bytes;
};
constexpr DTypeName kDTypes[] = {{DType::kBool, "BOOL", 1}, {DType::kU8, "U8", 1},   {DType::kI8, "I8", 1},
                                 {DType::kI16, "I16", 2},   {DType::kU16, "U16", 2}, {DType::kF16, "F16", 2},
                                 {DType::kBF16, "BF16", 2}, {DType::kI32, "I32", 4}, {DType::kU32, "U32", 4},
                                 {DType::kF32, "F32", 4},   {DType::kF64, "F64", 8}, {DType::kI64, "I64", 8},
                                 {DType::kU64, "U64", 8}};

const DTypeName& Row(DType dtype) {
  return *std::find_if(std::begin(kDTypes), std::end(kDTypes), [&](const DTypeName& d) { return d.dtype == dtype; });
}

// A non-negative whole number that fits size_t.
size_t WholeNumber(const json& value) {
  if (!value.is_number_unsigned()) throw Error("{} stands where a whole number was expected", value.dump());
  return value.get<uint64_t>();
}

// Bytes of a tensor; throws Error instead of overflowing.
size_t TensorBytes(const std::vector<int64_t>& shape, size_t element) {
  size_t bytes = element;
  for (const int64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, static_cast<size_t>(extent), &bytes)) {
      throw Error("its shape [{}] is beyond any memory", fmt::join(shape, ", "));
    }
  }
  return bytes;
}

// Parses with a bound on nesting and without repeated keys, which the parser itself would let pass.
json ParseStrictly(std::string_view text) {
  std::vector<std::set<std::string>> keys;
  const json::parser_callback_t guard = [&](int depth, json::parse_event_t event, json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        if (depth >= kMostDepth) throw Error("is nested too deeply");
        keys.emplace_back();
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        keys.pop_back();
        break;
      case json::parse_event_t::key:
        if (!keys.back().insert(parsed.get<std::string>()).second) {
          throw Error("names '{}' twice", parsed.get<std::string>());
        }
        break;
      case json::parse_event_t::value:
        break;
    }
    return true;
  };
  return json::parse(text, guard);
}

bool Matches(const std::vector<int64_t>& shape, const std::vector<int64_t>& expected) {
  return std::equal(shape.begin(), shape.end(), expected.begin(), expected.end(),
                    [](int64_t is, int64_t wanted) { return wanted < 0 || is == wanted; });
}

}  // namespace

size_t ByteSize(DType dtype) { return Row(dtype).bytes; }
std::string ToString(DType dtype) { return Row(dtype).name; }

TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const float> values) {
  return {std::move(name), DType::kF32, std::move(shape), std::as_bytes(values)};
}

TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const double> values) {
  return {std::move(name), DType::kF64, std::move(shape), std::as_bytes(values)};
}

TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const int32_t> values) {
  return {std::move(name), DType::kI32, std::move(shape), std::as_bytes(values)};
}

std::string SafetensorsHeader(const std::vector<TensorView>& tensors,
                              const std::map<std::string, std::string>& metadata) {
  nlohmann::ordered_json header;
  if (!metadata.empty()) header[kMetadataKey] = metadata;
  size_t offset = 0;
  for (const TensorView& tensor : tensors) {
    LIKENESS_CHECK(TensorBytes(tensor.shape, ByteSize(tensor.dtype)) == tensor.bytes.size());
    LIKENESS_CHECK(!header.contains(tensor.name));
    header[tensor.name] = {{"dtype", ToString(tensor.dtype)},
                           {"shape", tensor.shape},
                           {"data_offsets", {offset, offset + tensor.bytes.size()}}};
    offset += tensor.bytes.size();
  }
  std::string text = tensors.empty() && metadata.empty() ? "{}" : header.dump();
  text.resize((kLengthBytes + text.size() + kAlignment - 1) / kAlignment * kAlignment - kLengthBytes, ' ');
  const uint64_t length = text.size();
  return std::string(reinterpret_cast<const char*>(&length), sizeof(length)) + text;
}

void WriteSafetensors(const std::filesystem::path& path, const std::vector<TensorView>& tensors,
                      const std::map<std::string, std::string>& metadata) {
  const std::string header = SafetensorsHeader(tensors, metadata);
  WriteFileWith(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(header.data(), static_cast<std::streamsize>(header.size()));
    for (const TensorView& tensor : tensors) {
      out.write(reinterpret_cast<const char*>(tensor.bytes.data()), static_cast<std::streamsize>(tensor.bytes.size()));
    }
    out.close();
    if (!out) throw FileError(path, fmt::format("cannot be written: {}", std::strerror(errno)));
  });
}

SafetensorsFile::SafetensorsFile(const std::filesystem::path& path) : SafetensorsFile(path, ReadFile(path)) {}

SafetensorsFile SafetensorsFile::Map(const std::filesystem::path& path) {
  const auto mapped = std::make_shared<const MappedFile>(path);
  return {path, mapped->bytes(), mapped};
}

SafetensorsFile::SafetensorsFile(std::filesystem::path path_for_errors, std::string bytes)
    : SafetensorsFile(std::move(path_for_errors), std::make_shared<const std::string>(std::move(bytes))) {}

SafetensorsFile::SafetensorsFile(std::filesystem::path path_for_errors, std::shared_ptr<const std::string> bytes)
    : SafetensorsFile(std::move(path_for_errors), *bytes, bytes) {}

SafetensorsFile::SafetensorsFile(std::filesystem::path path_for_errors, std::string_view bytes,
                                 std::shared_ptr<const void> owner)
    : path_(std::move(path_for_errors)), owner_(std::move(owner)), bytes_(bytes) {
  if (bytes_.size() < kLengthBytes) throw FileError(path_, "is too short for a safetensors file");
  uint64_t length = 0;
  std::memcpy(&length, bytes_.data(), sizeof(length));
  if (length > kMostHeaderBytes || length > bytes_.size() - kLengthBytes) {
    throw FileError(path_, fmt::format("no safetensors file, or cut off: it announces a header of {} bytes, and {} "
                                       "bytes follow",
                                       length, bytes_.size() - kLengthBytes));
  }
  try {
    ParseHeader(bytes_.substr(kLengthBytes, length), kLengthBytes + length);
  } catch (const json::exception& error) {
    throw FileError(path_, fmt::format("the safetensors header is not understood: {}", error.what()));
  } catch (const Error& error) {
    throw FileError(path_, fmt::format("safetensors header: {}", error.what()));
  }
}

void SafetensorsFile::ParseHeader(std::string_view header, size_t data_begin) {
  const json root = ParseStrictly(header);
  if (!root.is_object()) throw Error("is no JSON object");
  const size_t data_size = bytes_.size() - data_begin;
  std::vector<std::pair<size_t, size_t>> ranges;
  for (const auto& [name, value] : root.items()) {
    if (name == kMetadataKey) {
      metadata_ = value.get<std::map<std::string, std::string>>();
      continue;
    }
    try {
      Entry entry;
      const std::string dtype = value.at("dtype").get<std::string>();
      const auto row = std::find_if(std::begin(kDTypes), std::end(kDTypes), [&](auto& d) { return dtype == d.name; });
      if (row == std::end(kDTypes)) throw Error("its type '{}' is unknown", dtype);
      entry.dtype = row->dtype;
      const json& shape = value.at("shape");
      const json& offsets = value.at("data_offsets");
      if (!shape.is_array() || shape.size() > kMostAxes) throw Error("its shape is no list of at most 8 extents");
      for (const json& extent : shape) {
        const size_t number = WholeNumber(extent);
        if (number > std::numeric_limits<int64_t>::max()) throw Error("its extent {} is too large", number);
        entry.shape.push_back(static_cast<int64_t>(number));
      }
      if (!offsets.is_array() || offsets.size() != 2) throw Error("its data_offsets are no pair");
      const size_t begin = WholeNumber(offsets[0]), end = WholeNumber(offsets[1]);
      if (begin > end || end > data_size) {
        throw Error("its data [{}, {}) lie outside of the file's {} bytes of data", begin, end, data_size);
      }
      const size_t expected = TensorBytes(entry.shape, row->bytes);
      if (expected != end - begin) {
        throw Error("its shape [{}] needs {} bytes and it has {}", fmt::join(entry.shape, ", "), expected, end - begin);
      }
      entry.begin = data_begin + begin;
      entry.size = end - begin;
      if (entry.size > 0) ranges.emplace_back(begin, end);
      entries_.emplace(name, std::move(entry));
    } catch (const std::exception& error) {
      throw Error("tensor '{}': {}", name, error.what());
    }
  }
  std::sort(ranges.begin(), ranges.end());
  size_t reached = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != reached) throw Error("two tensors overlap, or leave a hole, at byte {}", std::min(begin, reached));
    reached = end;
  }
  if (reached != data_size) throw Error("{} bytes at the end belong to no tensor", data_size - reached);
}

std::vector<std::string> SafetensorsFile::names() const {
  std::vector<std::string> names;
  for (const auto& [name, entry] : entries_) names.push_back(name);
  return names;
}

const std::string& SafetensorsFile::Metadata(const std::string& key) const {
  const auto found = metadata_.find(key);
  if (found == metadata_.end()) throw FileError(path_, fmt::format("has no metadata '{}'", key));
  return found->second;
}

DType SafetensorsFile::DTypeOf(const std::string& name) const { return Find(name).dtype; }
const std::vector<int64_t>& SafetensorsFile::ShapeOf(const std::string& name) const { return Find(name).shape; }

std::span<const std::byte> SafetensorsFile::Bytes(const std::string& name) const {
  const Entry& entry = Find(name);
  return std::as_bytes(std::span(bytes_.data() + entry.begin, entry.size));
}

template <typename T>
std::vector<T> SafetensorsFile::ValuesOf(const Entry& entry) const {
  std::vector<T> values(entry.size / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes_.data() + entry.begin, entry.size);
  return values;
}

template <typename T>
std::vector<T> SafetensorsFile::FiniteValuesOf(const std::string& name, const Entry& entry) const {
  std::vector<T> values = ValuesOf<T>(entry);
  const auto bad = std::find_if_not(values.begin(), values.end(), [](T v) { return std::isfinite(v); });
  if (bad != values.end()) {
    throw FileError(path_, fmt::format("tensor '{}': value {} is not a finite number", name, bad - values.begin()));
  }
  return values;
}

std::vector<float> SafetensorsFile::Floats(const std::string& name, const std::vector<int64_t>& shape) const {
  return FiniteValuesOf<float>(name, Find(name, DType::kF32, shape));
}

std::vector<double> SafetensorsFile::Doubles(const std::string& name, const std::vector<int64_t>& shape) const {
  return FiniteValuesOf<double>(name, Find(name, DType::kF64, shape));
}

std::vector<int32_t> SafetensorsFile::Integers(const std::string& name, const std::vector<int64_t>& shape) const {
  return ValuesOf<int32_t>(Find(name, DType::kI32, shape));
}

const SafetensorsFile::Entry& SafetensorsFile::Find(const std::string& name) const {
  const auto found = entries_.find(name);
  if (found == entries_.end()) throw FileError(path_, fmt::format("has no tensor '{}'", name));
  return found->second;
}

const SafetensorsFile::Entry& SafetensorsFile::Find(const std::string& name, DType dtype,
                                                    const std::vector<int64_t>& shape) const {
  const Entry& entry = Find(name);
  if (entry.dtype != dtype || !Matches(entry.shape, shape)) {
    throw FileError(path_, fmt::format("tensor '{}' is {} [{}]; expected {} [{}]", name, ToString(entry.dtype),
                                       fmt::join(entry.shape, ", "), ToString(dtype), fmt::join(shape, ", ")));
  }
  return entry;
}

}  // namespace likeness
