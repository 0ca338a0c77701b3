// The text files of the Multiface layout, right and wrong.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/condition_file.h"
#include "likeness/capture/split_file.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kCamera =
    "400069\n7724.681 0.0 797.0469\n0.0 7724.834 924.32745\n0.0 0.0 1.0\n0.0 0.0 0.0 0.0 0.0\n"
    "0.9705157 0.035186626 0.2384557 -270.26154\n-0.1084007 0.9473142 0.30140525 -291.6677\n"
    "-0.21528703 -0.3183673 0.92319757 121.37361\n\n";

// kCamera with one piece of text replaced.
std::string With(const std::string& from, const std::string& to) {
  std::string text = kCamera;
  return text.replace(text.find(from), from.size(), to);
}

std::string CalibrationError(const std::string& text) {
  return ErrorOf([&] { ParseCalibration("KRT", text); });
}

TEST(CalibrationTest, ReadsThePublishedForm) {
  const auto cameras = ParseCalibration("KRT", kCamera + With("400069", "400070"));
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].name, "400069");
  EXPECT_EQ(cameras[1].name, "400070");
  EXPECT_EQ(cameras[0].intrinsics(0, 2), 797.0469);
  EXPECT_EQ(cameras[0].intrinsics(1, 1), 7724.834);
  EXPECT_EQ(cameras[0].cam_from_world.rotation(2, 0), -0.21528703);
  EXPECT_EQ(cameras[0].cam_from_world.translation.y(), -291.6677);
  EXPECT_EQ(cameras[0].width, 0);
}

TEST(CalibrationTest, ReadsSizesWindowsLinesAndNoLastEmptyLine) {
  EXPECT_EQ(ParseCalibration("KRT", With("400069", "400069 1334 2048"))[0].width, 1334);
  EXPECT_EQ(ParseCalibration("KRT", With("400069", "400069 1334 2048"))[0].height, 2048);
  std::string windows = "\xef\xbb\xbf";
  for (const char c : kCamera) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(ParseCalibration("KRT", windows)[0].name, "400069");
  EXPECT_EQ(ParseCalibration("KRT", kCamera.substr(0, kCamera.size() - 2)).size(), 1u);
}

TEST(CalibrationTest, ReadsThePublishedSample) {
  const auto path = SampleData("ava256/KRT");
  if (!path) GTEST_SKIP() << "sample data absent";
  const auto cameras = ParseCalibration(*path, ReadFile(*path));
  ASSERT_EQ(cameras.size(), 38u);
  // A dome that looks inwards: all optical axes pass near one point, about a metre from each camera.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const auto across = [](const Camera& camera) -> Eigen::Matrix3d {
    const Eigen::Vector3d axis = camera.cam_from_world.rotation.row(2);
    return Eigen::Matrix3d::Identity() - axis * axis.transpose();
  };
  for (const Camera& camera : cameras) {
    normal += across(camera);
    right += across(camera) * camera.CentreInWorld();
  }
  const Eigen::Vector3d focus = normal.ldlt().solve(right);
  for (const Camera& camera : cameras) {
    const Eigen::Vector3d offset = focus - camera.CentreInWorld();
    EXPECT_LT((across(camera) * offset).norm(), 150) << camera.name;
    EXPECT_GT(camera.cam_from_world.rotation.row(2).dot(offset), 700) << camera.name;
    EXPECT_LT(camera.cam_from_world.rotation.row(2).dot(offset), 1500) << camera.name;
  }
}

