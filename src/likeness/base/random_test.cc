#include "likeness/base/random.h"

#include <gtest/gtest.h>

#include <vector>

namespace likeness {
namespace {

TEST(RandomTest, SameSeedSameNumbersOtherStreamsOtherNumbers) {
  Random a(7, 1), b(7, 1), c(7, 2), d(8, 1);
  int same_stream = 0, same_seed = 0;
  for (int i = 0; i < 1000; ++i) {
    const uint32_t x = a.Next();
    EXPECT_EQ(x, b.Next());
    same_stream += x == c.Next();
    same_seed += x == d.Next();
  }
  EXPECT_LT(same_stream, 3);
  EXPECT_LT(same_seed, 3);
}

TEST(RandomTest, MomentsAreRight) {
  Random random(1);
  double sum = 0, squares = 0, uniform = 0;
  constexpr int kSamples = 200000;
  for (int i = 0; i < kSamples; ++i) {
    const double x = random.Normal();
    sum += x;
    squares += x * x;
    uniform += random.Uniform();
  }
  // Five standard errors.
  EXPECT_NEAR(sum / kSamples, 0, 5 * 0.00224);
  EXPECT_NEAR(squares / kSamples, 1, 5 * 0.00316);
  EXPECT_NEAR(uniform / kSamples, 0.5, 5 * 0.00065);
}

TEST(RandomTest, BelowCoversItsRange) {
  Random random(3);
  std::vector<int> counts(7);
  for (int i = 0; i < 7000; ++i) ++counts[random.Below(7)];
  for (const int count : counts) EXPECT_NEAR(count, 1000, 150);
}

}  // namespace
}  // namespace likeness
