#include "likeness/simulate/glb/gltf_file.h"

#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"

namespace likeness {
namespace {

using nlohmann::json;

constexpr int kDeepest = 32;  // nesting of JSON; tinygltf reads extras recursively

struct Container {
  std::string_view text;
  std::string_view binary;  // empty when there is none
};

uint32_t Word(std::string_view bytes, size_t offset) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof(word));
  return word;
}

Container OpenContainer(const std::filesystem::path& path, std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return {bytes, {}};
  constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  if (bytes.size() < 20) throw FileError(path, "ends within its header: cut off?");
  if (Word(bytes, 4) != 2) throw FileError(path, fmt::format("is GLB version {}, expected 2", Word(bytes, 4)));
  if (Word(bytes, 8) > bytes.size()) {
    throw FileError(path, fmt::format("says that it has {} bytes but has {}: cut off?", Word(bytes, 8), bytes.size()));
  }
  Container container;
  size_t offset = 12;
  for (int chunk = 0; chunk < 2 && bytes.size() - offset >= 8; ++chunk) {
    const size_t length = Word(bytes, offset);
    const uint32_t kind = Word(bytes, offset + 4);
    offset += 8;
    if (length > bytes.size() - offset) throw FileError(path, fmt::format("chunk {} ends after the file", chunk));
    if (chunk == 0 && kind != kJson) throw FileError(path, "the first chunk is not JSON");
    if (kind == kJson && chunk == 0) container.text = bytes.substr(offset, length);
    if (kind == kBinary && chunk == 1) container.binary = bytes.substr(offset, length);
    offset += length;
  }
  return container;
}

json ParseText(const std::filesystem::path& path, std::string_view text) {
  bool too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t, json&) {
    too_deep |= depth > kDeepest;
    return !too_deep;
  };
  json document = json::parse(text.begin(), text.end(), watch, /*allow_exceptions=*/false);
  if (too_deep) throw FileError(path, fmt::format("its JSON is nested more than {} deep", kDeepest));
  if (!document.is_object()) throw FileError(path, "is no glTF: neither a GLB nor JSON");
  return document;
}

// A member that is a whole number from 0 to 2^53; `otherwise` when it is absent.
uint64_t Natural(const std::filesystem::path& path, const json& object, const char* name, uint64_t otherwise) {
  if (!object.is_object() || !object.contains(name)) return otherwise;
  const json& value = object[name];
  if (!value.is_number_unsigned() || value.get<uint64_t>() > (uint64_t{1} << 53)) {
    throw FileError(path, fmt::format("{}: {} is not a whole number from 0 on", name, value.dump()));
  }
  return value.get<uint64_t>();
}

const json& Array(const std::filesystem::path& path, const json& document, const char* name) {
  static const json none = json::array();
  if (!document.contains(name)) return none;
  if (!document[name].is_array()) throw FileError(path, fmt::format("'{}' is no list", name));
  return document[name];
}

void CheckExtensions(const std::filesystem::path& path, const json& document) {
  for (const json& name : Array(path, document, "extensionsRequired")) {
    const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
    const bool known = text == "EXT_meshopt_compression" || text == "EXT_texture_webp" ||
                       text == "KHR_mesh_quantization" || text == "KHR_texture_transform" ||
                       text.starts_with("KHR_materials_");
    if (!known) {
      throw FileError(path, fmt::format("needs the extension {}, which is not supported; export it without", text));
    }
  }
}

bool IsFallback(const json& buffer) {
  if (!buffer.is_object() || !buffer.contains("extensions") || !buffer["extensions"].is_object()) return false;
  const json& extensions = buffer["extensions"];
  return extensions.contains("EXT_meshopt_compression") && extensions["EXT_meshopt_compression"].is_object() &&
         extensions["EXT_meshopt_compression"].value("fallback", json(false)) == json(true);
}

