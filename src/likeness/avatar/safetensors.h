// safetensors: named tensors and text in one file that nothing can be executed from.
//
// Layout: the header's length (uint64, little-endian), the header (JSON: name -> dtype, shape, data_offsets; and
// "__metadata__", a map of strings), then the data, little-endian, row-major, without holes.
// https://github.com/huggingface/safetensors describes it. We start the data at a multiple of 64 bytes.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

enum class DType { kBool, kU8, kI8, kI16, kU16, kF16, kBF16, kI32, kU32, kF32, kF64, kI64, kU64 };
size_t ByteSize(DType dtype);
std::string ToString(DType dtype);  // as files spell it: "F32"

// A tensor to be written; the values are borrowed.
struct TensorView {
  std::string name;
  DType dtype = DType::kF32;
  std::vector<int64_t> shape;
  std::span<const std::byte> bytes;
};
TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const float> values);
TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const double> values);
TensorView ViewOf(std::string name, std::vector<int64_t> shape, std::span<const int32_t> values);

// What stands before the data: the header's length, the header, and blanks up to a multiple of 64 bytes.
std::string SafetensorsHeader(const std::vector<TensorView>& tensors,
                              const std::map<std::string, std::string>& metadata);

// Writes the file whole or not at all.
void WriteSafetensors(const std::filesystem::path& path, const std::vector<TensorView>& tensors,
                      const std::map<std::string, std::string>& metadata);

// A file in memory. Everything is checked when it is opened: header and data lie inside of the file, shapes match byte
// counts, tensors fill the data without overlap or hole, names are unique.
class SafetensorsFile {
 public:
  // Throws Error naming the file.
  explicit SafetensorsFile(const std::filesystem::path& path);
  SafetensorsFile(std::filesystem::path path_for_errors, std::string bytes);
  // Bytes that `owner` keeps in memory, or the caller does where that is null.
  SafetensorsFile(std::filesystem::path path_for_errors, std::string_view bytes, std::shared_ptr<const void> owner);
  // The file is mapped, not read: tensors that nobody asks for are never touched.
  static SafetensorsFile Map(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  const std::map<std::string, std::string>& metadata() const { return metadata_; }
  // Sorted by name.
  std::vector<std::string> names() const;
  bool Has(const std::string& name) const { return entries_.count(name) != 0; }

  // Throws Error when there is no such entry.
  const std::string& Metadata(const std::string& key) const;
  DType DTypeOf(const std::string& name) const;
  const std::vector<int64_t>& ShapeOf(const std::string& name) const;
  std::span<const std::byte> Bytes(const std::string& name) const;

  // The values of an F32 (F64, I32) tensor. Throws Error when it has another type or shape; -1 in `shape` matches any
  // extent. Floats and doubles must be finite.
  std::vector<float> Floats(const std::string& name, const std::vector<int64_t>& shape) const;
  std::vector<double> Doubles(const std::string& name, const std::vector<int64_t>& shape) const;
  std::vector<int32_t> Integers(const std::string& name, const std::vector<int64_t>& shape) const;

 private:
  SafetensorsFile(std::filesystem::path path_for_errors, std::shared_ptr<const std::string> bytes);
  struct Entry {
    DType dtype = DType::kF32;
    std::vector<int64_t> shape;
    size_t begin = 0;  // into bytes_
    size_t size = 0;
  };
  void ParseHeader(std::string_view header, size_t data_begin);
  const Entry& Find(const std::string& name) const;
  const Entry& Find(const std::string& name, DType dtype, const std::vector<int64_t>& shape) const;
  template <typename T>
  std::vector<T> ValuesOf(const Entry& entry) const;
  template <typename T>
  std::vector<T> FiniteValuesOf(const std::string& name, const Entry& entry) const;

  std::filesystem::path path_;
  std::shared_ptr<const void> owner_;
  std::string_view bytes_;
  std::map<std::string, std::string> metadata_;
  std::map<std::string, Entry> entries_;
};

}  // namespace likeness