TEST(CalibrationTest, WrongFilesAreNamedWithTheirLine) {
  EXPECT_THAT(CalibrationError(""), HasSubstr("KRT: describes no cameras"));
  EXPECT_THAT(CalibrationError("\n\n"), HasSubstr("describes no cameras"));
  EXPECT_THAT(CalibrationError(kCamera + kCamera), HasSubstr("KRT:10: camera 400069 is described twice"));
  EXPECT_THAT(CalibrationError(With("400069", "400069 1334")), HasSubstr("KRT:1: expected a camera's name"));
  EXPECT_THAT(CalibrationError(With("400069", "400069 1334 -1")), HasSubstr("KRT:1: an image side of -1"));
  EXPECT_THAT(CalibrationError(With("400069", "400069 1334 99999999")), HasSubstr("KRT:1: an image side"));
  EXPECT_THAT(CalibrationError(With("400069", "../400069")), HasSubstr("KRT:1: a camera cannot have this name"));
  EXPECT_THAT(CalibrationError(With("7724.681", "nan")), HasSubstr("KRT:2: expected a finite number"));
  EXPECT_THAT(CalibrationError(With("7724.681", "-7724.681")), HasSubstr("KRT:4: focal lengths of -7724.68"));
  EXPECT_THAT(CalibrationError(With("7724.681", "1e300")), HasSubstr("KRT:4: focal lengths"));
  EXPECT_THAT(CalibrationError(With("7724.681 0.0", "7724.681")), HasSubstr("KRT:2: expected 3 numbers, found 2"));
  EXPECT_THAT(CalibrationError(With("0.0 0.0 0.0 0.0 0.0", "0.1 0 0 0 0")), HasSubstr("KRT:5: camera 400069 has lens"));
  EXPECT_THAT(CalibrationError(With("0.0 0.0 0.0 0.0 0.0", "0 0 0 0")), HasSubstr("KRT:5: expected 5 numbers"));
  EXPECT_THAT(CalibrationError(With("0.9705157 ", "0.8 ")),
              HasSubstr("KRT:8: the three lines up to here are no rigid"));
  EXPECT_THAT(CalibrationError(With("0.9705157 ", "1e200 ")), HasSubstr("KRT:8:"));
  EXPECT_THAT(CalibrationError(With("-270.26154", "1e12")), HasSubstr("KRT:8: a translation"));
  EXPECT_THAT(CalibrationError("c\n700 0 0\n0 700 0\n300 200 1\n0 0 0 0 0\n"), HasSubstr("KRT:4: K is transposed"));
  std::string mirrored = kCamera;
  mirrored.replace(mirrored.find("-0.21528703 -0.3183673 0.92"), 27, "0.21528703 0.3183673 -0.92");
  EXPECT_THAT(CalibrationError(mirrored), HasSubstr("R mirrors"));
}

TEST(CalibrationTest, EveryTruncationIsAnErrorOrWhole) {
  for (size_t length = 0; length < kCamera.size(); ++length) {
    const std::string text = kCamera.substr(0, length);
    try {
      // A last number may lose digits without anyone knowing; a line or a number too few is told.
      EXPECT_EQ(ParseCalibration("KRT", text).size(), 1u);
      EXPECT_GE(length, kCamera.find("121")) << text;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), StartsWith("KRT"));
    }
  }
}

TEST(TransformTest, ReadsThreeRowsOfFour) {
  const RigidTransform transform = ParseTransform("t", "0 -1 0 10\n1 0 0 20\n0 0 1 30.5\n\n");
  EXPECT_EQ(transform.rotation(0, 1), -1);
  EXPECT_EQ(transform.translation, Eigen::Vector3d(10, 20, 30.5));
}

TEST(TransformTest, WrongFilesAreNamedWithTheirLine) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseTransform("t.txt", text); }); };
  EXPECT_THAT(error(""), HasSubstr("the file ends here"));
  EXPECT_THAT(error("1 0 0 0\n0 1 0 0\n"), HasSubstr("t.txt:2: the file ends here"));
  EXPECT_THAT(error("1 0 0\n0 1 0\n0 0 1\n"), HasSubstr("t.txt:1: expected 4 numbers, found 3"));
  EXPECT_THAT(error("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"), HasSubstr("t.txt:4: expected three lines"));
  EXPECT_THAT(error("10 0 0 0\n0 10 0 0\n0 0 10 0\n"), HasSubstr("differs from a rotation by"));
  EXPECT_THAT(error("1 0 0 0\n0 1 0 0\n0 0 -1 0\n"), HasSubstr("mirrors"));
  EXPECT_THAT(error("1 0 0 inf\n0 1 0 0\n0 0 1 0\n"), HasSubstr("t.txt:1: expected a finite number, found 'inf'"));
  EXPECT_THAT(error("1 0 0 0\n0 1 0 0\n0 0 1 0x10\n"), HasSubstr("t.txt:3:"));
  EXPECT_THAT(error(std::string(100, '\0')), HasSubstr("t.txt:1:"));
}

