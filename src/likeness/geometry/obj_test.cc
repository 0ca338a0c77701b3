#include "likeness/geometry/obj.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kQuad =
    "# comment\no thing\nv 0 0 0\nv 1 0 0 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0 0\nvt 1 1\n"
    "vt 0 1\ng left\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng right\ns off\nf -4/-4 -3/-3 -2/-2\n";

TEST(ObjTest, ReadsPolygonsGroupsAndRelativeIndices) {
  const ObjFile obj = ParseObj("q.obj", kQuad);
  EXPECT_EQ(obj.vertices.rows(), 4);
  EXPECT_THAT(obj.groups, ElementsAre("thing", "left", "right"));
  ASSERT_EQ(obj.polygons.size(), 2u);
  EXPECT_THAT(obj.polygons[0].vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(obj.polygons[1].uvs, ElementsAre(0, 1, 2));
  EXPECT_EQ(obj.polygons[1].group, 2);
  EXPECT_EQ(TopologyFromObj(obj, "q").triangles.size(), 3u);
}

TEST(ObjTest, WritesWhatItReads) {
  const ScratchFolder scratch;
  const ObjFile obj = ParseObj("q.obj", kQuad);
  const MeshTopology topology = TopologyFromObj(obj, "q");
  WriteObj(scratch / "out.obj", obj.vertices, topology);
  const ObjFile again = ReadObj(scratch / "out.obj");
  EXPECT_EQ(again.vertices, obj.vertices);
  EXPECT_EQ(again.uvs, obj.uvs);
  EXPECT_EQ(TopologyFromObj(again, "q").triangles, topology.triangles);
}

TEST(ObjTest, BadInputGivesAnErrorWithTheLine) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseObj("b.obj", text); }); };
  EXPECT_THAT(error(""), HasSubstr("b.obj: holds no vertices"));
  EXPECT_THAT(error("v 1 2\n"), HasSubstr("b.obj:1: a vertex needs three numbers"));
  EXPECT_THAT(error("v 1 2 nan\n"), HasSubstr("b.obj:1: expected a finite number"));
  EXPECT_THAT(error("v 1 2 1e300\n"), HasSubstr("b.obj:1: the number '1e300' is too large"));
  EXPECT_THAT(error("v 1 2 3\nf 1 2 3\n"), HasSubstr("b.obj:2: vertex 2 does not exist"));
  EXPECT_THAT(error("v 1 2 3\nf 1 1 -2\n"), HasSubstr("vertex -2 does not exist"));
  EXPECT_THAT(error("v 1 2 3\nf 0 1 1\n"), HasSubstr("vertex 0 does not exist"));
  EXPECT_THAT(error("v 1 2 3\nf 99999999999999999999 1 1\n"), HasSubstr("expected a whole number"));
  EXPECT_THAT(error("v 1 2 3\nf 1 1\n"), HasSubstr("at least three corners"));
  EXPECT_THAT(error("v 1 2 3\nvt 0 0\nf 1/1 1 1\n"), HasSubstr("some corners"));
  EXPECT_THAT(error(std::string(1000, '\xff')), HasSubstr("holds no vertices"));
}

TEST(ObjTest, CutAndScrambledFilesNeverCrash) {
  const std::string good = kQuad;
  Random random(11);
  for (int i = 0; i < 2000; ++i) {
    std::string text = good.substr(0, random.Below(static_cast<int64_t>(good.size()) + 1));
    for (int64_t n = random.Below(4); n > 0 && !text.empty(); --n) {
      text[random.Below(static_cast<int64_t>(text.size()))] = static_cast<char>(random.Below(256));
    }
    ErrorOf([&] { ParseObj("s.obj", text); });
  }
}

TEST(ObjTest, PublishedTopologyHasFewerUvsThanVertices) {
  const auto sample = SampleData("ava256/face_topology.obj");
  if (!sample) GTEST_SKIP() << "sample data absent";
  const MeshTopology topology = TopologyFromObj(ReadObj(*sample), "sample");
  EXPECT_EQ(topology.vertex_count, 7306);
  EXPECT_EQ(topology.uvs.size(), 5779u);
  EXPECT_EQ(topology.triangles.size(), 11432u);
  topology.Check("sample");
}

}  // namespace
}  // namespace likeness
