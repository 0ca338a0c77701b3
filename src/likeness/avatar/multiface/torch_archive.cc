#include "likeness/avatar/multiface/torch_archive.h"

#include <zip.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>

#include "likeness/avatar/multiface/pickle.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"

namespace likeness {

namespace {

constexpr uint64_t kMostPickleBytes = 16 << 20;
constexpr size_t kMostAxes = 8;

// The entries of a zip in memory.
class StoredZip {
 public:
  StoredZip(const std::filesystem::path& path, std::string_view bytes) : path_(path), bytes_(bytes) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), /*freep=*/0, &error);
    zip_t* zip = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
    if (zip == nullptr) {
      const std::string reason = zip_error_strerror(&error);
      zip_error_fini(&error);
      if (source != nullptr) zip_source_free(source);
      throw FileError(path, fmt::format("is no checkpoint in PyTorch's zip format ({}); save it again with PyTorch 1.6 "
                                        "or newer",
                                        reason));
    }
    zip_error_fini(&error);
    zip_.reset(zip);
    for (zip_int64_t i = 0; i < zip_get_num_entries(zip, 0); ++i) {
      const std::string name = NameOf(i);
      const size_t slash = name.find('/');
      if (slash != std::string::npos && name.substr(slash) == "/data.pkl") folder_ = name.substr(0, slash + 1);
    }
    if (folder_.empty()) throw FileError(path, "is a zip without data.pkl; expected a checkpoint of torch.save");
  }

  const std::filesystem::path& path() const { return path_; }

  // `name` is relative to the folder that holds all; none where there is no such entry.
  std::optional<std::string> Find(const std::string& name) const {
    const zip_int64_t index = zip_name_locate(zip_.get(), (folder_ + name).c_str(), 0);
    if (index < 0) return std::nullopt;
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_stat_index(zip_.get(), index, 0, &stat) != 0) Fail(name);
    if (stat.comp_method != ZIP_CM_STORE || stat.encryption_method != ZIP_EM_NONE || stat.size > bytes_.size()) {
      throw FileError(path_,
                      fmt::format("its entry {} is compressed, encrypted or cut off; torch.save stores it", name));
    }
    std::string content(stat.size, '\0');
    const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(zip_fopen_index(zip_.get(), index, 0), &zip_fclose);
    if (file == nullptr ||
        zip_fread(file.get(), content.data(), content.size()) != static_cast<zip_int64_t>(content.size())) {
      Fail(name);
    }
    return content;
  }

  std::string Read(const std::string& name) const {
    std::optional<std::string> content = Find(name);
    if (!content) throw FileError(path_, fmt::format("lacks its entry {}", name));
    return std::move(*content);
  }

 private:
  std::string NameOf(zip_int64_t index) const {
    const char* name = zip_get_name(zip_.get(), index, 0);
    return name == nullptr ? "" : name;
  }
  [[noreturn]] void Fail(const std::string& name) const {
    throw FileError(path_, fmt::format("its entry {} is damaged: {}", name, zip_strerror(zip_.get())));
  }

  const std::filesystem::path path_;
  const std::string_view bytes_;
  std::unique_ptr<zip_t, decltype(&zip_discard)> zip_{nullptr, &zip_discard};
  std::string folder_;
};

float FromHalf(uint16_t half) {
  const uint32_t sign = static_cast<uint32_t>(half & 0x8000) << 16, exponent = half >> 10 & 31, fraction = half & 1023;
  if (exponent == 0) {
    const float magnitude = std::ldexp(static_cast<float>(fraction), -24);
    return sign != 0 ? -magnitude : magnitude;
  }
  const uint32_t wide = exponent == 31 ? 255 : exponent + 112;
  return std::bit_cast<float>(sign | wide << 23 | fraction << 13);
}

struct StorageType {
  const char* name;  // as the pickle calls it
  size_t bytes;
  float (*read)(const char* at);
};

template <typename T>
T Load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(value));
  return value;
}

constexpr StorageType kStorageTypes[] = {
    {"torch FloatStorage", 4, [](const char* at) { return Load<float>(at); }},
    {"torch DoubleStorage", 8, [](const char* at) { return static_cast<float>(Load<double>(at)); }},
    {"torch HalfStorage", 2, [](const char* at) { return FromHalf(Load<uint16_t>(at)); }},
    {"torch BFloat16Storage", 2,
     [](const char* at) { return std::bit_cast<float>(static_cast<uint32_t>(Load<uint16_t>(at)) << 16); }},
};

class TensorReader {
 public:
  // Tensors may share a storage, but not so that a small file becomes a large network: both budgets follow the file's
  // size.
  TensorReader(const StoredZip& zip, const Pickle& pickle, uint64_t file_bytes)
      : zip_(zip), pickle_(pickle), values_left_(file_bytes), storage_left_(2 * file_bytes) {}

  // None when the node is no tensor.
  std::optional<Tensor> Read(const std::string& name, const Pickle::Node& node) {
    if (const auto parameter = pickle_.ArgumentsOf(node, "torch._utils _rebuild_parameter")) {
      return parameter->empty() ? std::nullopt : ReadPlain(name, pickle_.at(parameter->front()));
    }
    return ReadPlain(name, node);
  }

 private:
  [[noreturn]] void Fail(const std::string& name, const std::string& what) const {
    throw FileError(zip_.path(), fmt::format("the tensor '{}' {}", name, what));
  }

