// Calibrations of other tools, right and wrong. What is right is written out by hand from their documentation, and
// checked by projecting a point with formulas of the test's own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/capture/calibration_formats/colmap.h"
#include "likeness/capture/calibration_formats/nerfstudio.h"
#include "likeness/capture/calibration_formats/opencv_storage.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

Eigen::Vector2d Project(const DistortedCamera& source, const Eigen::Vector3d& point) {
  const Eigen::Vector3d in_cam = source.camera.cam_from_world * point;
  EXPECT_GT(in_cam.z(), 0);
  return (source.camera.intrinsics * source.lens.Distort(in_cam.hnormalized()).homogeneous()).head<2>();
}

// A camera 4 units up the z axis that looks down at the origin, as OpenGL has it by default: x right, y up.
const char* const kNerf = R"({"camera_model": "OPENCV", "fl_x": 800, "fl_y": 820, "cx": 320.5, "cy": 240.25, "w": 640,
  "h": 480, "k1": 0.1, "k2": 0.01, "p1": 0.002, "p2": -0.003, "frames": [
  {"file_path": "images/left.png", "mask_path": "masks/left.png",
   "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]},
  {"file_path": "images/right.png", "fl_x": 900, "k1": 0, "k2": 0, "p1": 0, "p2": 0,
   "transform_matrix": [[0, 0, 1, 5], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]}]})";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(NerfstudioTest, ProjectsAsItsDocumentationSays) {
  const DistortedCameras cameras = ParseNerfstudio("transforms.json", kNerf);
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].camera.name, "left");
  EXPECT_EQ(cameras[0].image, "images/left.png");
  EXPECT_EQ(cameras[0].mask, "masks/left.png");
  EXPECT_EQ(cameras[1].camera.width, 640);
  // A point to the right (x = 0.4) and up (y = 0.2): depth 4, so 0.1 right and 0.05 up, which is -0.05 down.
  const double x = 0.1, y = -0.05, r2 = x * x + y * y, radial = 1 + 0.1 * r2 + 0.01 * r2 * r2;
  const double xd = x * radial + 2 * 0.002 * x * y + -0.003 * (r2 + 2 * x * x);
  const double yd = y * radial + 0.002 * (r2 + 2 * y * y) + 2 * -0.003 * x * y;
  const Eigen::Vector2d left = Project(cameras[0], {0.4, 0.2, 0});
  EXPECT_NEAR(left.x(), 800 * xd + 320.5, 1e-10);
  EXPECT_NEAR(left.y(), 820 * yd + 240.25, 1e-10);
  // From x = 5 towards -x: z = -1 of the world lies to the right.
  const Eigen::Vector2d right = Project(cameras[1], {0, 0, -1});
  EXPECT_NEAR(right.x(), 900 * 0.2 + 320.5, 1e-10);
  EXPECT_NEAR(right.y(), 240.25, 1e-10);
}

TEST(NerfstudioTest, UndoesAppliedTransformAndScale) {
  const DistortedCameras plain = ParseNerfstudio("t", kNerf);
  const RigidTransform applied = {RotationFromYawPitchRoll(0.3, 0.5, -0.8), {1, -2, 3}};
  DistortedCameras moved = plain;
  for (DistortedCamera& camera : moved) {
    RigidTransform pose = applied * camera.camera.cam_from_world.Inverse();
    pose.translation *= 0.25;
    camera.camera.cam_from_world = pose.Inverse();
    camera.lens = {};
  }
  std::string text = FormatNerfstudio(moved, "");
  std::string rows;
  for (int i = 0; i < 3; ++i) {
    rows += fmt::format("{}[{}, {}, {}, {}]", i > 0 ? "," : "", applied.rotation(i, 0), applied.rotation(i, 1),
                        applied.rotation(i, 2), applied.translation[i]);
  }
  text.insert(1, fmt::format("\"applied_transform\": [{}], \"applied_scale\": 0.25,", rows));
  const DistortedCameras back = ParseNerfstudio("t", text);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_LT((back[i].camera.CentreInWorld() - plain[i].camera.CentreInWorld()).norm(), 1e-12);
    EXPECT_LT((back[i].camera.cam_from_world.rotation - plain[i].camera.cam_from_world.rotation).norm(), 1e-12);
  }
}

