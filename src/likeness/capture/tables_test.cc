// What is known of frames besides images and meshes: when they were taken, and expression coefficients.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"
#include "likeness/capture/coefficient_table.h"
#include "likeness/capture/frame_times.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

TEST(FrameTimesTest, CountAsNumbersDo) {
  const std::vector<FrameId> frames = {{"a", "000007"}, {"a", "000008"}, {"a", "000012"}, {"b", "000003"},
                                       {"b", "x"},      {"b", "000002"}, {"b", "000001"}};
  EXPECT_THAT(FrameTimes(frames, 10), ElementsAre(0, 0.1, 0.5, 0.6, 0.7, 0.8, 0.9));
  EXPECT_THAT(FrameTimes({}, 10), ElementsAre());
  for (const double rate : {0.0, -1.0, 1e9, 0.0 / 0.0}) {
    EXPECT_THAT(ErrorOf([&] { FrameTimes(frames, rate); }), HasSubstr("frames a second")) << rate;
  }
}

TEST(CoefficientTableTest, PicksColumnsByName) {
  const std::vector<std::string> names = {"jawOpen", "browDownLeft"};
  const auto parse = [&](const std::string& text) { return ParseCoefficientTable("c.csv", text, names); };
  EXPECT_THAT(parse("segment,frame,time_s,browDownLeft,jawOpen\nEXP,000003,9.5,0.25,1\nEXP,000001,x,0,0.5\n"),
              ElementsAre(Pair(FrameId{"EXP", "000001"}, ElementsAre(0.5f, 0)),
                          Pair(FrameId{"EXP", "000003"}, ElementsAre(1, 0.25f))));
  const auto error = [&](const std::string& text) { return ErrorOf([&] { parse(text); }); };
  const std::string header = "segment,frame,jawOpen,browDownLeft\n";
  EXPECT_EQ(error(header), "");
  EXPECT_THAT(error(""), HasSubstr("empty"));
  EXPECT_THAT(error("segment,frame,jawOpen\n"), HasSubstr("c.csv:1: column browDownLeft is missing"));
  EXPECT_THAT(error("frame,jawOpen,browDownLeft\n"), HasSubstr("column segment is missing"));
  EXPECT_THAT(error("segment,frame,jawOpen,browDownLeft,jawOpen\n"), HasSubstr("jawOpen stands there twice"));
  EXPECT_THAT(error(header + "a,1,0.5\n"), HasSubstr("c.csv:2: expected 4 fields, found 3"));
  EXPECT_THAT(error(header + "a,1,0.5,1.5\n"), HasSubstr("browDownLeft is 1.5, expected 0 to 1"));
  EXPECT_THAT(error(header + "a,1,0.5,nan\n"), HasSubstr("c.csv:2"));
  EXPECT_THAT(error(header + "a,1,0,0\na,1,0,0\n"), HasSubstr("c.csv:3: frame a 1 stands there twice"));
}

}  // namespace
}  // namespace likeness
