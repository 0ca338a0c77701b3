#include "likeness/avatar/avatar.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "likeness/avatar/safetensors.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"

namespace likeness {

namespace {

constexpr char kFormat[] = "likeness-avatar";
constexpr char kVersion[] = "2";  // 1: without layout, upsampling, residual, which have defaults

bool AllFinite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

void CheckVariance(const std::string& what, const char* name, double variance) {
  if (!(variance > 0) || !std::isfinite(variance)) {
    throw Error("{}: the {} is {}; expected a positive number", what, name, variance);
  }
}

std::span<const float> ValuesOf(const Vertices& vertices) {
  return {vertices.data(), static_cast<size_t>(vertices.size())};
}

double ParseNumber(const SafetensorsFile& file, const char* key) {
  const std::string& text = file.Metadata(key);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0') throw FileError(file.path(), fmt::format("metadata '{}' is no number", key));
  return value;
}

std::vector<Eigen::Vector3i> ReadTriangles(const SafetensorsFile& file, const char* name) {
  const std::vector<int32_t> values = file.Integers(name, {-1, 3});
  std::vector<Eigen::Vector3i> triangles(values.size() / 3);
  for (size_t i = 0; i < triangles.size(); ++i) triangles[i] = Eigen::Map<const Eigen::Vector3i>(&values[3 * i]);
  return triangles;
}

// Frames' names: a list of pairs. Training information: a map of strings.
template <typename T>
T ReadJson(const SafetensorsFile& file, const char* key) {
  try {
    return nlohmann::json::parse(file.Metadata(key)).get<T>();
  } catch (const nlohmann::json::exception& error) {
    throw FileError(file.path(), fmt::format("metadata '{}' is not understood: {}", key, error.what()));
  }
}

}  // namespace

void Avatar::Check(const std::string& what) const {
  try {
    architecture.Check();
  } catch (const Error& error) {
    throw Error("{}: {}", what, error.what());
  }
  const int size = architecture.texture_size;
  if (topology.vertex_count != architecture.vertex_count || vertex_mean.rows() != architecture.vertex_count) {
    throw Error("{}: the network is for {} vertices, the topology has {} and the mean {}", what,
                architecture.vertex_count, topology.vertex_count, vertex_mean.rows());
  }
  topology.Check(what);
  if (texture_mean.width() != size || texture_mean.height() != size || texture_mean.channels() != 3) {
    throw Error("{}: the mean texture is {} x {} x {}; expected {} x {} x 3", what, texture_mean.width(),
                texture_mean.height(), texture_mean.channels(), size, size);
  }
  if (!AllFinite(texture_mean.values()) || !AllFinite(ValuesOf(vertex_mean))) {
    throw Error("{}: a mean holds values that are not finite", what);
  }
  CheckVariance(what, "texture variance", texture_variance);
  CheckVariance(what, "vertex variance", vertex_variance);

  const std::vector<TensorInfo> infos = NetworkTensors(architecture);
  for (const TensorInfo& info : infos) {
    const auto found = weights.find(info.name);
    if (found == weights.end()) throw Error("{}: the tensor '{}' is missing", what, info.name);
    const Tensor& tensor = found->second;
    if (tensor.shape != info.shape || static_cast<int64_t>(tensor.values.size()) != ElementCount(info.shape)) {
      throw Error("{}: the tensor '{}' is [{}] with {} values; expected [{}]", what, info.name,
                  fmt::join(tensor.shape, ", "), tensor.values.size(), fmt::join(info.shape, ", "));
    }
    if (!AllFinite(tensor.values)) throw Error("{}: the tensor '{}' holds values that are not finite", what, info.name);
  }
  if (weights.size() != infos.size()) {
    throw Error("{}: it holds {} tensors; this architecture has {}", what, weights.size(), infos.size());
  }
  for (const FrameCode& code : codes) {
    if (static_cast<int>(code.mu.size()) != architecture.latent || !AllFinite(code.mu)) {
      throw Error("{}: the code of {} {} is not {} finite values", what, code.segment, code.frame, architecture.latent);
    }
  }
}

void SaveAvatar(const std::filesystem::path& path, const Avatar& avatar) {
  avatar.Check(path.string());
  const int64_t size = avatar.architecture.texture_size, vertices = avatar.architecture.vertex_count;
  std::vector<int32_t> triangles, triangle_uvs;
  for (const Eigen::Vector3i& t : avatar.topology.triangles) triangles.insert(triangles.end(), t.data(), t.data() + 3);
  for (const Eigen::Vector3i& t : avatar.topology.triangle_uvs) {
    triangle_uvs.insert(triangle_uvs.end(), t.data(), t.data() + 3);
  }
  std::vector<float> uvs, codes;
  for (const Eigen::Vector2f& uv : avatar.topology.uvs) uvs.insert(uvs.end(), uv.data(), uv.data() + 2);
  nlohmann::json frames = nlohmann::json::array();
  for (const FrameCode& code : avatar.codes) {
    frames.push_back({code.segment, code.frame});
    codes.insert(codes.end(), code.mu.begin(), code.mu.end());
  }

  std::vector<TensorView> tensors;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    tensors.push_back(ViewOf(info.name, info.shape, avatar.weights.at(info.name).values));
  }
  tensors.push_back(ViewOf("topology.triangles", {static_cast<int64_t>(triangles.size() / 3), 3}, triangles));
  tensors.push_back(ViewOf("topology.triangle_uvs", {static_cast<int64_t>(triangle_uvs.size() / 3), 3}, triangle_uvs));
  tensors.push_back(ViewOf("topology.uvs", {static_cast<int64_t>(uvs.size() / 2), 2}, uvs));
  tensors.push_back(ViewOf("texture.mean", {size, size, 3}, avatar.texture_mean.values()));
  tensors.push_back(ViewOf("vertex.mean", {vertices, 3}, ValuesOf(avatar.vertex_mean)));
  tensors.push_back(ViewOf("codes.mu", {static_cast<int64_t>(avatar.codes.size()), avatar.architecture.latent}, codes));