TEST(NerfstudioTest, ReadsFisheyesAndFieldsOfView) {
  const auto fisheye = ParseNerfstudio("t", Replaced(kNerf, "\"OPENCV\"", "\"OPENCV_FISHEYE\""));
  EXPECT_EQ(fisheye[0].lens.model, Lens::Model::kFisheye);
  EXPECT_EQ(fisheye[0].lens.k[1], 0.01);
  const auto blender = ParseNerfstudio(
      "t", R"({"camera_angle_x": 1.0471975511965976, "w": 100, "h": 80, "frames": [{"file_path": "./train/r_0",
      "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]})");
  EXPECT_NEAR(blender[0].camera.intrinsics(0, 0), 50 * std::sqrt(3), 1e-12);
  EXPECT_EQ(blender[0].camera.intrinsics(1, 2), 40);
}

TEST(NerfstudioTest, WrongFilesAreNamed) {
  const auto error = [](const std::string& from, const std::string& to) {
    return ErrorOf([&] { ParseNerfstudio("t.json", Replaced(kNerf, from, to)); });
  };
  EXPECT_THAT(ErrorOf([] { ParseNerfstudio("t.json", ""); }), HasSubstr("t.json: is no JSON object"));
  EXPECT_THAT(ErrorOf([] { ParseNerfstudio("t.json", std::string(100000, '[')); }), HasSubstr("t.json"));
  EXPECT_THAT(ErrorOf([] { ParseNerfstudio("t.json", "{}"); }), HasSubstr("expected \"frames\""));
  EXPECT_THAT(ErrorOf([] { ParseNerfstudio("t.json", "{\"frames\": []}"); }), HasSubstr("no cameras"));
  EXPECT_THAT(error("\"OPENCV\"", "\"EQUIRECTANGULAR\""), HasSubstr("'EQUIRECTANGULAR' is not known here"));
  EXPECT_THAT(error("800", "\"800\""), HasSubstr("frame 'images/left.png': \"fl_x\" is no number"));
  EXPECT_THAT(error("800", "1e999"), HasSubstr("t.json"));
  EXPECT_THAT(error("800", "-800"), HasSubstr("focal lengths of -800"));
  EXPECT_THAT(error("640", "1e15"), HasSubstr("\"w\" is 1e+15 pixels"));
  EXPECT_THAT(error("[1, 0, 0, 0]", "[-1, 0, 0, 0]"), HasSubstr("mirrors"));
  EXPECT_THAT(error("[1, 0, 0, 0]", "[2, 0, 0, 0]"), HasSubstr("is no rigid transform"));
  EXPECT_THAT(error("[1, 0, 0, 0]", "[1, 0, 0]"), HasSubstr("is no 4 x 4 matrix"));
  EXPECT_THAT(error("right.png", "left.png"), HasSubstr("several cameras the same image"));
}

const char* const kColmapCameras =
    "# comment\n1 OPENCV 640 480 800 820 320.5 240.25 0.1 0.01 0.002 -0.003\n7 SIMPLE_RADIAL 100 80 90 50 40 -0.2\n";
// The second image: a turn of 90 degrees about y (w = y = sqrt 1/2) takes the world's x to -z and z to x.
const char* const kColmapImages =
    "# comment\n1 1 0 0 0 0.1 -0.2 4 1 cam a/left.jpg\n10.5 20.5 -1 3 4 17\n"
    "4 0.7071067811865476 0 0.7071067811865476 0 0 0 5 7 right.jpg\n\n";

