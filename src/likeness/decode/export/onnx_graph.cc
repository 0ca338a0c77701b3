#include "likeness/decode/export/onnx_graph.h"

#include <fmt/format.h>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Numbers of fields in onnx.proto, by message.
namespace model {
enum Field { kRepresentation = 1, kProducer = 2, kGraph = 7, kOperators = 8, kMetadata = 14 };
}
namespace operators {
enum Field { kVersion = 2 };
}
namespace entry {
enum Field { kKey = 1, kValue = 2 };
}
namespace graph {
enum Field { kNode = 1, kName = 2, kTensor = 5, kInput = 11, kOutput = 12 };
}
namespace value {
enum Field { kName = 1, kType = 2, kMeaning = 3 };
}
namespace type {
enum Field { kTensor = 1, kElement = 1, kShape = 2, kDimension = 1, kExtent = 1, kSymbol = 2 };
}
namespace tensor {
enum Field { kExtent = 1, kType = 2, kName = 8, kValues = 9 };
}
namespace node {
enum Field { kInput = 1, kOutput = 2, kName = 3, kOperation = 4, kAttribute = 5 };
}
namespace attribute {
enum Field { kName = 1, kFloat = 2, kInt = 3, kInts = 8, kType = 20 };
enum Type { kOfFloat = 1, kOfInt = 2, kOfInts = 7 };
}  // namespace attribute

ProtoMessage ValueInfo(const std::string& name, OnnxGraph::Type element, const OnnxGraph::Shape& extents,
                       const std::string& meaning) {
  ProtoMessage shape, of_tensor, of_value, info;
  for (const int64_t extent : extents) {
    ProtoMessage dimension;
    if (extent == OnnxGraph::kBatch) {
      dimension.Bytes(type::kSymbol, "batch");
    } else {
      dimension.Int(type::kExtent, extent);
    }
    shape.Message(type::kDimension, dimension);
  }
  of_tensor.Int(type::kElement, static_cast<int64_t>(element));
  of_tensor.Message(type::kShape, shape);
  of_value.Message(type::kTensor, of_tensor);
  info.Bytes(value::kName, name);
  info.Message(value::kType, of_value);
  info.Bytes(value::kMeaning, meaning);
  return info;
}

ProtoMessage AttributeMessage(const OnnxGraph::Attribute& a) {
  ProtoMessage message;
  message.Bytes(attribute::kName, a.first);
  if (const auto* number = std::get_if<float>(&a.second)) {
    message.Float(attribute::kFloat, *number);
    message.Int(attribute::kType, attribute::kOfFloat);
  } else if (const auto* whole = std::get_if<int64_t>(&a.second)) {
    message.Int(attribute::kInt, *whole);
    message.Int(attribute::kType, attribute::kOfInt);
  } else {
    for (const int64_t each : std::get<std::vector<int64_t>>(a.second)) message.Int(attribute::kInts, each);
    message.Int(attribute::kType, attribute::kOfInts);
  }
  return message;
}

}  // namespace

std::string OnnxGraph::Input(const std::string& name, Type type, const Shape& shape, const std::string& meaning) {
  graph_.Message(graph::kInput, ValueInfo(name, type, shape, meaning));
  return name;
}

std::string OnnxGraph::Output(const std::string& name, const Shape& shape, const std::string& meaning) {
  graph_.Message(graph::kOutput, ValueInfo(name, Type::kFloat, shape, meaning));
  return name;
}

std::string OnnxGraph::Tensor(const std::string& name, const Shape& shape, std::span<const float> values) {
  AddTensor(name, shape, Type::kFloat, std::as_bytes(values));
  return name;
}

std::string OnnxGraph::Tensor(const std::string& name, std::span<const int64_t> values) {
  AddTensor(name, {static_cast<int64_t>(values.size())}, Type::kInt64, std::as_bytes(values));
  return name;
}

void OnnxGraph::AddTensor(const std::string& name, const Shape& shape, Type type, std::span<const std::byte> values) {
  constexpr int64_t kRest = 1 << 20;  // room for all that is no tensor
  if (static_cast<int64_t>(graph_.bytes().size() + values.size()) + kRest > most_bytes_) {
    throw FileError(path_, fmt::format("its decoder needs more than the {} MB that an ONNX file can hold; train one of "
                                       "a smaller texture (--size), a smaller code (--latent), or a deep model",
                                       most_bytes_ >> 20));
  }
  ProtoMessage message;
  for (const int64_t extent : shape) message.Int(tensor::kExtent, extent);
  message.Int(tensor::kType, static_cast<int64_t>(type));
  message.Bytes(tensor::kName, name);
  graph_.MessageWithBytes(graph::kTensor, message, tensor::kValues,
                          {reinterpret_cast<const char*>(values.data()), values.size()});
}

std::string OnnxGraph::Node(const std::string& operation, const std::string& name,
                            const std::vector<std::string>& inputs, const std::vector<Attribute>& attributes) {
  ProtoMessage message;
  for (const std::string& input : inputs) message.Bytes(node::kInput, input);
  message.Bytes(node::kOutput, name);
  message.Bytes(node::kName, name);
  message.Bytes(node::kOperation, operation);
  for (const Attribute& a : attributes) message.Message(node::kAttribute, AttributeMessage(a));
  graph_.Message(graph::kNode, message);
  return name;
}

std::string OnnxGraph::ModelBytes(const std::string& graph_name, const std::map<std::string, std::string>& metadata) {
  ProtoMessage file, version;
  file.Int(model::kRepresentation, kOnnxRepresentation);
  file.Bytes(model::kProducer, "likeness");
  version.Int(operators::kVersion, kOnnxOperators);
  file.Message(model::kOperators, version);
  for (const auto& [key, text] : metadata) {
    ProtoMessage each;
    each.Bytes(entry::kKey, key);
    each.Bytes(entry::kValue, text);
    file.Message(model::kMetadata, each);
  }
  graph_.Bytes(graph::kName, graph_name);
  file.Message(model::kGraph, graph_);
  return file.TakeBytes();
}

}  // namespace likeness
