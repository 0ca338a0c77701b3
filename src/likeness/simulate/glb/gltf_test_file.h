// Writes small GLB files for tests: plain, quantised, compressed, sparse, with nodes and skins.

#pragma once

#include <meshoptimizer.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

class GltfTestFile {
 public:
  nlohmann::json document = {{"asset", {{"version", "2.0"}}},
                             {"scene", 0},
                             {"scenes", {{{"nodes", nlohmann::json::array()}}}},
                             {"nodes", nlohmann::json::array()},
                             {"meshes", nlohmann::json::array()},
                             {"accessors", nlohmann::json::array()},
                             {"bufferViews", nlohmann::json::array()}};

  // Appends bytes and returns the number of their view.
  int AddView(std::string_view bytes, size_t stride = 0) {
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    nlohmann::json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (stride != 0) view["byteStride"] = stride;
    binary_ += bytes;
    document["bufferViews"].push_back(view);
    return static_cast<int>(document["bufferViews"].size()) - 1;
  }
  template <typename T>
  int AddView(const std::vector<T>& values, size_t stride = 0) {
    return AddView(std::string_view(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)), stride);
  }

  // The same under EXT_meshopt_compression, in mode ATTRIBUTES (stride a multiple of 4) or TRIANGLES (uint32_t).
  template <typename T>
  int AddCompressed(const std::vector<T>& values, size_t stride, const std::string& mode) {
    const size_t bytes = values.size() * sizeof(T), count = bytes / stride;
    std::vector<unsigned char> packed;
    if (mode == "ATTRIBUTES") {
      packed.resize(meshopt_encodeVertexBufferBound(count, stride));
      packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), values.data(), count, stride));
    } else {
      packed.resize(meshopt_encodeIndexBufferBound(count, count));
      packed.resize(meshopt_encodeIndexBuffer(packed.data(), packed.size(),
                                              reinterpret_cast<const unsigned int*>(values.data()), count));
    }
    const int view = AddView(packed);
    nlohmann::json& described = document["bufferViews"][view];
    described["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                          {"byteOffset", described["byteOffset"]},
                                                          {"byteLength", described["byteLength"]},
                                                          {"byteStride", stride},
                                                          {"count", count},
                                                          {"mode", mode}};
    described["buffer"] = 1;
    described["byteOffset"] = 0;
    described["byteLength"] = bytes;
    if (mode == "ATTRIBUTES") described["byteStride"] = stride;
    has_fallback_ = true;
    return view;
  }

  int AddAccessor(int view, int component_type, const std::string& type, size_t count, bool normalized = false) {
    nlohmann::json accessor = {{"componentType", component_type}, {"type", type}, {"count", count}};
    if (view >= 0) accessor["bufferView"] = view;
    if (normalized) accessor["normalized"] = true;
    document["accessors"].push_back(accessor);
    return static_cast<int>(document["accessors"].size()) - 1;
  }
  int AddVectors(const std::vector<std::array<float, 3>>& vectors) {
    return AddAccessor(AddView(vectors), 5126, "VEC3", vectors.size());
  }
  int AddIndices(const std::vector<Eigen::Vector3i>& triangles) {
    return AddAccessor(AddView(triangles), 5125, "SCALAR", 3 * triangles.size());
  }
  // All zero but for some elements.
  int AddSparse(size_t count, const std::vector<uint16_t>& where, const std::vector<std::array<float, 3>>& values) {
    const int indices = AddView(where), vectors = AddView(values);
    const int accessor = AddAccessor(-1, 5126, "VEC3", count);
    document["accessors"][accessor]["sparse"] = {{"count", where.size()},
                                                 {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                                 {"values", {{"bufferView", vectors}}}};
    return accessor;
  }

  // Positions and triangles, with morph targets [name, deltas] where there are any. Returns the mesh.
  int AddMesh(const std::string& name, const std::vector<std::array<float, 3>>& positions,
              const std::vector<Eigen::Vector3i>& triangles,
              const std::vector<std::pair<std::string, std::vector<std::array<float, 3>>>>& morphs = {}) {
    nlohmann::json primitive = {{"attributes", {{"POSITION", AddVectors(positions)}}},
                                {"indices", AddIndices(triangles)}};
    nlohmann::json names = nlohmann::json::array();
    for (const auto& [target, deltas] : morphs) {
      primitive["targets"].push_back({{"POSITION", AddVectors(deltas)}});
      names.push_back(target);
    }
    nlohmann::json mesh = {{"name", name}, {"primitives", {primitive}}};
    if (!morphs.empty()) mesh["extras"] = {{"targetNames", names}};
    document["meshes"].push_back(mesh);
    return static_cast<int>(document["meshes"].size()) - 1;
  }

  int AddNode(const nlohmann::json& node, bool root = true) {
    document["nodes"].push_back(node);
    const int index = static_cast<int>(document["nodes"].size()) - 1;
    if (root) document["scenes"][0]["nodes"].push_back(index);
    return index;
  }

  std::string Bytes() const {
    nlohmann::json whole = document;
    whole["buffers"] = {{{"byteLength", binary_.size()}}};
    if (has_fallback_) {
      whole["buffers"].push_back(
          {{"byteLength", 1 << 24}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
      whole["extensionsRequired"].push_back("EXT_meshopt_compression");
    }
    std::string text = whole.dump(), binary = binary_;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    std::string bytes = "glTF";
    const auto append = [&](uint32_t word) { bytes.append(reinterpret_cast<const char*>(&word), 4); };
    append(2);
    append(static_cast<uint32_t>(28 + text.size() + binary.size()));
    append(static_cast<uint32_t>(text.size()));
    append(0x4E4F534A);
    bytes += text;
    append(static_cast<uint32_t>(binary.size()));
    append(0x004E4942);
    return bytes + binary;
  }

 private:
  std::string binary_;
  bool has_fallback_ = false;
};

}  // namespace likeness