TEST(ColmapTest, TextProjectsAsItsDocumentationSays) {
  const DistortedCameras cameras = ParseColmapText("sparse", kColmapCameras, kColmapImages);
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].camera.name, "left");
  EXPECT_EQ(cameras[0].image, "cam a/left.jpg");
  const double x = (0.3 + 0.1) / 4, y = (0.6 - 0.2) / 4, r2 = x * x + y * y, radial = 1 + 0.1 * r2 + 0.01 * r2 * r2;
  const Eigen::Vector2d left = Project(cameras[0], {0.3, 0.6, 0});
  EXPECT_NEAR(left.x(), 800 * (x * radial + 2 * 0.002 * x * y + -0.003 * (r2 + 2 * x * x)) + 320.5, 1e-10);
  EXPECT_NEAR(left.y(), 820 * (y * radial + 0.002 * (r2 + 2 * y * y) + 2 * -0.003 * x * y) + 240.25, 1e-10);
  const Eigen::Vector2d right = Project(cameras[1], {0, 0, 1});  // z goes to x
  EXPECT_NEAR(right.x(), 90 * 0.2 * (1 - 0.2 * 0.04) + 50, 1e-10);
  EXPECT_NEAR(right.y(), 40, 1e-10);
}

template <typename... Values>
std::string Bytes(Values... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof(values)), ...);
  return bytes;
}

std::string BinaryCameras(uint64_t count) {
  return Bytes(count, uint32_t{1}, int32_t{6}, uint64_t{640}, uint64_t{480}, 800.0, 820.0, 320.5, 240.25, 0.1, 0.01,
               0.002, -0.003, 0.03, 0.04, 0.05, 0.06) +
         (count > 1 ? Bytes(uint32_t{9}, int32_t{5}, uint64_t{64}, uint64_t{48}, 80., 82., 32., 24., .1, .2, .3, .4)
                    : "");
}
std::string BinaryImages(uint64_t count, uint64_t points = 2) {
  std::string bytes = Bytes(count, uint32_t{5}, 1.0, 0.0, 0.0, 0.0, 0.1, -0.2, 4.0, uint32_t{1}) + "left.jpg" +
                      std::string(1, '\0') + Bytes(points);
  bytes += std::string(48, '\1');
  if (count > 1)
    bytes += Bytes(uint32_t{2}, 1.0, 0., 0., 0., 0., 0., 1., uint32_t{9}) + "b.jpg" + Bytes('\0', uint64_t{0});
  return bytes;
}

TEST(ColmapTest, BinaryProjectsAsItsDocumentationSays) {
  const DistortedCameras cameras = ParseColmapBinary("sparse", BinaryCameras(2), BinaryImages(2));
  ASSERT_EQ(cameras.size(), 2u);
  const double x = 0.1, y = 0.1, r2 = 0.02;
  const double radial =
      (1 + 0.1 * r2 + 0.01 * r2 * r2 + 0.03 * r2 * r2 * r2) / (1 + 0.04 * r2 + 0.05 * r2 * r2 + 0.06 * r2 * r2 * r2);
  EXPECT_NEAR(Project(cameras[0], {0.3, 0.6, 0}).x(),
              800 * (x * radial + 2 * 0.002 * x * y + -0.003 * (r2 + 2 * x * x)) + 320.5, 1e-10);
  EXPECT_EQ(cameras[1].lens.model, Lens::Model::kFisheye);
  const double t = std::atan(1.0);
  EXPECT_NEAR(Project(cameras[1], {1, 0, 0}).x(),
              80 * (t + .1 * std::pow(t, 3) + .2 * std::pow(t, 5) + .3 * std::pow(t, 7) + .4 * std::pow(t, 9)) + 32,
              1e-9);
}

