#include "likeness/avatar/avatar.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"
#include "likeness/base/json.h"

namespace likeness {

namespace {

constexpr char kFormat[] = "likeness-avatar";
// 1: without layout, upsampling, residual, which have defaults; 2: of one person, without conditions.
constexpr char kVersion[] = "3";

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

void CheckIdentities(const std::string& what, const Avatar& avatar) {
  const Architecture& a = avatar.architecture;
  if (avatar.identities.size() != static_cast<size_t>(a.identities)) {
    throw Error("{}: the network is for {} people, there are {}", what, a.identities, avatar.identities.size());
  }
  std::set<std::string> names;
  for (const Identity& identity : avatar.identities) {
    if (a.identities > 1 && (identity.name.empty() || !names.insert(identity.name).second)) {
      throw Error("{}: a person's name is '{}'; expected one for each, all different", what, identity.name);
    }
    if (identity.vertex_mean.rows() != a.vertex_count) {
      throw Error("{}: the network is for {} vertices, the mean has {}", what, a.vertex_count,
                  identity.vertex_mean.rows());
    }
    const ImageF& mean = identity.texture_mean;
    if (mean.width() != a.texture_size || mean.height() != a.texture_size || mean.channels() != 3) {
      throw Error("{}: the mean texture is {} x {} x {}; expected {} x {} x 3", what, mean.width(), mean.height(),
                  mean.channels(), a.texture_size, a.texture_size);
    }
    if (!AllFinite(mean.values()) || !AllFinite(ValuesOf(identity.vertex_mean))) {
      throw Error("{}: a mean holds values that are not finite", what);
    }
  }
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
  const std::string where = fmt::format("{}: metadata '{}'", file.path().string(), key);
  try {
    return ParseJson(where, file.Metadata(key)).get<T>();
  } catch (const nlohmann::json::exception& error) {
    throw FileError(where, fmt::format("is not understood: {}", error.what()));
  }
}

// The shape of what every person has one of; a lone person's has no axis for it.
std::vector<int64_t> OfEach(const Architecture& architecture, std::vector<int64_t> shape) {
  if (architecture.identities > 1) shape.insert(shape.begin(), architecture.identities);
  return shape;
}

std::vector<Identity> ReadIdentities(const SafetensorsFile& file, const Architecture& architecture) {
  const int size = architecture.texture_size, vertices = architecture.vertex_count;
  // Files of version 2 do not name the one person they show.
  std::vector<std::string> names(1);
  if (file.metadata().contains("identities")) names = ReadJson<std::vector<std::string>>(file, "identities");
  if (names.size() != static_cast<size_t>(architecture.identities)) {
    throw FileError(file.path(),
                    fmt::format("names {} people; its network is for {}", names.size(), architecture.identities));
  }
  const std::vector<float> textures = file.Floats("texture.mean", OfEach(architecture, {size, size, 3}));
  const std::vector<float> meshes = file.Floats("vertex.mean", OfEach(architecture, {vertices, 3}));
  std::vector<Identity> identities;
  for (size_t i = 0; i < names.size(); ++i) {
    Identity& identity = identities.emplace_back();
    identity.name = names[i];
    identity.texture_mean = ImageF(size, size, 3);
    const std::span<float> texels = identity.texture_mean.values();
    std::copy_n(textures.begin() + static_cast<ptrdiff_t>(i * texels.size()), texels.size(), texels.begin());
    identity.vertex_mean = Eigen::Map<const Vertices>(meshes.data() + i * 3 * vertices, vertices, 3);
  }
  return identities;
}

std::vector<FrameCode> ReadCodes(const SafetensorsFile& file, const Architecture& architecture) {
  const auto frames = ReadJson<std::vector<std::pair<std::string, std::string>>>(file, "codes.frames");
  const auto count = static_cast<int64_t>(frames.size());
  const int64_t latent = architecture.latent, named = NamedChannels(architecture);
  const std::vector<float> mu = file.Floats("codes.mu", {count, latent});
  std::vector<int32_t> identities(frames.size());
  if (architecture.identities > 1) identities = file.Integers("codes.identity", {count});
  std::vector<float> conditions;
  if (named > 0) conditions = file.Floats("codes.conditions", {count, named});
  std::vector<FrameCode> codes;
  for (int64_t i = 0; i < count; ++i) {
    const auto rows = [i](const std::vector<float>& values, int64_t width) {
      return std::vector<float>(values.begin() + i * width, values.begin() + (i + 1) * width);
    };
    codes.push_back({frames[i].first, frames[i].second, rows(mu, latent), identities[i], rows(conditions, named)});
  }
  return codes;
}

}  // namespace

void Avatar::Check(const std::string& what) const {
  try {
    architecture.Check();
  } catch (const Error& error) {
    throw Error("{}: {}", what, error.what());
  }
  if (topology.vertex_count != architecture.vertex_count) {
    throw Error("{}: the network is for {} vertices, the topology has {}", what, architecture.vertex_count,
                topology.vertex_count);
  }
  topology.Check(what);
  CheckIdentities(what, *this);
  const auto named = static_cast<size_t>(NamedChannels(architecture));
  if (condition_mean.size() != named || condition_deviation.size() != named || !AllFinite(condition_mean) ||
      !std::all_of(condition_deviation.begin(), condition_deviation.end(),
                   [](float d) { return d > 0 && std::isfinite(d); })) {
    throw Error("{}: the conditions' means and deviations are not {} numbers each, the latter positive", what, named);
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
    if (code.conditions.size() != named || !AllFinite(code.conditions)) {
      throw Error("{}: the conditions of {} {} are not {} finite values", what, code.segment, code.frame, named);
    }
    if (code.identity < 0 || code.identity >= architecture.identities) {
      throw Error("{}: {} {} is a frame of person {} of {}", what, code.segment, code.frame, code.identity,
                  architecture.identities);
    }
  }
}

std::string TrainingCamerasKey(const Avatar& avatar, int identity) {
  return avatar.identities.size() == 1 ? "cameras" : "cameras." + avatar.identities.at(identity).name;
}

void SaveAvatar(const std::filesystem::path& path, const Avatar& avatar) {
  avatar.Check(path.string());
  const int64_t size = avatar.architecture.texture_size, vertices = avatar.architecture.vertex_count;
  std::vector<int32_t> triangles, triangle_uvs;
  for (const Eigen::Vector3i& t : avatar.topology.triangles) triangles.insert(triangles.end(), t.data(), t.data() + 3);
  for (const Eigen::Vector3i& t : avatar.topology.triangle_uvs) {
    triangle_uvs.insert(triangle_uvs.end(), t.data(), t.data() + 3);
  }
  std::vector<float> uvs, codes, code_conditions, texture_means, vertex_means;
  std::vector<int32_t> code_identities;
  for (const Eigen::Vector2f& uv : avatar.topology.uvs) uvs.insert(uvs.end(), uv.data(), uv.data() + 2);
  nlohmann::json frames = nlohmann::json::array();
  for (const FrameCode& code : avatar.codes) {
    frames.push_back({code.segment, code.frame});
    codes.insert(codes.end(), code.mu.begin(), code.mu.end());
    code_identities.push_back(code.identity);
    code_conditions.insert(code_conditions.end(), code.conditions.begin(), code.conditions.end());
  }
  nlohmann::json names = nlohmann::json::array();
  for (const Identity& identity : avatar.identities) {
    names.push_back(identity.name);
    const std::span<const float> vertex_mean = ValuesOf(identity.vertex_mean);
    texture_means.insert(texture_means.end(), identity.texture_mean.values().begin(),
                         identity.texture_mean.values().end());
    vertex_means.insert(vertex_means.end(), vertex_mean.begin(), vertex_mean.end());
  }

  std::vector<TensorView> tensors;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    tensors.push_back(ViewOf(info.name, info.shape, avatar.weights.at(info.name).values));
  }
  tensors.push_back(ViewOf("topology.triangles", {static_cast<int64_t>(triangles.size() / 3), 3}, triangles));
  tensors.push_back(ViewOf("topology.triangle_uvs", {static_cast<int64_t>(triangle_uvs.size() / 3), 3}, triangle_uvs));
  tensors.push_back(ViewOf("topology.uvs", {static_cast<int64_t>(uvs.size() / 2), 2}, uvs));
  const int64_t frame_count = static_cast<int64_t>(avatar.codes.size()), named = NamedChannels(avatar.architecture);
  tensors.push_back(ViewOf("texture.mean", OfEach(avatar.architecture, {size, size, 3}), texture_means));
  tensors.push_back(ViewOf("vertex.mean", OfEach(avatar.architecture, {vertices, 3}), vertex_means));
  tensors.push_back(ViewOf("codes.mu", {frame_count, avatar.architecture.latent}, codes));
  if (avatar.architecture.identities > 1) {
    tensors.push_back(ViewOf("codes.identity", {frame_count}, code_identities));
  }
  if (named > 0) {
    tensors.push_back(ViewOf("codes.conditions", {frame_count, named}, code_conditions));
    tensors.push_back(ViewOf("condition.mean", {named}, avatar.condition_mean));
    tensors.push_back(ViewOf("condition.deviation", {named}, avatar.condition_deviation));
  }

