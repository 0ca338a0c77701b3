#include "likeness/simulate/human/target.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

std::string Gzip(const std::string& text) {
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, text.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

TEST(Target, ReadsPlainAndPackedFilesAlike) {
  const ScratchFolder folder;
  const std::string text = "# a comment\n\n3 .5 -1 2e-1\r\n0 0 0 -.25\n";
  WriteFile(folder / "a.target", text);
  WriteFile(folder / "b.target.gz", Gzip(text));
  for (const char* name : {"a.target", "b.target.gz"}) {
    const Target target = ReadTarget(folder / name, 4);
    EXPECT_EQ(target.vertices, (std::vector<int>{3, 0}));
    ASSERT_EQ(target.deltas.size(), 2u);
    EXPECT_EQ(target.deltas[0], Eigen::Vector3f(0.5f, -1, 0.2f));
    EXPECT_EQ(target.deltas[1], Eigen::Vector3f(0, 0, -0.25f));
  }
}

TEST(Target, NamesFileAndLineOfWhatIsWrong) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseTarget("x.target", text, 10); }); };
  EXPECT_EQ(error("1 2 3 4\n1 2 3\n"), "x.target:2: expected 'vertex dx dy dz', found 3 words");
  EXPECT_EQ(error("10 0 0 0\n"), "x.target:1: vertex 10 does not exist; the base mesh has 10");
  EXPECT_EQ(error("-1 0 0 0\n"), "x.target:1: vertex -1 does not exist; the base mesh has 10");
  for (const char* bad : {"1 nan 0 0\n", "1 inf 0 0\n", "1.5 0 0 0\n", "one 0 0 0\n", "1 0 0 1e30\n", "1 0 0 0x\n",
                          "99999999999999999999 0 0 0\n", "1 0 0 0 0\n", "\x01\x02\xff"}) {
    EXPECT_TRUE(error(bad).starts_with("x.target:1: ")) << bad << ": " << error(bad);
  }
  EXPECT_EQ(error(""), "");
}

TEST(Target, DamagedArchivesAreErrorsAndUnpackNoFurtherThanAllowed) {
  const std::string packed = Gzip("1 2 3 4\n");
  const auto error = [](std::string_view bytes, size_t most) { return ErrorOf([&] { Gunzip("x.gz", bytes, most); }); };
  EXPECT_EQ(error(packed, 8), "");
  for (size_t length = 0; length < packed.size(); ++length) {
    EXPECT_EQ(error(packed.substr(0, length), 1000), "x.gz: is no whole gzip file (cut off or damaged)") << length;
  }
  EXPECT_EQ(error("1 2 3 4\n", 1000), "x.gz: is no whole gzip file (cut off or damaged)");
  std::string flipped = packed;
  flipped[packed.size() - 6] ^= 1;  // in the checksum
  EXPECT_NE(error(flipped, 1000), "");
  // A bomb: 50 MB of blanks in 50 KB.
  std::string blanks;
  blanks.resize(50'000'000, ' ');
  EXPECT_EQ(error(Gzip(blanks), 1'000'000), "x.gz: unpacks to more than 1000000 bytes");
}

}  // namespace
}  // namespace likeness
