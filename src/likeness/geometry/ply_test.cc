#include "likeness/geometry/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Vertices SomeVertices() {
  Vertices vertices(4, 3);
  vertices << 0, 1.5f, -2, 1e-7f, 123456.7f, 3, 7, 8, 9, -0.1f, -0.2f, -0.3f;
  return vertices;
}
const std::vector<Eigen::Vector3i> kTriangles = {{0, 1, 2}, {2, 1, 3}};

std::string PlyError(const std::string& bytes) {
  return ErrorOf([&] { ParsePly("m.ply", bytes); });
}

TEST(PlyTest, WhatIsWrittenIsReadBackInEveryEncoding) {
  for (const PlyEncoding encoding : {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian}) {
    const PlyFile read = ParsePly("m.ply", EncodePly(SomeVertices(), kTriangles, encoding));
    EXPECT_EQ(read.vertices, SomeVertices());
    EXPECT_EQ(read.triangles, kTriangles);
    EXPECT_THAT(ParsePly("m.ply", EncodePly(SomeVertices(), {}, encoding)).triangles, IsEmpty());
  }
}

// Spelled out byte for byte, so that reader and writer cannot be wrong together.
TEST(PlyTest, ReadsOtherPeoplesFiles) {
  const PlyFile ascii =
      ParsePly("a.ply",
               "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 4\r\nproperty double x\r\nproperty "
               "float nx\r\n"
               "property float y\r\nproperty float z\r\nelement face 1\r\nproperty uchar red\r\n"
               "property list uchar uint vertex_index\r\nelement edge 1\r\nproperty int a\r\nend_header\r\n"
               "1 9 2 3\r\n4 9 5 6\r\n7 9 8 9\r\n10 9 11 12\r\n200 4 0 1 2 3\r\n5");
  EXPECT_THAT(std::vector<float>(ascii.vertices.data(), ascii.vertices.data() + 12),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
  EXPECT_THAT(ascii.triangles, ElementsAre(Eigen::Vector3i(0, 1, 2), Eigen::Vector3i(0, 2, 3)));

  const std::string header =
      "element vertex 1\nproperty short x\nproperty uchar quality\nproperty float y\n"
      "property double z\nend_header\n";
  const std::string little = "ply\nformat binary_little_endian 1.0\n" + header +
                             std::string("\xfe\xff\x07\x00\x00\xc0\x3f\x00\x00\x00\x00\x00\x00\x04\x40", 15);
  const std::string big = "ply\nformat binary_big_endian 1.0\n" + header +
                          std::string("\xff\xfe\x07\x3f\xc0\x00\x00\x40\x04\x00\x00\x00\x00\x00\x00", 15);
  for (const std::string& bytes : {little, big}) {
    const Vertices vertices = ParsePly("b.ply", bytes).vertices;
    EXPECT_EQ(vertices(0, 0), -2);
    EXPECT_EQ(vertices(0, 1), 1.5f);
    EXPECT_EQ(vertices(0, 2), 2.5f);
  }
}

TEST(PlyTest, WrongFilesAreNamed) {
  const std::string start = "ply\nformat ascii 1.0\n", xyz = "property float x\nproperty float y\nproperty float z\n";
  EXPECT_THAT(PlyError(""), HasSubstr("m.ply: is no PLY"));
  EXPECT_THAT(PlyError("v 0 0 0\n"), HasSubstr("is no PLY"));
  EXPECT_THAT(PlyError("ply\nelement vertex 1\n" + xyz + "end_header\n0 0 0\n"), HasSubstr("no line 'format'"));
  EXPECT_THAT(PlyError("ply\nformat utf16 1.0\nend_header\n"), HasSubstr("m.ply:2: expected 'format ascii'"));
  EXPECT_THAT(PlyError(start + "end_header\n"), HasSubstr("holds no vertices"));
  EXPECT_THAT(PlyError(start + "element vertex 1\nproperty quat x\nend_header\n0\n"), HasSubstr("m.ply:4: a property"));
  EXPECT_THAT(PlyError(start + "element vertex 1\nproperty float x\nend_header\n0\n"), HasSubstr("x, y and z"));
  EXPECT_THAT(PlyError(start + "element vertex -1\n" + xyz + "end_header\n"), HasSubstr("less than 0"));
  EXPECT_THAT(PlyError(start + "element vertex 99999999999\n" + xyz + "end_header\n0 0 0\n"), HasSubstr("claims 9999"));
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + "end_header\n0 nan 0\n"), HasSubstr("is not finite"));
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + "end_header\n0 1e300 0\n"), HasSubstr("is not finite"));
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + "end_header\n0 one 0\n"), HasSubstr("a word"));
  const std::string faces = "element face 1\nproperty list char int vertex_indices\nend_header\n0 0 0\n";
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + faces + "3 0 0 1\n"), HasSubstr("refers to vertex 1"));
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + faces + "3 0 0 -1\n"), HasSubstr("does not exist"));
  EXPECT_THAT(PlyError(start + "element vertex 1\n" + xyz + faces + "100 0 0 0\n"), HasSubstr("longer than the file"));
  EXPECT_THAT(PlyError(start + "element nothing 5\nelement vertex 1\n" + xyz + faces), HasSubstr("claims 5"));
}

TEST(PlyTest, DamagedFilesAreErrorsOrMeshes) {
  Random random(3);
  for (const PlyEncoding encoding : {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian}) {
    const std::string good = EncodePly(SomeVertices(), kTriangles, encoding);
    for (size_t length = 0; length + 2 < good.size(); ++length) EXPECT_NE(PlyError(good.substr(0, length)), "");
    for (int round = 0; round < 2000; ++round) {
      std::string bytes = good;
      for (int64_t i = 0, n = 1 + random.Below(4); i < n; ++i) {
        bytes[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] =
            static_cast<char>(random.Below(256));
      }
      PlyError(bytes);
    }
  }
}

}  // namespace
}  // namespace likeness