TEST(ColmapTest, WrongFilesAreNamed) {
  const auto text = [](const std::string& cameras, const std::string& images) {
    return ErrorOf([&] { ParseColmapText("m", cameras, images); });
  };
  EXPECT_THAT(text("", kColmapImages), HasSubstr("m/images.txt: image 'cam a/left.jpg' names camera 1"));
  EXPECT_THAT(text(kColmapCameras, ""), HasSubstr("m/images.txt: describes no cameras"));
  EXPECT_THAT(text(Replaced(kColmapCameras, "SIMPLE_RADIAL", "FOV"), ""), HasSubstr("camera model FOV is not read"));
  EXPECT_THAT(text(Replaced(kColmapCameras, "SIMPLE_RADIAL", "SIMPLE_RADIA"), ""), HasSubstr("mean SIMPLE_RADIAL?"));
  EXPECT_THAT(text(Replaced(kColmapCameras, "-0.003", ""), ""), HasSubstr("cameras.txt:2: OPENCV has 8 parameters"));
  EXPECT_THAT(text(Replaced(kColmapCameras, "800", "nan"), ""), HasSubstr("cameras.txt:2: expected a finite number"));
  EXPECT_THAT(text(Replaced(kColmapCameras, "640", "-640"), ""), HasSubstr("pixels; expected 1 to 32768"));
  EXPECT_THAT(text(kColmapCameras, "1 1 0 0 0 0 0 0 1\n"), HasSubstr("images.txt:1: expected IMAGE_ID"));
  EXPECT_THAT(text(kColmapCameras, "1 2 0 0 0 0 0 0 1 a\n"), HasSubstr("quaternion of length 2"));
  const auto binary = [](const std::string& cameras, const std::string& images) {
    return ErrorOf([&] { ParseColmapBinary("m", cameras, images); });
  };
  const uint64_t lie = uint64_t{1} << 60;
  EXPECT_THAT(binary(Bytes(lie), ""), HasSubstr("cameras.bin: says that 1152921504606846976 items follow"));
  EXPECT_THAT(binary(BinaryCameras(1), Bytes(lie) + std::string(100, 'x')), HasSubstr("images.bin: says that"));
  EXPECT_THAT(binary(BinaryCameras(1), BinaryImages(1, lie)), HasSubstr("images.bin: ends in the middle"));
  EXPECT_THAT(binary(BinaryCameras(1), BinaryImages(1, uint64_t{1} << 63)), HasSubstr("ends in the middle"));
  EXPECT_THAT(binary(BinaryCameras(1) + "x", BinaryImages(1)), HasSubstr("1 bytes too many"));
  for (size_t length = 0; length < BinaryImages(2).size(); ++length) {
    EXPECT_NE(binary(BinaryCameras(2), BinaryImages(2).substr(0, length)), "") << length;
  }
  for (size_t length = 0; length < BinaryCameras(2).size(); ++length) {
    EXPECT_NE(binary(BinaryCameras(2).substr(0, length), BinaryImages(2)), "") << length;
  }
}

// As cv::FileStorage writes it.
const std::string kOpenCv =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
    "   dt: d\n   data: [ 800., 0., 320., 0., 820., 240., 0., 0., 1. ]\n"
    "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n"
    "   data: [ 1.0e-01, 1.0e-02, 2.0e-03, -3.0e-03, 4.0e-02 ]\n"
    "rvec: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 1.5707963267948966, 0. ]\n"
    "tvec: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 5. ]\n";

DistortedCameras FromStorage(const std::vector<std::pair<std::string, std::string>>& files, bool fisheye = false) {
  std::vector<StorageFile> parsed;
  for (const auto& [path, bytes] : files) parsed.push_back({path, ParseStorage(path, bytes)});
  return CamerasFromStorage(parsed, fisheye);
}