  WriteSafetensors(path, tensors,
                   {{"format", kFormat},
                    {"version", kVersion},
                    {"architecture", ArchitectureToJson(avatar.architecture)},
                    {"texture.variance", fmt::format("{}", avatar.texture_variance)},
                    {"vertex.variance", fmt::format("{}", avatar.vertex_variance)},
                    {"codes.frames", frames.dump()},
                    {"training", nlohmann::json(avatar.training).dump()},
                    {"units",
                     "vertices: millimetres, head space (x to the subject's left, y up, z out of the nose); "
                     "textures: RGB 0 to 255, row 0 is v = 1; views: unit vectors from the head's centre"}});
}

Avatar LoadAvatar(const std::filesystem::path& path) {
  const SafetensorsFile file(path);
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || format->second != kFormat) {
    throw FileError(path, "is no avatar (its metadata lack format = likeness-avatar); likeness train makes one");
  }
  if (const std::string& version = file.Metadata("version"); version != "1" && version != kVersion) {
    throw FileError(
        path, fmt::format("is an avatar of version '{}'; this program reads versions 1 and {}", version, kVersion));
  }
  Avatar avatar;
  try {
    avatar.architecture = ArchitectureFromJson(file.Metadata("architecture"));
    avatar.architecture.Check();
  } catch (const Error& error) {
    throw FileError(path, error.what());
  }
  const int size = avatar.architecture.texture_size, vertices = avatar.architecture.vertex_count;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    avatar.weights[info.name] = {info.shape, file.Floats(info.name, info.shape)};
  }

  avatar.topology.vertex_count = vertices;
  avatar.topology.triangles = ReadTriangles(file, "topology.triangles");
  avatar.topology.triangle_uvs = ReadTriangles(file, "topology.triangle_uvs");
  const std::vector<float> uvs = file.Floats("topology.uvs", {-1, 2});
  for (size_t i = 0; i < uvs.size(); i += 2) avatar.topology.uvs.emplace_back(uvs[i], uvs[i + 1]);

  const std::vector<float> texture = file.Floats("texture.mean", {size, size, 3});
  avatar.texture_mean = ImageF(size, size, 3);
  std::copy(texture.begin(), texture.end(), avatar.texture_mean.values().begin());
  avatar.texture_variance = ParseNumber(file, "texture.variance");
  avatar.vertex_mean = Eigen::Map<const Vertices>(file.Floats("vertex.mean", {vertices, 3}).data(), vertices, 3);
  avatar.vertex_variance = ParseNumber(file, "vertex.variance");

  const auto frames = ReadJson<std::vector<std::pair<std::string, std::string>>>(file, "codes.frames");
  const std::vector<float> codes =
      file.Floats("codes.mu", {static_cast<int64_t>(frames.size()), avatar.architecture.latent});
  for (size_t i = 0; i < frames.size(); ++i) {
    const auto begin = codes.begin() + static_cast<ptrdiff_t>(i) * avatar.architecture.latent;
    avatar.codes.push_back({frames[i].first, frames[i].second, {begin, begin + avatar.architecture.latent}});
  }
  avatar.training = ReadJson<std::map<std::string, std::string>>(file, "training");
  avatar.Check(path.string());
  return avatar;
}

}  // namespace likeness
