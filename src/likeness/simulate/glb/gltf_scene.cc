#include "likeness/simulate/glb/gltf_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/simulate/glb/gltf_accessor.h"

namespace likeness {
namespace {

using Eigen::Matrix4f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr size_t kMostParts = 4096;

// scale and rotation about the origin, then offset, of texture coordinates (KHR_texture_transform), v downwards.
struct UvTransform {
  Eigen::Matrix2f linear = Eigen::Matrix2f::Identity();
  Vector2f offset = Vector2f::Zero();
  int set = 0;  // of texture coordinates
};

class SceneReader {
 public:
  SceneReader(const std::filesystem::path& path, const tinygltf::Model& model)
      : path_(path), model_(model), accessors_(path, model) {}

  GltfScene Read();

 private:
  [[noreturn]] void Fail(const std::string& message) const { throw FileError(path_, message); }
  template <typename T>
  const T& At(const std::vector<T>& list, int index, const char* what) const {
    if (index < 0 || static_cast<size_t>(index) >= list.size()) {
      Fail(fmt::format("refers to {} {}, but there are {}", what, index, list.size()));
    }
    return list[static_cast<size_t>(index)];
  }
  Matrix4f LocalTransform(const tinygltf::Node& node) const;
  void PlaceNode(int index, const Matrix4f& parent, int depth);
  int ImageOf(int texture) const;
  GltfMaterial ReadMaterial(const tinygltf::Material& material) const;
  UvTransform BaseUvTransform(int material) const;
  std::vector<Matrix4f> JointMatrices(const tinygltf::Skin& skin);
  void ReadPart(const tinygltf::Node& node, const tinygltf::Mesh& mesh, const tinygltf::Primitive& primitive,
                const Matrix4f& placed);
  std::vector<Vector2f> ReadUvs(const tinygltf::Primitive& primitive, size_t count);
  std::vector<Eigen::Vector3i> ReadTriangles(const tinygltf::Primitive& primitive, size_t count);
  std::vector<Matrix4f> VertexTransforms(const tinygltf::Node& node, const tinygltf::Primitive& primitive, size_t count,
                                         const Matrix4f& placed);

