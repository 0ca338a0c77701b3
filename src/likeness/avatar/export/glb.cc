#include "likeness/avatar/export/glb.h"

#include <Eigen/Geometry>
#include <cstring>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/geometry/mesh_corners.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

using json = nlohmann::ordered_json;

// What the specification numbers.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kLinearFilter = 9729, kTrilinearFilter = 9987, kClamp = 33071;
constexpr uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr float kMetresPerMm = 0.001f;

void AppendNumber(std::string* bytes, uint32_t number) {
  bytes->append(reinterpret_cast<const char*>(&number), sizeof(number));
}

void AppendChunk(std::string* bytes, uint32_t kind, const std::string& data) {
  AppendNumber(bytes, static_cast<uint32_t>(data.size()));
  AppendNumber(bytes, kind);
  *bytes += data;
}

// The file's binary part and what describes it.
class GlbWriter {
 public:
  json document = {{"asset", {{"version", "2.0"}, {"generator", "likeness"}}}};

  int AddView(std::string_view bytes) {
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
    binary_ += bytes;
    return static_cast<int>(document["bufferViews"].size()) - 1;
  }

  template <typename T>
  int AddAccessor(const T* values, size_t count, int width, const char* type, int component = kFloat) {
    const auto* bytes = reinterpret_cast<const char*>(values);
    const int view = AddView({bytes, count * static_cast<size_t>(width) * sizeof(T)});
    document["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(document["accessors"].size()) - 1;
  }

  // Positions, with the bounds that the format wants of them.
  int AddPoints(const Vertices& points) {
    const int accessor = AddAccessor(points.data(), static_cast<size_t>(points.rows()), 3, "VEC3");
    const Eigen::RowVector3f least = points.colwise().minCoeff(), most = points.colwise().maxCoeff();
    document["accessors"][accessor]["min"] = {least[0], least[1], least[2]};
    document["accessors"][accessor]["max"] = {most[0], most[1], most[2]};
    return accessor;
  }

  std::string Bytes() {
    constexpr uint32_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    document["buffers"] = json::array({{{"byteLength", binary_.size()}}});
    std::string text = document.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string bytes;
    AppendNumber(&bytes, kMagic);
    AppendNumber(&bytes, 2);
    AppendNumber(&bytes, static_cast<uint32_t>(kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + binary_.size()));
    AppendChunk(&bytes, kJsonChunk, text);
    AppendChunk(&bytes, kBinaryChunk, binary_);
    return bytes;
  }

 private:
  std::string binary_;
};

// Rows of `vertices` that the corners name, in metres.
Vertices CornerPoints(const Vertices& vertices, const MeshCorners& corners) {
  Vertices points(static_cast<Eigen::Index>(corners.vertices.size()), 3);
  for (size_t i = 0; i < corners.vertices.size(); ++i) {
    points.row(static_cast<Eigen::Index>(i)) = kMetresPerMm * vertices.row(corners.vertices[i]);
  }
  return points;
}

void AddMesh(const AnimatedMesh& mesh, GlbWriter* writer) {
  const MeshCorners corners = CornersOf(mesh.topology);
  std::vector<float> uvs;
  for (const int uv : corners.uvs) {
    uvs.push_back(mesh.topology.uvs[uv].x());
    uvs.push_back(1 - mesh.topology.uvs[uv].y());  // v runs down in glTF
  }
  json primitive = {{"material", 0}};
  primitive["attributes"]["POSITION"] = writer->AddPoints(CornerPoints(mesh.rest, corners));
  primitive["attributes"]["TEXCOORD_0"] = writer->AddAccessor(uvs.data(), corners.uvs.size(), 2, "VEC2");
  primitive["indices"] = writer->AddAccessor(corners.indices.data(), corners.indices.size(), 1, "SCALAR", kUnsignedInt);
  for (const Vertices& target : mesh.targets) {
    primitive["targets"].push_back({{"POSITION", writer->AddPoints(CornerPoints(target, corners))}});
  }
  json described = {{"name", "face"}, {"primitives", json::array({primitive})}};
  if (!mesh.targets.empty()) {
    described["weights"] = std::vector<float>(mesh.weights.begin(), mesh.weights.begin() + mesh.targets.size());
  }
  writer->document["meshes"] = json::array({described});
}

void AddMaterial(const ImageU8& texture, GlbWriter* writer) {
  json& document = writer->document;
  const int png = writer->AddView(EncodePng(texture));
  document["images"] = json::array({{{"bufferView", png}, {"mimeType", "image/png"}}});
  document["samplers"] = json::array(
      {{{"magFilter", kLinearFilter}, {"minFilter", kTrilinearFilter}, {"wrapS", kClamp}, {"wrapT", kClamp}}});
  document["textures"] = json::array({{{"source", 0}, {"sampler", 0}}});
  document["extensionsUsed"] = json::array({"KHR_materials_unlit"});
  json material = {{"name", "face"}};
  material["pbrMetallicRoughness"] = {
      {"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}, {"roughnessFactor", 1}};
  material["extensions"]["KHR_materials_unlit"] = json::object();
  document["materials"] = json::array({material});
}

// Weights of the mesh, rotation and translation of its node.
void AddAnimation(const AnimatedMesh& mesh, GlbWriter* writer) {
  const size_t frames = mesh.seconds.size();
  const std::vector<float> seconds(mesh.seconds.begin(), mesh.seconds.end());
  std::vector<float> rotations, translations;
  Eigen::Quaterniond previous = Eigen::Quaterniond::Identity();
  for (const RigidTransform& pose : mesh.first_from_head) {
    Eigen::Quaterniond rotation(pose.rotation);
    if (rotation.dot(previous) < 0) rotation.coeffs() *= -1;  // the short way round
    previous = rotation;
    for (const double value : rotation.coeffs()) rotations.push_back(static_cast<float>(value));  // x y z w
    for (const double value : pose.translation) translations.push_back(static_cast<float>(value) * kMetresPerMm);
  }
  const int times = writer->AddAccessor(seconds.data(), frames, 1, "SCALAR");
  writer->document["accessors"][times]["min"] = json::array({seconds.front()});
  writer->document["accessors"][times]["max"] = json::array({seconds.back()});
  json animation = {{"name", "performance"}, {"samplers", json::array()}, {"channels", json::array()}};
  const auto add = [&](const char* path, int values) {
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", 0}, {"path", path}}}});
    animation["samplers"].push_back({{"input", times}, {"output", values}, {"interpolation", "LINEAR"}});
  };
  if (!mesh.targets.empty()) {
    add("weights", writer->AddAccessor(mesh.weights.data(), mesh.weights.size(), 1, "SCALAR"));
  }
  add("rotation", writer->AddAccessor(rotations.data(), frames, 4, "VEC4"));
  add("translation", writer->AddAccessor(translations.data(), frames, 3, "VEC3"));
  writer->document["animations"] = json::array({animation});
}

}  // namespace

std::string GlbBytes(const AnimatedMesh& mesh, const ImageU8& texture) {
  LIKENESS_CHECK(!mesh.topology.triangles.empty() && texture.channels() == 3);
  GlbWriter writer;
  writer.document["scene"] = 0;
  writer.document["scenes"] = json::array({{{"nodes", json::array({0})}}});
  writer.document["nodes"] = json::array({{{"name", "head"}, {"mesh", 0}}});
  AddMesh(mesh, &writer);
  AddMaterial(texture, &writer);
  if (mesh.seconds.size() > 1) AddAnimation(mesh, &writer);
  return writer.Bytes();
}

}  // namespace likeness