void ExpectTheCameraOfTheDocumentation(const DistortedCamera& source) {
  EXPECT_EQ(source.camera.width, 640);
  EXPECT_EQ(source.camera.height, 480);
  // z of the world goes to x: 0.2, no y. OpenCV's own pixels are half a pixel less.
  const double x = 0.2, r2 = x * x, radial = 1 + 0.1 * r2 + 0.01 * r2 * r2 + 0.04 * r2 * r2 * r2;
  const Eigen::Vector2d pixel = Project(source, {0, 0, 1});
  EXPECT_NEAR(pixel.x(), 800 * (x * radial + -0.003 * 3 * r2) + 320 + 0.5, 1e-9);
  EXPECT_NEAR(pixel.y(), 820 * 0.002 * r2 + 240 + 0.5, 1e-9);
}

TEST(OpenCvTest, ReadsYamlJsonAndXmlAsItsDocumentationSays) {
  const auto yaml = FromStorage({{"cam_a.yml", kOpenCv}});
  ASSERT_EQ(yaml.size(), 1u);
  EXPECT_EQ(yaml[0].camera.name, "cam_a");
  ExpectTheCameraOfTheDocumentation(yaml[0]);
  // Old versions write no "---".
  ExpectTheCameraOfTheDocumentation(FromStorage({{"a.yml", Replaced(kOpenCv, "---\n", "")}})[0]);
  ExpectTheCameraOfTheDocumentation(FromStorage(
      {{"a.json", R"({"image_size": [640, 480], "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3,
        "dt": "d", "data": [800.0, 0.0, 320.0, 0.0, 820.0, 240.0, 0.0, 0.0, 1.0]},
        "distCoeffs": [0.1, 0.01, 0.002, -0.003, 0.04], "R": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "T": [0, 0, 5]})"}})
                                        [0]);
  ExpectTheCameraOfTheDocumentation(FromStorage({{"a.xml", R"(<?xml version="1.0"?>
<opencv_storage>
<!-- written by a program -->
<image_width>640</image_width> <image_height>480</image_height>
<Camera_Matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
  <data>800. 0. 320. 0. 820. 240.
    0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix"><rows>5</rows><cols>1</cols><dt>d</dt>
  <data>0.1 0.01 0.002 -0.003 0.04</data></Distortion_Coefficients>
<rvec type_id="opencv-matrix"><rows>1</rows><cols>3</cols><dt>d</dt><data>0. 1.5707963267948966 0.</data></rvec>
<tvec type_id="opencv-matrix"><rows>1</rows><cols>3</cols><dt>d</dt><data>0. 0. 5.</data></tvec>
</opencv_storage>)"}})[0]);
}

TEST(OpenCvTest, ReadsPairsOfFilesStereoPairsAndMaps) {
  const std::string k = "[800., 0., 320., 0., 820., 240., 0., 0., 1.]", d = "[0.1, 0.01, 0.002, -0.003, 0.04]";
  const auto apart =
      FromStorage({{"intri.yml", "names: [\"01\", \"02\"]\nimage_width: 640\nimage_height: 480\nK_01: " + k +
                                     "\ndist_01: " + d + "\nK_02: " + k + "\ndist_02: " + d + "\n"},
                   {"extri.yml",
                    "R_01: [0., 1.5707963267948966, 0.]\nT_01: [0, 0, 5]\n"
                    "Rot_02: [0, 0, 1, 0, 1, 0, -1, 0, 0]\nT_02: [0, 0, 5]\n"}});
  ASSERT_EQ(apart.size(), 2u);
  EXPECT_EQ(apart[1].camera.name, "02");
  for (const DistortedCamera& camera : apart) ExpectTheCameraOfTheDocumentation(camera);

  const auto stereo = FromStorage(
      {{"intrinsics.yml", "image_size: [640, 480]\nM1: " + k + "\nD1: " + d + "\nM2: " + k + "\nD2: " + d + "\n"},
       {"extrinsics.yml",
        "R: [0, 0, 1, 0, 1, 0, -1, 0, 0]\nT: [0, 0, 5]\n"
        "R1: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nR2: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
        "P1: [1]\nQ: [1]\n"}});
  ASSERT_EQ(stereo.size(), 2u);
  EXPECT_EQ(stereo[0].camera.cam_from_world.translation.norm(), 0);
  ExpectTheCameraOfTheDocumentation(stereo[1]);

  const auto maps = FromStorage({{"rig.yml", "left: {K: " + k + ", D: " + d +
                                                 ", image_size: [640, 480], rvec: [0, 1.5707963267948966, 0], "
                                                 "tvec: [0, 0, 5]}\n"}});
  EXPECT_EQ(maps[0].camera.name, "left");
  ExpectTheCameraOfTheDocumentation(maps[0]);

  const std::string four = "K: " + k + "\nD: [0.1, 0.2, 0.3, 0.4]\nR: [0, 0, 0]\nT: [0, 0, 1]\n";
  EXPECT_EQ(FromStorage({{"a.yml", four}})[0].lens.model, Lens::Model::kRadialTangential);
  EXPECT_EQ(FromStorage({{"a.yml", four}}, true)[0].lens.model, Lens::Model::kFisheye);
  EXPECT_EQ(FromStorage({{"a.yml", four + "fisheye_model: 1\n"}})[0].lens.model, Lens::Model::kFisheye);
}

TEST(OpenCvTest, WrongFilesAreNamed) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { FromStorage({{"c.yml", text}}); }); };
  EXPECT_THAT(error(""), HasSubstr("c.yml: holds no named values"));
  EXPECT_THAT(error("a: [1"), HasSubstr("is no YAML"));
  EXPECT_THAT(error("a: &x [1, *x]\n"), HasSubstr("c.yml:1: an anchor or alias"));
  std::string bomb = "a0: &a0 [x]\n";
  for (int i = 1; i < 40; ++i) bomb += fmt::format("a{0}: &a{0} [*a{1}, *a{1}, *a{1}]\n", i, i - 1);
  EXPECT_THAT(error(bomb), HasSubstr("an anchor or alias"));
  EXPECT_NE(error(std::string(100000, '[')), "");
  EXPECT_NE(error("a: " + std::string(100000, '{')), "");
  EXPECT_NE(error("- - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - - 1\n"), "");
  EXPECT_THAT(error("a: 1\n"), HasSubstr("describes no cameras"));
  EXPECT_THAT(error(Replaced(kOpenCv, "800.", ".Nan")), HasSubstr("c.yml:9: expected a finite number, found '.Nan'"));
  EXPECT_THAT(error(Replaced(kOpenCv, "800., ", "")), HasSubstr("c.yml:5: a matrix of 9 values with 8 given"));
  EXPECT_THAT(error(Replaced(kOpenCv, "tvec", "other")), HasSubstr("camera 'c' has no pose"));
  EXPECT_THAT(error(Replaced(kOpenCv, "640", "640000")), HasSubstr("an image side of 640000"));
  const std::string twelve = Replaced(Replaced(kOpenCv, "rows: 5", "rows: 12"), "4.0e-02", "0, 0, 0, 0, 1e-3, 0, 0, 0");
  EXPECT_THAT(error(twelve), HasSubstr("thin-prism"));
  EXPECT_THAT(error(Replaced(kOpenCv, "rows: 5\n   cols: 1", "rows: 1\n   cols: 1")), HasSubstr("with 5 given"));
  for (const std::string xml : {"<", "<a", "<a>", "<a></b>", "<a/>", "<opencv_storage>", "<opencv_storage/>", "<?xml",
                                "<!--", "<opencv_storage><a>1 2</a", "<>", "< >", "</a>"}) {
    EXPECT_NE(error(xml), "") << xml;
  }
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_THAT(error(deep), HasSubstr("nested too deeply"));
}