  const std::filesystem::path& path_;
  const tinygltf::Model& model_;
  GltfAccessors accessors_;
  std::vector<std::optional<Matrix4f>> placed_;  // scene_from_node
  GltfScene scene_;
};

Matrix4f FromColumns(const float* numbers) { return Eigen::Map<const Matrix4f>(numbers); }

Matrix4f SceneReader::LocalTransform(const tinygltf::Node& node) const {
  Matrix4f local = Matrix4f::Identity();
  const auto take = [&](const std::vector<double>& numbers, size_t count, const char* what) {
    if (numbers.empty()) return false;
    if (numbers.size() != count) Fail(fmt::format("node '{}' has a {} of {} numbers", node.name, what, numbers.size()));
    for (const double number : numbers) {
      if (!(std::abs(number) < 1e9)) Fail(fmt::format("node '{}' has an unsound {}", node.name, what));
    }
    return true;
  };
  if (take(node.matrix, 16, "matrix")) {
    return Eigen::Map<const Eigen::Matrix4d>(node.matrix.data()).cast<float>();
  }
  if (take(node.translation, 3, "translation")) {
    local.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(node.translation.data()).cast<float>();
  }
  if (take(node.rotation, 4, "rotation")) {
    const Eigen::Quaterniond turn(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    if (turn.norm() < 1e-6) Fail(fmt::format("node '{}' has a rotation of length zero", node.name));
    local.topLeftCorner<3, 3>() = turn.normalized().toRotationMatrix().cast<float>();
  }
  if (take(node.scale, 3, "scale")) {
    local.topLeftCorner<3, 3>() *= Eigen::Map<const Eigen::Vector3d>(node.scale.data()).cast<float>().asDiagonal();
  }
  return local;
}

void SceneReader::PlaceNode(int index, const Matrix4f& parent, int depth) {
  constexpr int kDeepest = 256;
  const tinygltf::Node& node = At(model_.nodes, index, "node");
  std::optional<Matrix4f>& placed = placed_[static_cast<size_t>(index)];
  if (placed.has_value()) Fail(fmt::format("node {} has two parents or stands in a cycle", index));
  if (depth > kDeepest) Fail(fmt::format("its nodes are nested more than {} deep", kDeepest));
  placed = parent * LocalTransform(node);
  if (!placed->allFinite()) Fail(fmt::format("node {} lies at infinity", index));
  for (const int child : node.children) PlaceNode(child, *placed, depth + 1);
}

// Where a texture's picture is; -1 where it has none that can be read.
int SceneReader::ImageOf(int texture) const {
  if (texture < 0) return -1;
  const tinygltf::Texture& described = At(model_.textures, texture, "texture");
  int source = described.source;
  if (const auto webp = described.extensions.find("EXT_texture_webp");
      webp != described.extensions.end() && webp->second.Has("source") && webp->second.Get("source").IsInt()) {
    source = webp->second.Get("source").Get<int>();
  }
  if (source < 0) return -1;
  At(model_.images, source, "image");
  return source;
}

float Unit(double value, float otherwise) {
  return std::isfinite(value) ? static_cast<float>(std::clamp(value, 0.0, 1.0)) : otherwise;
}

GltfMaterial SceneReader::ReadMaterial(const tinygltf::Material& material) const {
  const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
  GltfMaterial result;
  result.name = material.name;
  for (size_t c = 0; c < std::min<size_t>(4, pbr.baseColorFactor.size()); ++c) {
    result.base_colour[c] = Unit(pbr.baseColorFactor[c], 1);
  }
  result.base_image = ImageOf(pbr.baseColorTexture.index);
  result.normal_image = ImageOf(material.normalTexture.index);
  result.rough_metal_image = ImageOf(pbr.metallicRoughnessTexture.index);
  result.normal_scale = std::isfinite(material.normalTexture.scale)
                            ? static_cast<float>(std::clamp(material.normalTexture.scale, -10.0, 10.0))
                            : 1;
  result.roughness = Unit(pbr.roughnessFactor, 1);
  result.metallic = Unit(pbr.metallicFactor, 1);
  result.alpha = material.alphaMode == "MASK"    ? GltfAlpha::kMask
                 : material.alphaMode == "BLEND" ? GltfAlpha::kBlend
                                                 : GltfAlpha::kOpaque;
  result.alpha_cutoff = Unit(material.alphaCutoff, 0.5f);
  result.double_sided = material.doubleSided;
  return result;
}

UvTransform SceneReader::BaseUvTransform(int material) const {
  UvTransform transform;
  if (material < 0) return transform;
  const tinygltf::TextureInfo& texture =
      model_.materials[static_cast<size_t>(material)].pbrMetallicRoughness.baseColorTexture;
  transform.set = texture.texCoord;
  const auto found = texture.extensions.find("KHR_texture_transform");
  if (found == texture.extensions.end()) return transform;
  const tinygltf::Value& extension = found->second;
  const auto number = [&](const tinygltf::Value& value) -> float {
    const double n = value.IsNumber() ? value.GetNumberAsDouble() : 0;
    return std::abs(n) < 1e4 ? static_cast<float>(n) : 0;
  };
  const auto pair = [&](const char* name, const Vector2f& otherwise) -> Vector2f {
    if (!extension.Has(name) || !extension.Get(name).IsArray() || extension.Get(name).ArrayLen() != 2) return otherwise;
    return {number(extension.Get(name).Get(0)), number(extension.Get(name).Get(1))};
  };
  // Counter-clockwise in an image whose rows run down, as the extension says.
  const float turn = extension.Has("rotation") ? number(extension.Get("rotation")) : 0;
  Eigen::Matrix2f rotation;
  rotation << std::cos(turn), std::sin(turn), -std::sin(turn), std::cos(turn);
  transform.linear = rotation * pair("scale", Vector2f::Ones()).asDiagonal();
  transform.offset = pair("offset", Vector2f::Zero());
  if (extension.Has("texCoord") && extension.Get("texCoord").IsInt())
    transform.set = extension.Get("texCoord").Get<int>();
  return transform;
}

std::vector<Vector2f> SceneReader::ReadUvs(const tinygltf::Primitive& primitive, size_t count) {
  const UvTransform transform = BaseUvTransform(primitive.material);
  std::vector<Vector2f> uvs(count, Vector2f::Zero());
  const auto found = primitive.attributes.find(fmt::format("TEXCOORD_{}", transform.set));
  if (found == primitive.attributes.end()) return uvs;
  const std::vector<float> numbers = accessors_.Floats(found->second, 2, count);
  for (size_t i = 0; i < count; ++i) {
    const Vector2f uv = transform.linear * Vector2f(numbers[2 * i], numbers[2 * i + 1]) + transform.offset;
    uvs[i] = {uv.x(), 1 - uv.y()};
  }
  return uvs;
}

std::vector<Eigen::Vector3i> SceneReader::ReadTriangles(const tinygltf::Primitive& primitive, size_t count) {
  std::vector<uint32_t> corners;
  if (primitive.indices >= 0) {
    corners = accessors_.Naturals(primitive.indices, 1);
    for (const uint32_t corner : corners) {
      if (corner >= count) Fail(fmt::format("a triangle refers to vertex {}, but there are {}", corner, count));
    }
  } else {
    for (size_t i = 0; i < count; ++i) corners.push_back(static_cast<uint32_t>(i));
  }
  std::vector<Eigen::Vector3i> triangles;
  const auto add = [&](size_t a, size_t b, size_t c) {
    const Eigen::Vector3i t(static_cast<int>(corners[a]), static_cast<int>(corners[b]), static_cast<int>(corners[c]));
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
  };
  if (primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (size_t i = 2; i < corners.size(); ++i) i % 2 == 0 ? add(i - 2, i - 1, i) : add(i - 1, i - 2, i);
  } else if (primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN) {
    for (size_t i = 2; i < corners.size(); ++i) add(0, i - 1, i);
  } else {
    for (size_t i = 2; i < corners.size(); i += 3) add(i - 2, i - 1, i);
  }
  return triangles;
}

std::vector<Matrix4f> SceneReader::JointMatrices(const tinygltf::Skin& skin) {
  std::vector<Matrix4f> joints;
  std::vector<float> inverse;
  if (skin.joints.empty()) Fail("a skin has no joints");
  if (skin.inverseBindMatrices >= 0) {
    if (accessors_.Count(skin.inverseBindMatrices) < skin.joints.size()) Fail("a skin has too few bind matrices");
    inverse = accessors_.Floats(skin.inverseBindMatrices, 16);
  }
  for (size_t j = 0; j < skin.joints.size(); ++j) {
    At(model_.nodes, skin.joints[j], "node");
    const std::optional<Matrix4f>& placed = placed_[static_cast<size_t>(skin.joints[j])];
    if (!placed.has_value()) Fail(fmt::format("joint {} is not in the scene", skin.joints[j]));
    joints.push_back(inverse.empty() ? *placed : Matrix4f(*placed * FromColumns(inverse.data() + 16 * j)));
  }
  return joints;
}

// scene_from_vertex: one for each vertex of skinned parts, one for all of others.
std::vector<Matrix4f> SceneReader::VertexTransforms(const tinygltf::Node& node, const tinygltf::Primitive& primitive,
                                                    size_t count, const Matrix4f& placed) {
  if (node.skin < 0 || !primitive.attributes.contains("JOINTS_0") || !primitive.attributes.contains("WEIGHTS_0")) {
    return {placed};
  }
  const std::vector<Matrix4f> joints = JointMatrices(At(model_.skins, node.skin, "skin"));
  std::vector<Matrix4f> transforms(count, Matrix4f::Zero());
  std::vector<float> sums(count, 0);
  for (int set = 0; set < 4; ++set) {
    const auto which = primitive.attributes.find(fmt::format("JOINTS_{}", set));
    const auto much = primitive.attributes.find(fmt::format("WEIGHTS_{}", set));
    if (which == primitive.attributes.end() || much == primitive.attributes.end()) break;
    const std::vector<uint32_t> indices = accessors_.Naturals(which->second, 4, count);
    const std::vector<float> weights = accessors_.Floats(much->second, 4, count);
    for (size_t i = 0; i < indices.size(); ++i) {
      if (!(weights[i] > 0)) continue;
      if (indices[i] >= joints.size()) Fail(fmt::format("a vertex follows joint {} of {}", indices[i], joints.size()));
      transforms[i / 4] += weights[i] * joints[indices[i]];
      sums[i / 4] += weights[i];
    }
  }
  for (size_t v = 0; v < count; ++v) transforms[v] = sums[v] > 0 ? Matrix4f(transforms[v] / sums[v]) : placed;
  return transforms;
}

void SceneReader::ReadPart(const tinygltf::Node& node, const tinygltf::Mesh& mesh, const tinygltf::Primitive& primitive,
                           const Matrix4f& placed) {
  const auto position = primitive.attributes.find("POSITION");
  const bool triangles = primitive.mode < 0 || primitive.mode >= TINYGLTF_MODE_TRIANGLES;
  if (position == primitive.attributes.end() || !triangles) return;  // points and lines
  if (scene_.parts.size() == kMostParts) Fail(fmt::format("shows more than {} primitives", kMostParts));
  GltfPart part;
  part.node = node.name;
  part.mesh = mesh.name;
  part.material = primitive.material;
  if (part.material >= 0) At(model_.materials, part.material, "material");
  const size_t count = accessors_.Count(position->second);
  const std::vector<float> points = accessors_.Floats(position->second, 3);
  const std::vector<Matrix4f> transforms = VertexTransforms(node, primitive, count, placed);
  const auto transform_of = [&](size_t v) -> const Matrix4f& { return transforms[transforms.size() == 1 ? 0 : v]; };
  const auto move = [&](size_t v, const float* p, float w) -> Vector3f {
    return (transform_of(v) * Eigen::Vector4f(p[0], p[1], p[2], w)).head<3>();
  };
  part.positions.resize(static_cast<Eigen::Index>(count), 3);
  for (size_t v = 0; v < count; ++v) part.positions.row(static_cast<Eigen::Index>(v)) = move(v, &points[3 * v], 1);
  part.uvs = ReadUvs(primitive, count);
  part.triangles = ReadTriangles(primitive, count);
  if (transforms.size() == 1 && placed.topLeftCorner<3, 3>().determinant() < 0) {
    for (Eigen::Vector3i& t : part.triangles) std::swap(t[1], t[2]);
  }
  const tinygltf::Value names = mesh.extras.Has("targetNames") ? mesh.extras.Get("targetNames") : tinygltf::Value();
  for (size_t m = 0; m < primitive.targets.size(); ++m) {
    const auto target = primitive.targets[m].find("POSITION");
    if (target == primitive.targets[m].end()) continue;
    GltfMorph morph;
    const bool named = names.IsArray() && m < names.ArrayLen() && names.Get(static_cast<int>(m)).IsString();
    morph.name = named ? names.Get(static_cast<int>(m)).Get<std::string>() : fmt::format("target {}", m);
    const std::vector<float> deltas = accessors_.Floats(target->second, 3, count);
    for (size_t v = 0; v < count; ++v) {
      if (deltas[3 * v] == 0 && deltas[3 * v + 1] == 0 && deltas[3 * v + 2] == 0) continue;
      morph.vertices.push_back(static_cast<int>(v));
      morph.deltas.push_back(move(v, &deltas[3 * v], 0));
    }
    part.morphs.push_back(std::move(morph));
  }
  if (!part.triangles.empty()) scene_.parts.push_back(std::move(part));
}

GltfScene SceneReader::Read() {
  placed_.resize(model_.nodes.size());
  if (model_.scenes.empty()) Fail("has no scene");
  const int first = std::max(model_.defaultScene, 0);
  for (const int root : At(model_.scenes, first, "scene").nodes) PlaceNode(root, Matrix4f::Identity(), 0);
  for (const tinygltf::Material& material : model_.materials) scene_.materials.push_back(ReadMaterial(material));
  for (size_t n = 0; n < model_.nodes.size(); ++n) {
    const tinygltf::Node& node = model_.nodes[n];
    if (!placed_[n].has_value() || node.mesh < 0) continue;
    const tinygltf::Mesh& mesh = At(model_.meshes, node.mesh, "mesh");
    for (const tinygltf::Primitive& primitive : mesh.primitives) ReadPart(node, mesh, primitive, *placed_[n]);
  }
  for (const tinygltf::Image& image : model_.images) scene_.images.emplace_back(image.image.begin(), image.image.end());
  return std::move(scene_);
}

}  // namespace

GltfScene ParseGltf(const std::filesystem::path& path_for_errors, std::string_view bytes,
                    const ReadBeside& read_beside) {
  const tinygltf::Model model = ParseGltfFile(path_for_errors, bytes, read_beside);
  return SceneReader(path_for_errors, model).Read();
}

GltfScene ReadGltf(const std::filesystem::path& path) {
  constexpr uint64_t kMostBytes = uint64_t{1} << 30;
  const auto read_beside = [&](const std::string& relative) {
    return ReadFile(path.parent_path() / relative, kMostBytes);
  };
  return ParseGltf(path, ReadFile(path, kMostBytes), read_beside);
}

}  // namespace likeness
