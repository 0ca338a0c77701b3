// The verbs `convert` and `inspect` as a user runs them, on captures and on single meshes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "likeness/app/command.h"
#include "likeness/app/mesh_file.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Exit status and stdout of a verb.
std::pair<int, std::string> RunVerb(Verb verb, const std::vector<std::string>& arguments) {
  std::vector<const char*> argv = {"verb"};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  ::testing::internal::CaptureStdout();
  int status = 0;
  try {
    status = verb(static_cast<int>(argv.size()), argv.data());
  } catch (...) {
    ::testing::internal::GetCapturedStdout();
    throw;
  }
  return {status, ::testing::internal::GetCapturedStdout()};
}

class FormatVerbsTest : public ::testing::Test {
 protected:
  FormatVerbsTest() {
    topology_.vertex_count = 4;
    topology_.uvs = {{0, 0}, {1, 0}, {0, 1}};
    topology_.triangles = {{0, 1, 2}, {0, 2, 3}};
    topology_.triangle_uvs = {{0, 1, 2}, {0, 1, 2}};
    vertices_.resize(4, 3);
    vertices_ << -50, -50, 0, 50, -50, 0, 50, 50, 10, -50, 50, 0;
    WriteObj(scratch_ / "mesh.obj", vertices_, topology_);
    WriteFloats(scratch_ / "mesh.bin", {vertices_.data(), 12});
    WriteFile(scratch_ / "mesh.ply", EncodePly(vertices_, topology_.triangles));
    WritePng(scratch_ / "texture.png", ImageU8(8, 8, 3, 200));
  }

  // Two frames of two cameras.
  fs::path WriteCapture() const {
    const fs::path root = scratch_ / "capture";
    const CaptureWriter writer(root);
    std::vector<Camera> cameras = {LookAt({0, 0, 900}, {0, 0, 0}, {0, 1, 0}, 200, 40, 60),
                                   LookAt({300, 0, 900}, {0, 0, 0}, {0, 1, 0}, 200, 40, 60)};
    cameras[0].name = "one", cameras[1].name = "two";
    const std::vector<FrameId> frames = {{"E1", "000001"}, {"E1", "000002"}};
    writer.WriteCalibration(cameras);
    writer.WriteFrameList(frames);
    for (const FrameId& frame : frames) {
      writer.WriteTracked(frame, {vertices_, {}});
      writer.WriteObj(frame, vertices_, topology_);
      for (const Camera& camera : cameras) writer.WriteImage(frame, camera.name, ImageU8(40, 60, 3, 90));
    }
    return root;
  }

  std::string Path(const std::string& name) const { return (scratch_ / name).string(); }
  std::string InspectError(const std::vector<std::string>& arguments) const {
    return ErrorOf([&] { RunVerb(RunInspect, arguments); });
  }

  ScratchFolder scratch_;
  MeshTopology topology_;
  Vertices vertices_;
};

TEST_F(FormatVerbsTest, ConvertsAPartAndRecordsHow) {
  const std::string source = WriteCapture().string();
  const auto [status, text] =
      RunVerb(RunConvert, {source, Path("out"), "--cameras", "two", "--width", "20", "--json", "--quiet"});
  EXPECT_EQ(status, 0);
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["cameras"], 1);
  EXPECT_EQ(json["images_encoded"], 2);
  EXPECT_THAT(ReadFile(scratch_ / "out" / "convert.toml"),
              AllOf(HasSubstr("cameras = \"two\""), HasSubstr("width = 20")));
  EXPECT_EQ(OpenCapture(scratch_ / "out")->cameras()[0].width, 20);
  WriteFile(scratch_ / "capture/images/E1/one/000002.png", "damaged");
  EXPECT_EQ(RunVerb(RunConvert, {source, Path("damaged"), "--quiet"}).first, 1);
  EXPECT_THROW(RunVerb(RunConvert, {source, Path("out"), "--camera", "two"}), UsageError);
}

TEST_F(FormatVerbsTest, InspectDrawsACaptureAndEveryKindOfMesh) {
  const std::string source = WriteCapture().string();
  EXPECT_THAT(RunVerb(RunInspect, {source, "--sheet", Path("capture.png")}).second, HasSubstr("Multiface"));
  const ImageU8 with_views = ReadImage(scratch_ / "capture.png");
  RunVerb(RunInspect, {source, "--sheet", Path("capture.png"), "--no-views"});
  EXPECT_GT(with_views.height(), ReadImage(scratch_ / "capture.png").height() + 400);

  for (const std::vector<std::string>& mesh : {std::vector<std::string>{Path("mesh.obj")},
                                               {Path("mesh.ply")},
                                               {Path("mesh.bin"), "--topology", Path("mesh.obj")}}) {
    std::vector<std::string> arguments = mesh;
    arguments.insert(arguments.end(), {"--sheet", Path("sheet.png"), "--json"});
    const auto json = nlohmann::json::parse(RunVerb(RunInspect, arguments).second);
    EXPECT_EQ(json["vertices"], 4);
    EXPECT_EQ(json["triangles"], 2);
    EXPECT_GT(ReadImage(scratch_ / "sheet.png").width(), 1000);
  }
  RunVerb(RunInspect, {Path("mesh.bin"), "--topology", Path("mesh.obj"), "--texture", Path("texture.png"), "--sheet",
                       Path("textured.png")});
  EXPECT_GT(ReadImage(scratch_ / "textured.png").width(), 1500);
}

TEST_F(FormatVerbsTest, WrongMeshesAreNamed) {
  EXPECT_THAT(InspectError({Path("mesh.bin")}), AllOf(HasSubstr("mesh.bin: has no faces"), HasSubstr("--topology")));
  EXPECT_THAT(InspectError({Path("mesh.ply"), "--texture", Path("texture.png"), "--sheet", Path("s.png")}),
              AllOf(HasSubstr("needs texture coordinates"), HasSubstr("mesh.ply")));
  WriteFloats(scratch_ / "odd.bin", std::vector<float>(7));
  EXPECT_THAT(InspectError({Path("odd.bin")}), HasSubstr("holds 7 float32 values"));
  WriteFloats(scratch_ / "five.bin", std::vector<float>(15));
  EXPECT_THAT(InspectError({Path("five.bin"), "--topology", Path("mesh.obj")}), HasSubstr("is for 4 vertices"));
  WriteCapture();
  EXPECT_THROW(RunVerb(RunInspect, {Path("capture"), "--texture", Path("texture.png")}), UsageError);
}

}  // namespace
}  // namespace likeness