// Bytes of good files are replaced at random: an Error or a result, never anything else.
TEST(CalibrationFormatsTest, DamagedFilesNeverCrash) {
  Random random(5);
  const auto damage = [&](std::string text) {
    for (int64_t i = 0, n = 1 + random.Below(4); i < n; ++i) {
      text[static_cast<size_t>(random.Below(static_cast<int64_t>(text.size())))] = static_cast<char>(random.Below(256));
    }
    return text;
  };
  for (int round = 0; round < 500; ++round) {
    ErrorOf([&] { ParseNerfstudio("t", damage(kNerf)); });
    ErrorOf([&] { ParseColmapText("m", damage(kColmapCameras), kColmapImages); });
    ErrorOf([&] { ParseColmapText("m", kColmapCameras, damage(kColmapImages)); });
    ErrorOf([&] { ParseColmapBinary("m", damage(BinaryCameras(2)), BinaryImages(2)); });
    ErrorOf([&] { ParseColmapBinary("m", BinaryCameras(2), damage(BinaryImages(2))); });
    ErrorOf([&] { FromStorage({{"c.yml", damage(kOpenCv)}}); });
  }
}

TEST(CalibrationFormatsTest, WhatIsWrittenIsReadBack) {
  Random random(6);
  DistortedCameras cameras;
  for (int i = 0; i < 5; ++i) {
    DistortedCamera source;
    source.camera = LookAt({random.Uniform(-900, 900), random.Uniform(-300, 300), 1000}, {10, 20, 30}, {0, 1, 0},
                           1234.5678 + i, 400, 300);
    source.camera.intrinsics(0, 2) += 0.123456789;
    source.camera.name = "cam" + std::to_string(i);
    source.image = "images/" + source.camera.name + ".png";
    cameras.push_back(source);
  }
  const ColmapFiles text = FormatColmapText(cameras, {}), binary = FormatColmapBinary(cameras, {});
  for (const DistortedCameras& back :
       {ParseNerfstudio("t", FormatNerfstudio(cameras, "points.ply")), ParseColmapText("m", text.cameras, text.images),
        ParseColmapBinary("m", binary.cameras, binary.images)}) {
    ASSERT_EQ(back.size(), cameras.size());
    for (size_t i = 0; i < back.size(); ++i) {
      const Camera &read = back[i].camera, &written = cameras[i].camera;
      EXPECT_EQ(read.name, written.name);
      EXPECT_EQ(read.width, 400);
      EXPECT_EQ(read.intrinsics, written.intrinsics);
      EXPECT_TRUE(back[i].lens.IsPinhole());
      EXPECT_LT((read.cam_from_world.rotation - written.cam_from_world.rotation).cwiseAbs().maxCoeff(), 1e-14);
      EXPECT_LT((read.cam_from_world.translation - written.cam_from_world.translation).norm(), 1e-11);
    }
  }
  cameras[0].camera.intrinsics(0, 1) = 0.5;
  EXPECT_THAT(ErrorOf([&] { FormatColmapText(cameras, {}); }), HasSubstr("skew"));
  EXPECT_THAT(ErrorOf([&] { FormatNerfstudio(cameras, ""); }), HasSubstr("skew"));
}

TEST(CalibrationFormatsTest, CamerasAreNamedByTheirImages) {
  const auto names = [](const std::vector<std::string>& images) {
    DistortedCameras cameras(images.size());
    for (size_t i = 0; i < images.size(); ++i) cameras[i].image = images[i];
    NameByImages("t", &cameras);
    std::string joined;
    for (const DistortedCamera& camera : cameras) joined += camera.camera.name + " ";
    return joined;
  };
  EXPECT_EQ(names({"images/a.png", "images/b c.png"}), "a b_c ");
  EXPECT_EQ(names({"a/0001.png", "b/0001.png"}), "a b ");
  EXPECT_EQ(names({"a/1.png", "b/1.png", "a/2.png"}), "a_1 b_1 a_2 ");
  EXPECT_EQ(names({"../../average.png"}), "average_ ");
}

}  // namespace
}  // namespace likeness