TEST(FrameListTest, ReadsSegmentsAndFrames) {
  EXPECT_THAT(ParseFrameList("f", "E1 000001\nE1 000019\n\nE2 000001"),
              ElementsAre(FrameId{"E1", "000001"}, FrameId{"E1", "000019"}, FrameId{"E2", "000001"}));
}

TEST(FrameListTest, WrongFilesAreNamedWithTheirLine) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseFrameList("f.txt", text); }); };
  EXPECT_THAT(error(""), HasSubstr("f.txt: lists no frames"));
  EXPECT_THAT(error("E1 1\nE1\n"), HasSubstr("f.txt:2: expected a segment and a frame"));
  EXPECT_THAT(error("E1 1 2\n"), HasSubstr("f.txt:1: expected a segment and a frame"));
  EXPECT_THAT(error("../../etc 1\n"), HasSubstr("f.txt:1: a segment or frame cannot have this name"));
  EXPECT_THAT(error("E1 ..\n"), HasSubstr("f.txt:1:"));
  EXPECT_THAT(error("E\xc3\xa9 1\n"), HasSubstr("f.txt:1:"));
}

TEST(ConditionTableTest, ReadsAValueForEveryColumn) {
  const ConditionTable table =
      ParseConditionTable("gaze.csv", "segment,frame,x,y\r\nEXP_ROM,000123, 0.5,-2e-1\n\nSEN,7,1,2\n");
  EXPECT_THAT(table.columns, ElementsAre("x", "y"));
  ASSERT_EQ(table.frames.size(), 2u);
  EXPECT_THAT(table.frames.at({"EXP_ROM", "000123"}), ElementsAre(0.5f, -0.2f));
  EXPECT_EQ(ParseConditionTable("gaze.csv", ConditionTableText(table)), table);
}

TEST(ConditionTableTest, WrongFilesAreNamedWithTheirLine) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseConditionTable("gaze.csv", text); }); };
  EXPECT_THAT(error(""), HasSubstr("gaze.csv: is empty"));
  EXPECT_THAT(error("frame,segment,x\n"), StartsWith("gaze.csv:1: expected a header"));
  EXPECT_THAT(error("segment,frame\n"), StartsWith("gaze.csv:1: expected a header"));
  EXPECT_THAT(error("segment,frame,\n"), HasSubstr("needs a name"));
  EXPECT_THAT(error("segment,frame,x\na,1,2,3\n"), StartsWith("gaze.csv:2: has 4 fields, its header 3"));
  EXPECT_THAT(error("segment,frame,x\na,1,nan\n"), StartsWith("gaze.csv:2:"));
  EXPECT_THAT(error("segment,frame,x\na,1,1e99\n"), StartsWith("gaze.csv:2:"));
  EXPECT_THAT(error("segment,frame,x\na/b,1,1\n"), StartsWith("gaze.csv:2:"));
  EXPECT_THAT(error("segment,frame,x\na,1,1\na,1,2\n"), HasSubstr("gaze.csv:3: frame a 1 has a line already"));
}

TEST(ConditionTableTest, AbsentFilesAndFramesAreNamed) {
  const ScratchFolder folder;
  EXPECT_THAT(ErrorOf([&] { ConditionFile(folder.path(), "gaze"); }), HasSubstr("conditions/gaze.csv: is absent"));
  WriteFile(folder / "conditions/gaze.csv", "segment,frame,x\na,1,1\n");
  const ConditionFile file(folder.path(), "gaze");
  EXPECT_EQ(file.size(), 1);
  EXPECT_THAT(file.Of({"a", "1"}), ElementsAre(1));
  EXPECT_THAT(ErrorOf([&] { file.Of({"a", "2"}); }), HasSubstr("gaze.csv: has no line for frame a 2"));
}

