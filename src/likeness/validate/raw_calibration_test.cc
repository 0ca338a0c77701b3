// Files that ParseCalibration refuses are read as far as they go.

#include "likeness/validate/raw_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

const std::string kCamera = "cam0 640 480\n100 0 0\n0 100 0\n50 40 1\n0.1 0 0 0 0\n2 0 0 5\n0 2 0 6\n0 0 -2 7\n\n";

TEST(RawCalibrationTest, ReadsWhatIsNoCalibration) {
  const RawCalibration raw = ParseRawCalibration("KRT", kCamera + kCamera);
  ASSERT_EQ(raw.cameras.size(), 2u);
  EXPECT_EQ(raw.problem, "");
  EXPECT_EQ(raw.cameras[0].intrinsics(2, 0), 50);
  EXPECT_EQ(raw.cameras[0].distortion[0], 0.1);
  EXPECT_EQ(raw.cameras[0].cam_from_world(2, 2), -2);
  EXPECT_EQ(raw.cameras[1].line, 10);
  EXPECT_EQ(raw.cameras[1].width, 640);
}

TEST(RawCalibrationTest, SaysWhereItStopped) {
  const RawCalibration raw = ParseRawCalibration("KRT", kCamera + "cam1\n1 0 0\n0 nan 0\n");
  EXPECT_EQ(raw.cameras.size(), 1u);
  EXPECT_THAT(raw.problem, HasSubstr("KRT:12"));
}

TEST(RawCalibrationTest, AnyBytesAreSurvived) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    std::string text = kCamera + kCamera;
    for (int i = 0; i < 4; ++i) {
      text[static_cast<size_t>(random.Below(static_cast<int64_t>(text.size())))] = static_cast<char>(random.Below(256));
    }
    text.resize(static_cast<size_t>(random.Below(static_cast<int64_t>(text.size()))));
    ParseRawCalibration("KRT", text);
    ErrorOf([&] { ParseRawTransform("transform", text); });
  }
}

TEST(RawCalibrationTest, TransformsMayHaveAFourthLine) {
  const auto transform = ParseRawTransform("t", "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n");
  EXPECT_EQ(transform(1, 3), 5);
  EXPECT_THAT(ErrorOf([] { ParseRawTransform("t", "1 0 0 4\n0 1 0 5\n0 0 1 6\n1 2 3 4\n"); }), HasSubstr("t:4"));
  EXPECT_THAT(ErrorOf([] { ParseRawTransform("t", "1 0 0 4\n"); }), HasSubstr("ends here"));
}

}  // namespace
}  // namespace likeness
