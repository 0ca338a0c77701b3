#include "likeness/xr/pacing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace likeness {
namespace {

constexpr int64_t kPeriod = 10'000'000;  // 100 Hz

TEST(Pacing, CountsDisplaysWithoutAFrame) {
  Pacing pacing;
  for (const int display : {100, 101, 102, 105, 106}) pacing.Add(display * kPeriod, kPeriod, 4, display == 105);
  const PacingSummary summary = pacing.Summary();
  EXPECT_EQ(summary.frames, 5);
  EXPECT_EQ(summary.missed, 2);
  EXPECT_EQ(summary.older_faces, 1);
  EXPECT_NEAR(summary.seconds, 0.06, 1e-9);
  EXPECT_NEAR(summary.frames_per_s, 100, 1e-9);
}

TEST(Pacing, ClocksNeedNotBeExact) {
  Pacing pacing;
  for (const int64_t jitter : {0, 300'000, -400'000, 4'000'000}) {
    static int64_t display = 0;
    pacing.Add(++display * kPeriod + jitter, kPeriod, 1, false);
  }
  EXPECT_EQ(pacing.Summary().missed, 0);
}

TEST(Pacing, RestsDoNotCount) {
  Pacing pacing;
  pacing.Add(1 * kPeriod, kPeriod, 1, false);
  pacing.Add(2 * kPeriod, kPeriod, 1, false);
  pacing.Pause();
  pacing.Add(900 * kPeriod, kPeriod, 1, false);
  pacing.Add(901 * kPeriod, kPeriod, 1, false);
  EXPECT_EQ(pacing.Summary().missed, 0);
  EXPECT_NEAR(pacing.Summary().seconds, 0.02, 1e-9);
}

TEST(Pacing, SaysHowLongFramesTook) {
  Pacing pacing;
  for (int i = 1; i <= 200; ++i) pacing.Add(i * kPeriod, kPeriod, i <= 196 ? 2 : 9, false);
  EXPECT_EQ(pacing.Summary().median_ms, 2);
  EXPECT_EQ(pacing.Summary().p99_ms, 9);
  EXPECT_THAT(Describe(pacing.Summary()), testing::HasSubstr("200 frames in 2.0 s of display at 100 Hz, 0 missed"));
  EXPECT_THAT(Describe(Pacing().Summary()), testing::HasSubstr("0 frames"));
}

}  // namespace
}  // namespace likeness
