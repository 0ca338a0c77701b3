// An ONNX model in the making: inputs, constant tensors and nodes, each named, then the file's bytes.
// https://github.com/onnx/onnx/blob/main/docs/IR.md

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "likeness/decode/export/proto_message.h"

namespace likeness {

// Of the standard operators: the oldest version that has all that is used here in its present form, so that as many
// programs as possible read it (Unity's reads 7 to 15). ONNX's intermediate representation 7 came with it.
inline constexpr int kOnnxOperators = 13;
inline constexpr int kOnnxRepresentation = 7;
inline constexpr int64_t kMostOnnxBytes = (int64_t{1} << 31) - 1;  // what readers of protocol buffers take

class OnnxGraph {
 public:
  enum class Type { kFloat = 1, kInt64 = 7 };  // as the format numbers them
  static constexpr int64_t kBatch = -1;        // an extent that is as large as whoever runs the model makes it
  using Shape = std::vector<int64_t>;
  using Attribute = std::pair<std::string, std::variant<int64_t, float, std::vector<int64_t>>>;

  OnnxGraph(std::filesystem::path path_for_errors, int64_t most_bytes)
      : path_(std::move(path_for_errors)), most_bytes_(most_bytes) {}

  // `meaning` is for people who read the model. All give back the name.
  std::string Input(const std::string& name, Type type, const Shape& shape, const std::string& meaning);
  std::string Output(const std::string& name, const Shape& shape, const std::string& meaning);
  // A constant. Throws Error where the file would become larger than it may.
  std::string Tensor(const std::string& name, const Shape& shape, std::span<const float> values);
  std::string Tensor(const std::string& name, std::span<const int64_t> values);
  // Nodes come in an order in which they can be run; a node has one output, of the node's name.
  std::string Node(const std::string& operation, const std::string& name, const std::vector<std::string>& inputs,
                   const std::vector<Attribute>& attributes = {});

  // The whole file. `metadata` is for programs and people who read the model.
  std::string ModelBytes(const std::string& graph_name, const std::map<std::string, std::string>& metadata);

 private:
  void AddTensor(const std::string& name, const Shape& shape, Type type, std::span<const std::byte> values);

  const std::filesystem::path path_;
  const int64_t most_bytes_;
  ProtoMessage graph_;
};

}  // namespace likeness
