// Numbers out of a glTF's accessors: every range is checked before memory is touched. Knows quantised and sparse
// accessors and EXT_meshopt_compression.

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "likeness/simulate/glb/gltf_file.h"

namespace likeness {

class GltfAccessors {
 public:
  // Both are borrowed.
  GltfAccessors(const std::filesystem::path& path_for_errors, const tinygltf::Model& model)
      : path_(path_for_errors), model_(model) {}

  // The accessor's `components` numbers an element, element by element; normalised integers as fractions. Throws Error
  // when it has another type or a number is not finite.
  //   count  wanted elements; 0: any
  std::vector<float> Floats(int accessor, int components, size_t count = 0);

  // The same of unsigned integers.
  std::vector<uint32_t> Naturals(int accessor, int components, size_t count = 0);

  // How many elements the accessor says that it has.
  size_t Count(int accessor) const;

 private:
  // Elements lie `stride` bytes apart; all of them are in memory.
  struct Elements {
    const unsigned char* data = nullptr;  // null: all zero
    size_t stride = 0;
  };

  const tinygltf::Accessor& At(int accessor) const;
  std::span<const unsigned char> ViewBytes(int view);
  std::span<const unsigned char> Decompress(int view, const tinygltf::Value& extension);
  Elements Locate(const std::string& what, int view, size_t offset, size_t count, size_t element_size);
  template <typename T, typename Convert>
  std::vector<T> Read(int accessor, int components, size_t count, const Convert& convert);
  [[noreturn]] void Fail(const std::string& message) const;
  void Spend(size_t numbers);

  const std::filesystem::path& path_;
  const tinygltf::Model& model_;
  std::map<int, std::vector<unsigned char>> decompressed_;  // by buffer view
  size_t spent_ = 0;
};

}  // namespace likeness
