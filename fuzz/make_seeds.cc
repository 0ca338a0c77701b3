// Writes what each fuzz target starts from, as FOLDER/<target>/<name>, with the project's own writers where it has
// them.
//
//   make_seeds FOLDER

#include <zlib.h>

#include <filesystem>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/performance.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/file.h"
#include "likeness/base/npy.h"
#include "likeness/capture/ava256/test_folder.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/calibration_formats/colmap.h"
#include "likeness/capture/calibration_formats/nerfstudio.h"
#include "likeness/capture/condition_file.h"
#include "likeness/capture/split_file.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/avif.h"
#include "likeness/image/image_io.h"
#include "likeness/image/webp.h"
#include "likeness/simulate/glb/gltf_test_file.h"
#include "likeness/simulate/head.h"
#include "likeness/simulate/human/recipe.h"
#include "likeness/texture/texture_sums.h"
#include "likeness/texture/unwrap_record.h"
#include "likeness/train/evaluation_part_file.h"

namespace likeness {
namespace {

MeshTopology SquareTopology() {
  return {4, {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.5f, 0.25f}}, {{0, 1, 2}, {2, 1, 3}}, {{0, 1, 2}, {2, 4, 3}}};
}

Vertices SquareVertices() {
  Vertices vertices(4, 3);
  vertices << 0, 0, 0, 10.5f, 0, 0, 0, -1e-3f, 3, 10, 10, 7;
  return vertices;
}

std::string GzipOf(const std::string& text) {
  z_stream stream = {};
  constexpr int kGzip = 16 + MAX_WBITS;
  LIKENESS_CHECK(deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string packed(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  LIKENESS_CHECK(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

ImageU8 Picture(int width, int height, int channels) {
  ImageU8 image(width, height, channels);
  int i = 0;
  for (uint8_t& value : image.values()) value = static_cast<uint8_t>(i++ * 37 % 251);
  return image;
}

// A header as Live Link Face writes it and two rows.
std::string LiveLink() {
  std::string header = "Timecode,BlendShapeCount", rows[2] = {"23:59:59:28.412,55", "00:00:00:01.5,55"};
  for (const std::string& name : ExpressionNames()) {
    header += "," + name;
    rows[0] += ",0.25";
    rows[1] += ",1";
  }
  return header + ",HeadYaw,HeadPitch,HeadRoll\n" + rows[0] + ",0.1,-0.2,0.01\n" + rows[1] + ",-0.1,0,0\n";
}

// One square with a morph target: plain, sparse and compressed.
std::string Glb() {
  GltfTestFile file;
  const std::vector<std::array<float, 3>> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const int mesh = file.AddMesh("head", corners, {{0, 1, 2}, {2, 1, 3}}, {{"jawOpen", corners}});
  nlohmann::json& primitive = file.document["meshes"][mesh]["primitives"][0];
  const int sparse = file.AddSparse(4, {1, 3}, {{0, 0, 1}, {0, 1, 0}});
  primitive["targets"][0]["POSITION"] = sparse;
  const int view = file.AddCompressed(corners, sizeof(corners[0]), "ATTRIBUTES");
  primitive["attributes"]["POSITION"] = file.AddAccessor(view, 5126, "VEC3", corners.size());
  primitive["material"] = 0;
  file.document["materials"] = {{{"name", "skin"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0.5, 1}}}}}};
  file.AddNode({{"mesh", mesh}, {"translation", {0, 1, 0}}, {"rotation", {0, 0, 0, 1}}, {"scale", {2, 2, 2}}});
  return file.Bytes();
}

// The text of a GLB, a zero byte, and its binary chunk.
std::string TextAndBinary(const std::string& glb) {
  uint32_t length = 0;
  std::copy(glb.begin() + 12, glb.begin() + 16, reinterpret_cast<char*>(&length));
  return glb.substr(20, length) + '\0' + glb.substr(20 + length + 8);
}

std::string Zip(const std::filesystem::path& scratch, bool deflate) {
  WriteZip(scratch, {{"pose/000012.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n"}, {"7.txt", "x"}, {"notes.md", "y"}}, deflate);
  std::string bytes = ReadFile(scratch);
  std::filesystem::remove(scratch);
  return bytes;
}

void FillWeights(Avatar* avatar) {
  for (const TensorInfo& info : NetworkTensors(avatar->architecture)) {
    avatar->weights[info.name] = {info.shape, std::vector<float>(static_cast<size_t>(ElementCount(info.shape)))};
  }
}

Avatar SmallAvatar() {
  Avatar avatar;
  avatar.architecture.texture_size = 16;
  avatar.architecture.vertex_count = 4;
  avatar.architecture.latent = 3;
  avatar.topology = SquareTopology();
  avatar.identities[0].texture_mean = ImageF(16, 16, 3);
  avatar.identities[0].vertex_mean = SquareVertices();
  avatar.codes = {{"EXP_jaw", "000003", {1, 2, 3}}};
  avatar.training = {{"iterations", "12"}};
  FillWeights(&avatar);
  return avatar;
}

// Two people with learned vectors, and a condition.
Avatar SmallFamily() {
  Avatar avatar = SmallAvatar();
  avatar.architecture.identities = 2;
  avatar.architecture.identity = IdentityConditioning::kLearned;
  avatar.architecture.identity_size = 2;
  avatar.architecture.conditions = {{"gaze", 1}};
  avatar.identities.push_back(avatar.identities[0]);
  avatar.identities[0].name = "anna";
  avatar.identities[1].name = "ben";
  avatar.condition_mean = {0};
  avatar.condition_deviation = {1};
  avatar.codes[0].identity = 1;
  avatar.codes[0].conditions = {4};
  FillWeights(&avatar);
  return avatar;
}

// Two frames with a condition, or without what may be absent.
std::string SmallPerformance(bool whole) {
  Performance performance;
  performance.latent = 2;
  performance.seconds = {0, 0.5};
  performance.codes = {1, -2, 3, 4};
  performance.world_from_head = {{}, {RotationFromYawPitchRoll(0.5, -0.1, 0.2), {10, 20, 30}}};
  if (whole) {
    performance.avatar = "0123456789abcdef";
    performance.person = "anna";
    performance.conditions = {{"gaze", 1}};
    performance.condition_values = {7, 8};
    performance.frame_names = {"EXP_jaw/000003", "EXP_jaw/000004"};
  }
  return PerformanceBytes(performance);
}

// The header alone: the target makes the data itself.
std::string HeaderOf(const Avatar& avatar, const std::filesystem::path& scratch) {
  SaveAvatar(scratch, avatar);
  const std::string file = ReadFile(scratch);
  std::filesystem::remove(scratch);
  uint64_t length = 0;
  std::copy(file.begin(), file.begin() + sizeof(length), reinterpret_cast<char*>(&length));
  return file.substr(sizeof(length), length);
}

void WriteSeeds(const std::filesystem::path& folder) {
  const auto seed = [&](const char* target, const char* name, const std::string& bytes) {
    WriteFile(folder / target / name, bytes, Sync::kNo);
  };
  seed("obj", "square", ObjText(SquareVertices(), SquareTopology()));
  seed("obj", "groups",
       "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng left\nf -3/-1/-1 -2/1/1 3/1/1\ng\nf 1 2 3\n");

  const std::string target = "# a comment\n3 0.1 -.2 3e-2\n999 1 2 3\n";
  seed("target", "plain", target);
  seed("target", "packed", GzipOf(target));

  Camera camera = LookAt({300, 20, 1000}, {0, 0, 0}, {0, 1, 0}, 7724.681, 1334, 2048);
  camera.name = "400069";
  std::vector<Camera> cameras = {camera, camera};
  cameras[1].name = "400070";
  const std::string calibration = CalibrationText(cameras);
  seed("calibration", "two", calibration);
  seed("calibration", "sized", "400069 1334 2048" + calibration.substr(camera.name.size()));
  seed("transform", "pose", TransformText(camera.cam_from_world));
  seed("frame_list", "list", FrameListText({{"EXP_ROM", "000123"}, {"SEN_approach", "7"}}));
  seed(
      "condition_table", "gaze",
      ConditionTableText({{"x", "y"}, {{{"EXP_ROM", "000123"}, {0.25f, -1}}, {{"SEN_approach", "7"}, {1e-9f, 3e7f}}}}));
  seed("split", "cameras", SplitText({{"01", "02"}, {"03"}, {"EXP_free"}}));
  seed("split", "segments", R"({"segment": ["EXP_ROM", "EXP_free_face"]})");

  DistortedCamera distorted;
  distorted.camera = camera;
  distorted.image = "cam/400069.png";
  const ColmapFiles text = FormatColmapText({distorted}, {}), binary = FormatColmapBinary({distorted}, {});
  seed("colmap_text", "one", text.cameras + "=\n" + text.images);
  seed("colmap_text", "lens",
       "1 OPENCV 640 480 500 501 320 240 0.1 -0.2 1e-3 2e-3\n=\n1 1 0 0 0 0.1 2 3 1 a/1.png\n\n");
  const auto size = static_cast<uint16_t>(binary.cameras.size());
  seed("colmap_binary", "one",
       std::string{static_cast<char>(size & 255), static_cast<char>(size >> 8)} + binary.cameras + binary.images);
  seed("nerfstudio", "one", FormatNerfstudio({distorted}, "points.ply"));
  seed("opencv_storage", "yaml",
       "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
       "   dt: d\n   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]\ndist_coeffs: !!opencv-matrix\n   rows: 1\n"
       "   cols: 5\n   dt: d\n   data: [ 0.1, -0.2, 0., 0., 0. ]\nrvec: [ 0.1, 0.2, 0.3 ]\ntvec: [ 1., 2., 3. ]\n");
  seed("opencv_storage", "xml",
       "<?xml version=\"1.0\"?>\n<opencv_storage>\n<K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>"
       "<data>500. 0. 320. 0. 500. 240. 0. 0. 1.</data></K>\n<T>1. 2. 3.</T>\n</opencv_storage>\n");
  seed("opencv_storage", "json", R"({"left": {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "T": [0, 0, 1]}})");

  const Vertices vertices = SquareVertices();
  for (const PlyEncoding encoding : {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian}) {
    const std::string name = fmt::format("encoding{}", static_cast<int>(encoding));
    seed("ply", name.c_str(), EncodePly(vertices, SquareTopology().triangles, encoding));
  }
  seed("npy", "matrix", EncodeNpy({2, 3}, {1, 2, 3, 4, 5, 6}));
  seed("zip", "stored", Zip(folder / "scratch.zip", false));
  seed("zip", "deflated", Zip(folder / "scratch.zip", true));
  seed("sensor_calibration", "two", R"({"KRT": [
{"cameraId": "400940", "K": [[7000, 0, 0], [0, 7000.5, 0], [1334, 2048, 1]], "distortion": [0, 0, 0, 0],
 "T": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [10, -20.5, 1000, 1]]},
{"cameraId": "400941", "K": [[7000, 0, 0], [0, 7000.5, 0], [1334, 2048, 1]], "distortion": [0.1, -0.2, 1e-3, 0],
 "T": [[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [10, -20.5, 1000, 1]]}]})");
  seed("frame_csv", "ava256", "seg_id,frame_id\nEXP_cheeks,021924\nSEN_a,7\n");
  seed("frame_csv", "goliath", std::string("frame,split\n3,train\n4,test\n") + '\0' + "frame,segment_name\n3,a\n4,b\n");
  seed("shape_map", "two", R"({"JawOpen": {"MouthOpen_h": 1.3}, "eye_blink_left": {"a": 0.5, "b": -1}})");
  seed("gltf", "whole", Glb());
  seed("gltf", "parts", TextAndBinary(Glb()));
  seed("floats", "vertices", {reinterpret_cast<const char*>(vertices.data()), sizeof(float) * vertices.size()});
  seed("numbers", "variance", "343.25\n");
  seed("numbers", "code", "1, -2.5e-3\n3 4\n");
  seed("live_link", "midnight", LiveLink());
  seed("run_record", "log", "iteration,elapsed_s,loss,texture,geometry,kl,skipped\n100,2.50,0.91,0.5,0.4,1.2e-3,0\n");
  seed("run_record", "stages", "stage,seconds\nsimulate,12.5\nunwrap,3\n");
  TextureSums sums(2);
  sums.Add({ImageU8(2, 2, 3, 9), ImageU8(2, 2, 1, 255)});
  seed("texture_sums", "sums", sums.Bytes());
  ImageMeasurement measurement;
  measurement.error = {12.5, 300};
  seed("evaluation_part", "part", PartText({std::nullopt, measurement, measurement}));
  seed("unwrap_record", "record", UnwrapRecordText({80, true, {"01", "02"}, "0123456789abcdef"}));

