#include "likeness/simulate/glb/gltf_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/simulate/glb/gltf_test_file.h"

namespace likeness {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using Points = std::vector<std::array<float, 3>>;

const Points kSquare = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5f}};
const std::vector<Eigen::Vector3i> kTwoTriangles = {{0, 1, 2}, {0, 2, 3}};

// A square with two morph targets, the second sparse.
GltfTestFile SquareFile() {
  GltfTestFile file;
  file.AddMesh("square", kSquare, kTwoTriangles, {{"jawOpen", {{0, -1, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 2}}}});
  json& mesh = file.document["meshes"][0];
  mesh["primitives"][0]["targets"].push_back({{"POSITION", file.AddSparse(4, {1, 3}, {{1, 2, 3}, {4, 5, 6}})}});
  mesh["extras"]["targetNames"].push_back("eyeBlink_L");
  file.AddNode({{"name", "node"}, {"mesh", 0}});
  return file;
}

void ExpectRow(const Vertices& positions, int row, float x, float y, float z, float tolerance = 1e-6f) {
  EXPECT_NEAR(positions(row, 0), x, tolerance);
  EXPECT_NEAR(positions(row, 1), y, tolerance);
  EXPECT_NEAR(positions(row, 2), z, tolerance);
}

std::string ErrorOfBytes(const std::string& bytes) {
  return ErrorOf([&] { ParseGltf("a.glb", bytes); });
}

TEST(Gltf, ReadsMorphTargetsPlainAndSparse) {
  const GltfScene scene = ParseGltf("a.glb", SquareFile().Bytes());
  ASSERT_EQ(scene.parts.size(), 1u);
  const GltfPart& part = scene.parts[0];
  EXPECT_EQ(part.mesh, "square");
  EXPECT_EQ(part.node, "node");
  EXPECT_EQ(part.triangles, kTwoTriangles);
  ExpectRow(part.positions, 3, 0, 1, 0.5f);
  ASSERT_EQ(part.morphs.size(), 2u);
  EXPECT_EQ(part.morphs[0].name, "jawOpen");
  EXPECT_THAT(part.morphs[0].vertices, testing::ElementsAre(0, 3));
  EXPECT_EQ(part.morphs[1].name, "eyeBlink_L");
  EXPECT_THAT(part.morphs[1].vertices, testing::ElementsAre(1, 3));
  EXPECT_EQ(part.morphs[1].deltas[1], Eigen::Vector3f(4, 5, 6));
}

TEST(Gltf, PlacesNodesInTheirParents) {
  GltfTestFile file = SquareFile();
  file.document["nodes"][0]["translation"] = {10, 0, 0};
  file.document["scenes"][0]["nodes"] = {1};
  // A quarter turn about z, then twice the size.
  const double half = std::sqrt(0.5);
  file.AddNode({{"children", {0}}, {"rotation", {0, 0, half, half}}, {"scale", {2, 2, 2}}}, false);
  const GltfScene scene = ParseGltf("a.glb", file.Bytes());
  ASSERT_EQ(scene.parts.size(), 1u);
  ExpectRow(scene.parts[0].positions, 1, 0, 22, 0, 1e-5f);
  ExpectRow(scene.parts[0].positions, 3, -2, 20, 1, 1e-5f);
  EXPECT_TRUE(scene.parts[0].morphs[1].deltas[0].isApprox(Eigen::Vector3f(-4, 2, 6), 1e-5f));
}

