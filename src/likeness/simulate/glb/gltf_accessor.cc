#include "likeness/simulate/glb/gltf_accessor.h"

#include <meshoptimizer.h>

#include <cmath>
#include <cstring>
#include <type_traits>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Accessors without a view, and views that many accessors share, cost no bytes in the file: bounds on what is read.
constexpr size_t kMostNumbers = size_t{1} << 27;      // of one file
constexpr size_t kMostFreeNumbers = size_t{1} << 22;  // of an accessor without a view

template <typename T>
T Load(const unsigned char* p) {
  T value;
  std::memcpy(&value, p, sizeof(value));
  return value;
}

template <typename T>
float Fraction(T value, bool normalized) {
  if (!normalized) return static_cast<float>(value);
  const float scaled = static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max());
  return std::max(scaled, -1.0f);
}

float FloatAt(const unsigned char* p, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return Fraction(Load<int8_t>(p), normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return Fraction(Load<uint8_t>(p), normalized);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return Fraction(Load<int16_t>(p), normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return Fraction(Load<uint16_t>(p), normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return Fraction(Load<uint32_t>(p), normalized);
    default:
      return Load<float>(p);
  }
}

uint32_t NaturalAt(const unsigned char* p, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return Load<uint8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return Load<uint16_t>(p);
    default:
      return Load<uint32_t>(p);
  }
}

bool IsNaturalType(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

// Bytes of one number, 0 for unknown types.
size_t ComponentSize(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

// Columns of matrices of small components are padded in memory; heads have none, so those are refused.
int ComponentCount(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    case TINYGLTF_TYPE_MAT4:
      return 16;
    default:
      return 0;
  }
}

}  // namespace

void GltfAccessors::Fail(const std::string& message) const { throw FileError(path_, message); }

void GltfAccessors::Spend(size_t numbers) {
  if (numbers > kMostNumbers - spent_) Fail(fmt::format("holds more than {} numbers", kMostNumbers));
  spent_ += numbers;
}

const tinygltf::Accessor& GltfAccessors::At(int accessor) const {
  if (accessor < 0 || static_cast<size_t>(accessor) >= model_.accessors.size()) {
    Fail(fmt::format("refers to accessor {}, but there are {}", accessor, model_.accessors.size()));
  }
  return model_.accessors[static_cast<size_t>(accessor)];
}

size_t GltfAccessors::Count(int accessor) const {
  const size_t count = At(accessor).count;
  if (count == 0 || count > kMostNumbers) Fail(fmt::format("accessor {} claims {} elements", accessor, count));
  return count;
}

std::span<const unsigned char> GltfAccessors::Decompress(int view, const tinygltf::Value& extension) {
  if (const auto found = decompressed_.find(view); found != decompressed_.end()) return found->second;
  const auto number = [&](const char* name, int64_t otherwise) -> size_t {
    if (!extension.Has(name)) {
      if (otherwise < 0) Fail(fmt::format("view {}: its compression has no {}", view, name));
      return static_cast<size_t>(otherwise);
    }
    const tinygltf::Value& value = extension.Get(name);
    const double n = value.IsNumber() ? value.GetNumberAsDouble() : -1;
    if (!(n >= 0 && n <= 4e9) || n != std::floor(n)) Fail(fmt::format("view {}: {} is no whole number", view, name));
    return static_cast<size_t>(n);
  };
  const auto word = [&](const char* name) -> std::string {
    return extension.Has(name) && extension.Get(name).IsString() ? extension.Get(name).Get<std::string>() : "";
  };
  const size_t buffer = number("buffer", -1), offset = number("byteOffset", 0), length = number("byteLength", -1);
  const size_t stride = number("byteStride", -1), count = number("count", -1);
  if (buffer >= model_.buffers.size()) Fail(fmt::format("view {} lies in buffer {}, which is absent", view, buffer));
  const std::vector<unsigned char>& source = model_.buffers[buffer].data;
  if (offset > source.size() || length > source.size() - offset) Fail(fmt::format("view {} leaves its buffer", view));
  const unsigned char* packed = source.data() + offset;

  const std::string mode = word("mode"), filter = word("filter");
  const bool attributes = mode == "ATTRIBUTES", triangles = mode == "TRIANGLES", indices = mode == "INDICES";
  const bool sound = attributes ? stride > 0 && stride <= 256 && stride % 4 == 0
                                : (stride == 2 || stride == 4) && (!triangles || count % 3 == 0);
  if (!(attributes || triangles || indices) || !sound || count == 0) {
    Fail(fmt::format("view {}: compression '{}' of {} elements of {} bytes is unknown", view, mode, count, stride));
  }
  // The densest that each mode can be; more is a lie.
  const size_t most = attributes ? 64 * length / stride : triangles ? 3 * length : length;
  if (count > most) Fail(fmt::format("view {} claims {} elements in {} bytes", view, count, length));
  Spend(count * stride / 4);
  std::vector<unsigned char> bytes(count * stride);
  const int code = attributes  ? meshopt_decodeVertexBuffer(bytes.data(), count, stride, packed, length)
                   : triangles ? meshopt_decodeIndexBuffer(bytes.data(), count, stride, packed, length)
                               : meshopt_decodeIndexSequence(bytes.data(), count, stride, packed, length);
  if (code != 0) Fail(fmt::format("view {} is damaged: its compression cannot be undone", view));
  if (attributes && filter == "OCTAHEDRAL" && (stride == 4 || stride == 8)) {
    meshopt_decodeFilterOct(bytes.data(), count, stride);
  } else if (attributes && filter == "QUATERNION" && stride == 8) {
    meshopt_decodeFilterQuat(bytes.data(), count, stride);
  } else if (attributes && filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(bytes.data(), count, stride);
  } else if (!filter.empty() && filter != "NONE") {
    Fail(fmt::format("view {}: the filter '{}' is unknown here", view, filter));
  }
  return decompressed_[view] = std::move(bytes);
}

std::span<const unsigned char> GltfAccessors::ViewBytes(int view) {
  if (view < 0 || static_cast<size_t>(view) >= model_.bufferViews.size()) {
    Fail(fmt::format("refers to buffer view {}, but there are {}", view, model_.bufferViews.size()));
  }
  const tinygltf::BufferView& described = model_.bufferViews[static_cast<size_t>(view)];
  const auto extension = described.extensions.find("EXT_meshopt_compression");
  if (extension != described.extensions.end()) return Decompress(view, extension->second);
  if (described.buffer < 0 || static_cast<size_t>(described.buffer) >= model_.buffers.size()) {
    Fail(fmt::format("view {} lies in buffer {}, which is absent", view, described.buffer));
  }
  const std::vector<unsigned char>& data = model_.buffers[static_cast<size_t>(described.buffer)].data;
  if (described.byteOffset > data.size() || described.byteLength > data.size() - described.byteOffset) {
    Fail(fmt::format("view {} leaves its buffer", view));
  }
  return std::span(data).subspan(described.byteOffset, described.byteLength);
}

GltfAccessors::Elements GltfAccessors::Locate(const std::string& what, int view, size_t offset, size_t count,
                                              size_t element_size) {
  const std::span<const unsigned char> bytes = ViewBytes(view);
  const size_t given = model_.bufferViews[static_cast<size_t>(view)].byteStride;
  const size_t stride = given == 0 ? element_size : given;
  if (stride < element_size || stride > 256) Fail(fmt::format("{}: a stride of {} bytes", what, stride));
  if (offset > bytes.size() || element_size > bytes.size() - offset ||
      count - 1 > (bytes.size() - offset - element_size) / stride) {
    Fail(fmt::format("{} claims {} elements, more than its {} bytes hold", what, count, bytes.size()));
  }
  return {bytes.data() + offset, stride};
}

template <typename T, typename Convert>
std::vector<T> GltfAccessors::Read(int index, int components, size_t wanted, const Convert& convert) {
  const tinygltf::Accessor& accessor = At(index);
  const std::string what = fmt::format("accessor {}", index);
  const size_t count = Count(index);
  if (wanted != 0 && count != wanted) Fail(fmt::format("{} has {} elements, expected {}", what, count, wanted));
  const size_t size = ComponentSize(accessor.componentType);
  if (size == 0 || ComponentCount(accessor.type) != components ||
      (std::is_same_v<T, uint32_t> && !IsNaturalType(accessor.componentType))) {
    Fail(fmt::format("{} has type {} of {}, which is not expected there", what, accessor.type, accessor.componentType));
  }
  const auto width = static_cast<size_t>(components);
  Spend(count * width);
  std::vector<T> numbers;
  const auto read_element = [&](const unsigned char* from, size_t to) {
    for (size_t k = 0; k < width; ++k) numbers[to * width + k] = convert(from + k * size, accessor);
  };
  if (accessor.bufferView >= 0) {
    const Elements elements = Locate(what, accessor.bufferView, accessor.byteOffset, count, size * width);
    numbers.resize(count * width);
    for (size_t i = 0; i < count; ++i) read_element(elements.data + i * elements.stride, i);
  } else {
    if (count * width > kMostFreeNumbers) Fail(fmt::format("{} claims {} elements without a view", what, count));
    numbers.resize(count * width);
  }
  if (accessor.sparse.isSparse) {
    const auto& sparse = accessor.sparse;
    const size_t index_size = ComponentSize(sparse.indices.componentType);
    if (sparse.count <= 0 || static_cast<size_t>(sparse.count) > count ||
        !IsNaturalType(sparse.indices.componentType) || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) {
      Fail(what + ": its sparse part is wrong");
    }
    const auto few = static_cast<size_t>(sparse.count);
    const Elements where =
        Locate(what, sparse.indices.bufferView, static_cast<size_t>(sparse.indices.byteOffset), few, index_size);
    const Elements values =
        Locate(what, sparse.values.bufferView, static_cast<size_t>(sparse.values.byteOffset), few, size * width);
    for (size_t i = 0; i < few; ++i) {
      const uint32_t to = NaturalAt(where.data + i * where.stride, sparse.indices.componentType);
      if (to >= count) Fail(fmt::format("{}: a sparse element is number {} of {}", what, to, count));
      read_element(values.data + i * values.stride, to);
    }
  }
  return numbers;
}

std::vector<float> GltfAccessors::Floats(int accessor, int components, size_t count) {
  std::vector<float> numbers = Read<float>(
      accessor, components, count,
      [](const unsigned char* p, const tinygltf::Accessor& a) { return FloatAt(p, a.componentType, a.normalized); });
  for (const float number : numbers) {
    // Squares and products of such numbers stay finite.
    if (!(std::abs(number) < 1e9f))
      Fail(fmt::format("accessor {} holds {}, which is no sound number", accessor, number));
  }
  return numbers;
}

std::vector<uint32_t> GltfAccessors::Naturals(int accessor, int components, size_t count) {
  return Read<uint32_t>(accessor, components, count, [](const unsigned char* p, const tinygltf::Accessor& a) {
    return NaturalAt(p, a.componentType);
  });
}

}  // namespace likeness