  seed("recipe", "person", RecipeText(RecipeFromSeed(1)));
  seed("recipe", "changed", "from_seed = 7\nname = 'x'\nage = 1\n[local]\nnose-hump = -0.5\n");
  seed("config", "all",
       "masks = false\nsize = 64\nsteps = 5\nseed = 9\nrate = 1e-3\nhead = 'human:2'\nshading = \"albedo\"\n"
       "out = 'a/b'\ncameras = ['x', \"y z\"]\nthreads = 2\nquiet = true\n[loss]\nimage = 0.25\n");

  for (const int channels : {1, 3, 4}) {
    seed("image", fmt::format("png{}", channels).c_str(), EncodePng(Picture(5, 4, channels), 6));
  }
  seed("image", "jpeg", EncodeJpeg(Picture(17, 9, 3)));
  seed("image", "avif", EncodeAvif(Picture(8, 8, 3)));
  seed("image", "webp", EncodeWebp(Picture(9, 5, 4)));
  // Width, colour type, and a row with each filter.
  for (int kind = 0; kind < 3; ++kind) {
    std::string rows = {'\3', static_cast<char>(kind)};
    const int row_bytes = 4 * (kind == 0 ? 1 : kind == 1 ? 3 : 4);
    for (char filter = 0; filter < 5; ++filter) rows += filter + std::string(static_cast<size_t>(row_bytes), 'x');
    seed("png_rows", fmt::format("kind{}", kind).c_str(), rows);
  }

  const float values[] = {1, 2, 3};
  const std::vector<TensorView> tensors = {ViewOf("a.weight", {1, 3}, values)};
  seed("safetensors", "one",
       SafetensorsHeader(tensors, {{"format", "test"}}) +
           std::string(reinterpret_cast<const char*>(values), sizeof(values)));
  seed("performance", "whole", SmallPerformance(true));
  seed("performance", "least", SmallPerformance(false));
  const Avatar avatar = SmallAvatar();
  seed("architecture", "paper", ArchitectureToJson(avatar.architecture));
  seed("architecture", "family", ArchitectureToJson(SmallFamily().architecture));
  seed("avatar", "header", HeaderOf(avatar, folder / "scratch.avatar"));
  seed("avatar", "family", HeaderOf(SmallFamily(), folder / "scratch.avatar"));
  seed("decoder", "header", HeaderOf(avatar, folder / "scratch.avatar"));
  seed("decoder", "family", HeaderOf(SmallFamily(), folder / "scratch.avatar"));
}

}  // namespace
}  // namespace likeness

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: make_seeds FOLDER\n");
    return 2;
  }
  try {
    likeness::WriteSeeds(argv[1]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
  return 0;
}