TEST(Gltf, AppliesSkinsAtRest) {
  GltfTestFile file = SquareFile();
  json& attributes = file.document["meshes"][0]["primitives"][0]["attributes"];
  // Vertices 0 and 1 follow joint 0, vertex 2 joint 1, vertex 3 both.
  attributes["JOINTS_0"] = file.AddAccessor(
      file.AddView(std::vector<uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}), 5121, "VEC4", 4);
  attributes["WEIGHTS_0"] =
      file.AddAccessor(file.AddView(std::vector<uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 51, 204, 0, 0}),
                       5121, "VEC4", 4, true);
  std::vector<float> inverse_binds(32, 0);
  for (int joint = 0; joint < 2; ++joint) {
    for (int k = 0; k < 4; ++k) inverse_binds[16 * joint + 5 * k] = 1;
  }
  inverse_binds[16 + 12] = -1;  // joint 1 was bound at x = 1
  file.document["skins"] = {
      {{"joints", {1, 2}}, {"inverseBindMatrices", file.AddAccessor(file.AddView(inverse_binds), 5126, "MAT4", 2)}}};
  file.document["nodes"][0]["skin"] = 0;
  file.document["nodes"][0]["translation"] = {99, 99, 99};  // of no account for skinned parts
  file.AddNode({{"translation", {0, 0, 7}}});
  file.AddNode({{"translation", {1, 10, 0}}});
  const GltfScene scene = ParseGltf("a.glb", file.Bytes());
  ASSERT_EQ(scene.parts.size(), 1u);
  ExpectRow(scene.parts[0].positions, 1, 1, 0, 7, 1e-5f);
  ExpectRow(scene.parts[0].positions, 2, 1, 11, 0, 1e-5f);
  ExpectRow(scene.parts[0].positions, 3, 0, 1 + 8, 0.5f + 0.2f * 7, 1e-5f);
}

// Positions as normalised int16, compressed, with the scale in the node; triangles compressed too.
TEST(Gltf, ReadsQuantisedAndCompressedParts) {
  constexpr int kSide = 40;
  std::vector<int16_t> quantised;
  std::vector<uint32_t> corners;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (const int value : {800 * x, 700 * y, (x * y * 37) % 5000, 0})
        quantised.push_back(static_cast<int16_t>(value));
    }
  }
  for (int y = 0; y + 1 < kSide; ++y) {
    for (int x = 0; x + 1 < kSide; ++x) {
      const auto v = static_cast<uint32_t>(y * kSide + x);
      for (const uint32_t corner : {v, v + 1, v + kSide}) corners.push_back(corner);
    }
  }
  GltfTestFile file;
  const int positions =
      file.AddAccessor(file.AddCompressed(quantised, 8, "ATTRIBUTES"), 5122, "VEC3", kSide * kSide, true);
  const int indices = file.AddAccessor(file.AddCompressed(corners, 4, "TRIANGLES"), 5125, "SCALAR", corners.size());
  file.document["meshes"].push_back(
      {{"name", "grid"}, {"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}});
  file.AddNode({{"mesh", 0}, {"scale", {2, 2, 2}}});
  const GltfScene scene = ParseGltf("a.glb", file.Bytes());
  ASSERT_EQ(scene.parts.size(), 1u);
  ASSERT_EQ(scene.parts[0].positions.rows(), kSide * kSide);
  for (int v = 0; v < kSide * kSide; ++v) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(scene.parts[0].positions(v, k), 2 * quantised[4 * v + k] / 32767.0f, 1e-6f);
    }
  }
  ASSERT_EQ(scene.parts[0].triangles.size(), corners.size() / 3);
  // The codec may turn triangles, but keeps their order.
  for (size_t t = 0; t < scene.parts[0].triangles.size(); ++t) {
    const Eigen::Vector3i& found = scene.parts[0].triangles[t];
    EXPECT_EQ(found.minCoeff(), static_cast<int>(corners[3 * t]));
    EXPECT_EQ(found.sum(), static_cast<int>(corners[3 * t] + corners[3 * t + 1] + corners[3 * t + 2]));
  }
}