TEST(SplitFileTest, ReadsPublishedForms) {
  const SplitNames both = ParseSplit(
      "s", R"({"full": {"train": ["a", "b"], "test": ["c"], "visual": ["a"]}, "segment": ["EXP_ROM"], "more": 1})");
  EXPECT_THAT(both.train, ElementsAre("a", "b"));
  EXPECT_THAT(both.test, ElementsAre("c"));
  EXPECT_THAT(both.segments, ElementsAre("EXP_ROM"));
  EXPECT_FALSE(ParseSplit("s", R"({"segment": []})").has_cameras);
  EXPECT_FALSE(ParseSplit("s", R"({"full": {"train": [], "test": []}})").has_segments);
}

TEST(SplitFileTest, WrongFilesAreNamed) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseSplit("s.json", text); }); };
  EXPECT_THAT(error(""), HasSubstr("s.json: is no JSON"));
  EXPECT_THAT(error("{\"full\": "), HasSubstr("is no JSON"));
  EXPECT_THAT(error("\"\xff\""), HasSubstr("is no JSON"));
  EXPECT_THAT(error("[]"), HasSubstr("expected a JSON object"));
  EXPECT_THAT(error("{}"), HasSubstr("is no split"));
  EXPECT_THAT(error(R"({"full": 3})"), HasSubstr("expected \"train\""));
  EXPECT_THAT(error(R"({"full": {"train": ["a"]}})"), HasSubstr("expected \"test\""));
  EXPECT_THAT(error(R"({"full": {"train": [1], "test": []}})"), HasSubstr("list of names in quotes"));
  EXPECT_THAT(error(R"({"segment": [""]})"), HasSubstr("list of names in quotes"));
  EXPECT_THAT(error(R"({"segment": "EXP"})"), HasSubstr("expected \"segment\""));
  EXPECT_NE(error(std::string(100000, '[')), "");
}

// Bytes of good files are replaced at random: an Error or a result, never anything else.
TEST(ParsersTest, DamagedFilesNeverCrash) {
  const std::string split = R"({"full": {"train": ["a", "b"], "test": ["c"]}, "segment": ["EXP_ROM"]})";
  const std::string transform = "0 -1 0 10\n1 0 0 20\n0 0 1 30.5\n", list = "E1 000001\nE1 000019\n";
  Random random(7);
  for (int round = 0; round < 2000; ++round) {
    const auto damage = [&](std::string text) {
      for (int64_t i = 0, n = 1 + random.Below(4); i < n; ++i) {
        text[static_cast<size_t>(random.Below(static_cast<int64_t>(text.size())))] =
            static_cast<char>(random.Below(256));
      }
      return text;
    };
    ErrorOf([&] { ParseCalibration("KRT", damage(kCamera)); });
    ErrorOf([&] { ParseTransform("t", damage(transform)); });
    ErrorOf([&] { ParseFrameList("f", damage(list)); });
    ErrorOf([&] { ParseSplit("s", damage(split)); });
  }
}

TEST(SampleTest, MeshAndTextureOfThePublishedSample) {
  const auto folder = SampleData("ava256");
  if (!folder) GTEST_SKIP() << "sample data absent";
  const std::filesystem::path obj = *folder / "face_topology.obj";
  const MeshTopology topology = TopologyFromObj(ReadObj(obj), obj.string());
  topology.Check(obj.string());
  EXPECT_EQ(topology.vertex_count, 7306);
  EXPECT_EQ(topology.uvs.size(), 5779u);
  EXPECT_EQ(topology.triangles.size(), 11432u);
  EXPECT_EQ(ReadFloats(*folder / "021924.bin", 21918).size(), 21918u);
  const ImageU8 texture = ReadImage(*folder / "021924_avgtex.png");
  EXPECT_EQ(texture.width(), 1024);
  EXPECT_EQ(texture.height(), 1024);
}

}  // namespace
}  // namespace likeness