  std::vector<int64_t> Integers(const std::string& name, const Pickle::Node& tuple) const {
    if (tuple.kind != Pickle::Kind::kTuple || tuple.items.size() > kMostAxes) Fail(name, "has an odd shape");
    std::vector<int64_t> values;
    for (const Pickle::Ref item : tuple.items) {
      const Pickle::Node& node = pickle_.at(item);
      if (node.kind != Pickle::Kind::kInteger || node.integer < 0) Fail(name, "has an odd shape");
      values.push_back(node.integer);
    }
    return values;
  }

  // Arguments: storage, offset, shape, strides, and what matters to training alone.
  std::optional<Tensor> ReadPlain(const std::string& name, const Pickle::Node& node) {
    const auto arguments = pickle_.ArgumentsOf(node, "torch._utils _rebuild_tensor_v2");
    if (!arguments) return std::nullopt;
    if (arguments->size() < 4) Fail(name, "is not described as torch.save does");
    const Pickle::Node& offset = pickle_.at((*arguments)[1]);
    const std::vector<int64_t> shape = Integers(name, pickle_.at((*arguments)[2]));
    const std::vector<int64_t> strides = Integers(name, pickle_.at((*arguments)[3]));
    if (offset.kind != Pickle::Kind::kInteger || offset.integer < 0 || shape.size() != strides.size()) {
      Fail(name, "has an odd shape");
    }
    const auto [type, bytes] = ReadStorage(name, pickle_.at((*arguments)[0]));
    const uint64_t available = bytes.size() / type->bytes;

    // The farthest value, and the number of values, without overflow.
    uint64_t last = offset.integer, count = 1;
    bool fits = true;
    for (size_t axis = 0; axis < shape.size(); ++axis) {
      uint64_t reach = 0;
      if (shape[axis] > 0) {
        fits = fits && !__builtin_mul_overflow(static_cast<uint64_t>(shape[axis] - 1),
                                               static_cast<uint64_t>(strides[axis]), &reach);
      }
      fits = fits && !__builtin_add_overflow(last, reach, &last);
      fits = fits && !__builtin_mul_overflow(count, static_cast<uint64_t>(shape[axis]), &count);
    }
    if (!fits || (count > 0 && last >= available)) Fail(name, "reaches beyond its storage");
    if (count > values_left_) Fail(name, "and those before it have more values than the file has bytes");
    values_left_ -= count;

    Tensor tensor{shape, std::vector<float>(count)};
    std::vector<int64_t> index(shape.size(), 0);
    uint64_t from = offset.integer;
    for (float& value : tensor.values) {
      value = type->read(bytes.data() + from * type->bytes);
      for (size_t axis = shape.size(); axis-- > 0;) {
        from += strides[axis];
        if (++index[axis] < shape[axis]) break;
        from -= static_cast<uint64_t>(strides[axis]) * shape[axis];
        index[axis] = 0;
      }
    }
    return tensor;
  }

  // Identifier of a storage: ("storage", type, entry, device, values).
  std::pair<const StorageType*, std::string> ReadStorage(const std::string& name, const Pickle::Node& node) {
    if (node.kind != Pickle::Kind::kPersistent) Fail(name, "has no storage");
    const Pickle::Node& identifier = pickle_.at(node.items[0]);
    if (identifier.kind != Pickle::Kind::kTuple || identifier.items.size() < 5 ||
        pickle_.at(identifier.items[0]).text != "storage") {
      Fail(name, "has a storage that is not described as torch.save does");
    }
    const std::string& type_name = pickle_.at(identifier.items[1]).text;
    for (const StorageType& type : kStorageTypes) {
      if (type_name != type.name) continue;
      std::string bytes = zip_.Read("data/" + pickle_.at(identifier.items[2]).text);
      if (bytes.size() > storage_left_) Fail(name, "shares its storage with too many others");
      storage_left_ -= bytes.size();
      return {&type, std::move(bytes)};
    }
    Fail(name, fmt::format("is of type '{}'; understood are float, double, half and bfloat16", type_name));
  }

  const StoredZip& zip_;
  const Pickle& pickle_;
  uint64_t values_left_;
  uint64_t storage_left_;  // bytes
};

}  // namespace

std::map<std::string, Tensor> ReadTorchArchive(const std::filesystem::path& path) {
  return ParseTorchArchive(path, ReadFile(path));
}

std::map<std::string, Tensor> ParseTorchArchive(const std::filesystem::path& path, std::string_view bytes) {
  const StoredZip zip(path, bytes);
  if (const std::optional<std::string> order = zip.Find("byteorder"); order && *order != "little") {
    throw FileError(path, fmt::format("its byte order is '{}'; expected little", *order));
  }
  const std::string text = zip.Read("data.pkl");
  if (text.size() > kMostPickleBytes) throw FileError(path, "its pickle is larger than that of any network");
  const Pickle pickle = Pickle::Parse(path, text);
  const Pickle::Node& root = pickle.root();
  if (root.kind != Pickle::Kind::kDict && !pickle.ArgumentsOf(root, "collections OrderedDict")) {
    throw FileError(path, "holds no dictionary of tensors; expected a state_dict that torch.save wrote");
  }
  std::map<std::string, Tensor> tensors;
  TensorReader reader(zip, pickle, bytes.size());
  for (const auto& [key, value] : root.pairs) {
    const Pickle::Node& name = pickle.at(key);
    if (name.kind != Pickle::Kind::kString) throw FileError(path, "names a tensor by something else than a word");
    if (std::optional<Tensor> tensor = reader.Read(name.text, pickle.at(value))) {
      tensors.insert_or_assign(name.text, std::move(*tensor));
    }
  }
  if (tensors.empty()) throw FileError(path, "holds no tensors; expected a state_dict that torch.save wrote");
  return tensors;
}

}  // namespace likeness