// Makes the document one that tinygltf can read without leaving its buffers.
void Prepare(const std::filesystem::path& path, const Container& container, json* document) {
  std::vector<uint64_t> lengths;
  if (!Array(path, *document, "buffers").empty()) {
    json& buffers = (*document)["buffers"];
    for (size_t i = 0; i < buffers.size(); ++i) {
      json& buffer = buffers[i];
      if (!buffer.is_object()) throw FileError(path, fmt::format("buffer {} is no object", i));
      const uint64_t length = Natural(path, buffer, "byteLength", 0);
      if (IsFallback(buffer)) {
        buffer["uri"] = "data:application/octet-stream;base64,AAAA";
        buffer["byteLength"] = 3;
        lengths.push_back(0);
        continue;
      }
      if (length == 0) throw FileError(path, fmt::format("buffer {} has no bytes", i));
      if (!buffer.contains("uri") && (i != 0 || container.binary.size() < length)) {
        throw FileError(path, fmt::format("buffer {} should have {} bytes but the file holds {}", i, length,
                                          i == 0 ? container.binary.size() : 0));
      }
      lengths.push_back(length);
    }
  }
  // tinygltf reads images where their views say without a look at the buffer's length.
  const json& views = Array(path, *document, "bufferViews");
  for (const json& image : Array(path, *document, "images")) {
    if (!image.is_object() || !image.contains("bufferView")) continue;
    const uint64_t view = Natural(path, image, "bufferView", 0);
    if (view >= views.size()) throw FileError(path, fmt::format("an image lies in view {}, which is absent", view));
    const uint64_t buffer = Natural(path, views[view], "buffer", 0);
    const uint64_t offset = Natural(path, views[view], "byteOffset", 0);
    const uint64_t length = Natural(path, views[view], "byteLength", 0);
    if (buffer >= lengths.size() || offset > lengths[buffer] || length > lengths[buffer] - offset || length == 0) {
      throw FileError(path, fmt::format("an image lies in view {}, which leaves its buffer", view));
    }
  }
}

bool KeepEncoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                 int size, void*) {
  image->image.assign(bytes, bytes + size);
  image->as_is = true;
  return true;
}

// What tinygltf calls when a file names another one.
struct Beside {
  const ReadBeside* read;
  std::string failure;
};

bool BesideExists(const std::string&, void*) { return true; }
std::string BesideExpand(const std::string& path, void*) { return path; }
bool BesideRead(std::vector<unsigned char>* out, std::string* failure, const std::string& name, void* context) {
  auto* beside = static_cast<Beside*>(context);
  try {
    std::filesystem::path relative = std::filesystem::path(name).lexically_normal();
    if (relative.empty() || relative.is_absolute() || *relative.begin() == "..") {
      throw Error("names the file '{}', which is not in its folder", name);
    }
    if (!*beside->read) throw Error("names the file '{}' beside it, which cannot be read here", name);
    const std::string content = (*beside->read)(relative.string());
    out->assign(content.begin(), content.end());
    return true;
  } catch (const Error& error) {
    beside->failure = error.what();
    *failure = error.what();
    return false;
  }
}

}  // namespace

tinygltf::Model ParseGltfFile(const std::filesystem::path& path_for_errors, std::string_view bytes,
                              const ReadBeside& read_beside) {
  const Container container = OpenContainer(path_for_errors, bytes);
  json document = ParseText(path_for_errors, container.text);
  CheckExtensions(path_for_errors, document);
  Prepare(path_for_errors, container, &document);

  // tinygltf takes the container as one piece.
  std::string text = document.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::string_view binary = container.binary.substr(0, container.binary.size() / 4 * 4);
  std::string whole = "glTF";
  const auto append_word = [&](size_t word) {
    const auto w = static_cast<uint32_t>(word);
    whole.append(reinterpret_cast<const char*>(&w), sizeof(w));
  };
  const size_t size = 20 + text.size() + (binary.empty() ? 0 : 8 + binary.size());
  if (size > std::numeric_limits<int>::max()) throw FileError(path_for_errors, "is over 2 GB");
  append_word(2);
  append_word(size);
  append_word(text.size());
  append_word(0x4E4F534A);
  whole += text;
  if (!binary.empty()) {
    append_word(binary.size());
    append_word(0x004E4942);
    whole += binary;
  }

  tinygltf::TinyGLTF reader;
  Beside beside{&read_beside, {}};
  reader.SetImageLoader(KeepEncoded, nullptr);
  reader.SetFsCallbacks({BesideExists, BesideExpand, BesideRead, nullptr, &beside});
  tinygltf::Model model;
  std::string failure, warning;
  bool good = false;
  try {
    good = reader.LoadBinaryFromMemory(&model, &failure, &warning, reinterpret_cast<const unsigned char*>(whole.data()),
                                       static_cast<unsigned int>(whole.size()), "");
  } catch (const std::exception& thrown) {
    failure = thrown.what();
  }
  if (!beside.failure.empty()) throw FileError(path_for_errors, beside.failure);
  if (!good) {
    while (!failure.empty() && failure.back() == '\n') failure.pop_back();
    throw FileError(path_for_errors, "is no readable glTF: " + failure);
  }
  return model;
}

}  // namespace likeness