  WriteSafetensors(path, tensors,
                   {{"format", kFormat},
                    {"version", kVersion},
                    {"architecture", ArchitectureToJson(avatar.architecture)},
                    {"texture.variance", fmt::format("{}", avatar.texture_variance)},
                    {"vertex.variance", fmt::format("{}", avatar.vertex_variance)},
                    {"identities", names.dump()},
                    {"codes.frames", frames.dump()},
                    {"training", nlohmann::json(avatar.training).dump()},
                    {"units",
                     "vertices: millimetres, head space (x to the subject's left, y up, z out of the nose); "
                     "textures: RGB 0 to 255, row 0 is v = 1; views: unit vectors from the head's centre"}});
}

Avatar LoadAvatar(const std::filesystem::path& path) { return AvatarFrom(SafetensorsFile(path)); }

Avatar AvatarFrom(const SafetensorsFile& file) {
  const std::filesystem::path& path = file.path();
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || format->second != kFormat) {
    throw FileError(path, "is no avatar (its metadata lack format = likeness-avatar); likeness train makes one");
  }
  if (const std::string& version = file.Metadata("version"); version != "1" && version != "2" && version != kVersion) {
    throw FileError(
        path, fmt::format("is an avatar of version '{}'; this program reads versions 1 to {}", version, kVersion));
  }
  Avatar avatar;
  try {
    avatar.architecture = ArchitectureFromJson(file.Metadata("architecture"));
    avatar.architecture.Check();
  } catch (const Error& error) {
    throw FileError(path, error.what());
  }
  const int vertices = avatar.architecture.vertex_count;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    avatar.weights[info.name] = {info.shape, file.Floats(info.name, info.shape)};
  }

  avatar.topology.vertex_count = vertices;
  avatar.topology.triangles = ReadTriangles(file, "topology.triangles");
  avatar.topology.triangle_uvs = ReadTriangles(file, "topology.triangle_uvs");
  const std::vector<float> uvs = file.Floats("topology.uvs", {-1, 2});
  for (size_t i = 0; i < uvs.size(); i += 2) avatar.topology.uvs.emplace_back(uvs[i], uvs[i + 1]);

  avatar.identities = ReadIdentities(file, avatar.architecture);
  avatar.texture_variance = ParseNumber(file, "texture.variance");
  avatar.vertex_variance = ParseNumber(file, "vertex.variance");
  if (const int64_t named = NamedChannels(avatar.architecture); named > 0) {
    avatar.condition_mean = file.Floats("condition.mean", {named});
    avatar.condition_deviation = file.Floats("condition.deviation", {named});
  }
  avatar.codes = ReadCodes(file, avatar.architecture);
  avatar.training = ReadJson<std::map<std::string, std::string>>(file, "training");
  avatar.Check(path.string());
  return avatar;
}

}  // namespace likeness