TEST(Gltf, ReadsUvsWithTheirTransformAndMaterials) {
  GltfTestFile file = SquareFile();
  json& primitive = file.document["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] =
      file.AddAccessor(file.AddView(std::vector<float>{0, 0, 1, 0, 1, 1, 0, 1}), 5126, "VEC2", 4);
  primitive["material"] = 0;
  file.document["images"] = {{{"bufferView", file.AddView(std::string("no picture"))}, {"mimeType", "image/webp"}}};
  file.document["textures"] = {{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}};
  const json transform = {{"offset", {0.5, 0.25}}, {"scale", {0.5, 0.5}}};
  file.document["materials"] = {
      {{"name", "Skin"},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.25},
       {"doubleSided", true},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {1, 0.5, 0.25, 1}},
         {"roughnessFactor", 0.3},
         {"baseColorTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}}}}}};
  const GltfScene scene = ParseGltf("a.glb", file.Bytes());
  ASSERT_EQ(scene.materials.size(), 1u);
  const GltfMaterial& material = scene.materials[0];
  EXPECT_EQ(material.name, "Skin");
  EXPECT_EQ(material.alpha, GltfAlpha::kMask);
  EXPECT_FLOAT_EQ(material.alpha_cutoff, 0.25f);
  EXPECT_TRUE(material.double_sided);
  EXPECT_FLOAT_EQ(material.base_colour[1], 0.5f);
  EXPECT_FLOAT_EQ(material.roughness, 0.3f);
  EXPECT_EQ(material.base_image, 0);
  EXPECT_EQ(scene.images[0], "no picture");
  // v runs up here.
  EXPECT_TRUE(scene.parts[0].uvs[0].isApprox(Eigen::Vector2f(0.5f, 0.75f)));
  EXPECT_TRUE(scene.parts[0].uvs[2].isApprox(Eigen::Vector2f(1.0f, 0.25f)));
}

TEST(Gltf, ReadsTextFilesWithBuffersBeside) {
  GltfTestFile file = SquareFile();
  const std::string bytes = file.Bytes();
  uint32_t text_length = 0;
  std::memcpy(&text_length, bytes.data() + 12, 4);
  json document = json::parse(bytes.substr(20, text_length));
  const std::string binary = bytes.substr(28 + text_length);
  document["buffers"][0]["uri"] = "square.bin";
  const GltfScene scene = ParseGltf("a.gltf", document.dump(), [&](const std::string& name) {
    EXPECT_EQ(name, "square.bin");
    return binary.substr(0, document["buffers"][0]["byteLength"]);
  });
  ExpectRow(scene.parts.at(0).positions, 2, 1, 1, 0);
  EXPECT_THAT(ErrorOf([&] { ParseGltf("a.gltf", document.dump()); }), HasSubstr("square.bin"));
  document["buffers"][0]["uri"] = "../../etc/passwd";
  EXPECT_THAT(ErrorOf([&] { ParseGltf("a.gltf", document.dump(), [](const std::string&) { return ""; }); }),
              HasSubstr("not in its folder"));
}

TEST(Gltf, RefusesLies) {
  const auto broken = [](const std::function<void(json*)>& change) {
    GltfTestFile file = SquareFile();
    change(&file.document);
    return ErrorOfBytes(file.Bytes());
  };
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["count"] = 1000000; }), HasSubstr("claims 1000000 elements"));
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["count"] = 1u << 31; }), HasSubstr("a.glb"));
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["count"] = -1; }), HasSubstr("a.glb"));
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["byteOffset"] = 40; }), HasSubstr("claims 4 elements"));
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["bufferView"] = 77; }), HasSubstr("buffer view 77"));
  EXPECT_THAT(broken([](json* d) { (*d)["accessors"][0]["componentType"] = 5130; }), HasSubstr("a.glb"));
  EXPECT_THAT(broken([](json* d) { (*d)["bufferViews"][0]["byteLength"] = 1 << 30; }), HasSubstr("leaves its buffer"));
  EXPECT_THAT(broken([](json* d) { (*d)["bufferViews"][0]["buffer"] = 9; }), HasSubstr("buffer 9"));
  EXPECT_THAT(broken([](json* d) { (*d)["meshes"][0]["primitives"][0]["indices"] = 99; }), HasSubstr("a.glb"));
  EXPECT_THAT(broken([](json* d) { (*d)["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99; }),
              HasSubstr("accessor 99"));
  EXPECT_THAT(broken([](json* d) { (*d)["nodes"][0]["mesh"] = 5; }), HasSubstr("mesh 5"));
  EXPECT_THAT(broken([](json* d) { (*d)["nodes"][0]["children"] = {0}; }), HasSubstr("cycle"));
  EXPECT_THAT(broken([](json* d) { (*d)["nodes"][0]["rotation"] = {0, 0, 0, 0}; }), HasSubstr("rotation"));
  EXPECT_THAT(broken([](json* d) { (*d)["nodes"][0]["scale"] = {1e30, 1, 1}; }), HasSubstr("unsound scale"));
  EXPECT_THAT(broken([](json* d) { (*d)["scene"] = 3; }), HasSubstr("scene 3"));
  EXPECT_THAT(broken([](json* d) { (*d)["extensionsRequired"] = {"KHR_draco_mesh_compression"}; }),
              HasSubstr("KHR_draco_mesh_compression"));
  EXPECT_THAT(broken([](json* d) {
                (*d)["images"] = {{{"bufferView", 0}}}, (*d)["bufferViews"][0]["byteOffset"] = 1 << 20;
              }),
              HasSubstr("leaves its buffer"));
  EXPECT_THAT(broken([](json* d) {
                json deep = json::array();
                for (int i = 0; i < 100; ++i) deep = json::array({deep});
                (*d)["extras"] = deep;
              }),
              HasSubstr("nested"));
}

TEST(Gltf, RefusesBadNumbersAndIndices) {
  GltfTestFile file;
  Points points = kSquare;
  points[1][2] = std::numeric_limits<float>::quiet_NaN();
  file.AddMesh("square", points, kTwoTriangles);
  file.AddNode({{"mesh", 0}});
  EXPECT_THAT(ErrorOfBytes(file.Bytes()), HasSubstr("no sound number"));
  GltfTestFile other;
  other.AddMesh("square", kSquare, {{0, 1, 4}});
  other.AddNode({{"mesh", 0}});
  EXPECT_THAT(ErrorOfBytes(other.Bytes()), HasSubstr("vertex 4, but there are 4"));
  GltfTestFile sparse = SquareFile();
  sparse.document["accessors"].back()["sparse"]["count"] = 3;
  EXPECT_THAT(ErrorOfBytes(sparse.Bytes()), HasSubstr("claims 3 elements"));
}

TEST(Gltf, RefusesWhatIsCutOffOrNoGltf) {
  const std::string bytes = SquareFile().Bytes();
  for (size_t length = 0; length < bytes.size(); length += 7) {
    EXPECT_THAT(ErrorOfBytes(bytes.substr(0, length)), HasSubstr("a.glb")) << length;
  }
  EXPECT_THAT(ErrorOfBytes("no glTF"), HasSubstr("neither a GLB nor JSON"));
  EXPECT_THAT(ErrorOfBytes("{}"), HasSubstr("a.glb"));
  EXPECT_THAT(ErrorOfBytes("[1, 2]"), HasSubstr("neither a GLB nor JSON"));
}

// Whatever is changed in a file, it is read or refused; the sanitizers watch.
TEST(Gltf, SurvivesChangedBytes) {
  std::vector<uint32_t> corners;
  std::vector<float> points;
  for (uint32_t i = 0; i < 60; ++i) {
    const uint32_t column = i % 7, row = i / 7;
    points.insert(points.end(), {static_cast<float>(column), static_cast<float>(row), 1});
    for (const uint32_t corner : {i, (i + 1) % 60, (i + 8) % 60}) corners.push_back(corner);
  }
  GltfTestFile file = SquareFile();
  const int positions = file.AddAccessor(file.AddCompressed(points, 12, "ATTRIBUTES"), 5126, "VEC3", 60);
  const int indices = file.AddAccessor(file.AddCompressed(corners, 4, "TRIANGLES"), 5125, "SCALAR", corners.size());
  file.document["meshes"].push_back(
      {{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}});
  file.AddNode({{"mesh", 1}});
  const std::string bytes = file.Bytes();
  ASSERT_EQ(ParseGltf("a.glb", bytes).parts.size(), 2u);
  Random random(5);
  int read = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string changed = bytes;
    const int changes = 1 + static_cast<int>(random.Uniform() * 3);
    for (int i = 0; i < changes; ++i) {
      const auto where = static_cast<size_t>(random.Uniform() * static_cast<double>(changed.size()));
      changed[where] = static_cast<char>(32 + random.Uniform() * 95);
    }
    try {
      ParseGltf("a.glb", changed);
      ++read;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace likeness
