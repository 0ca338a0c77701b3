#include "likeness/train/sample_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace likeness {
namespace {

TEST(SampleOrder, AnEpochShowsEverySampleAndGroupsShareAFrame) {
  const std::vector<std::vector<int>> frames = {{0, 1, 2, 3, 4}, {5, 6, 7, 8}, {9}, {}};
  for (const int views : {1, 2, 4}) {
    const SampleOrder order(frames, views, 7);
    std::map<int, int> seen;
    const int batch = 2 * views;
    // Groups per epoch are 10, 6 and 4: whole batches of two groups.
    ASSERT_EQ(order.groups_per_epoch() % 2, 0);
    for (int64_t i = 0; i < order.groups_per_epoch() / 2; ++i) {
      const std::vector<int> samples = order.Samples(i, batch);
      ASSERT_EQ(samples.size(), static_cast<size_t>(batch));
      for (int k = 0; k < batch; ++k) {
        ++seen[samples[k]];
        const auto& mates = *std::find_if(frames.begin(), frames.end(), [&](const std::vector<int>& f) {
          return std::count(f.begin(), f.end(), samples[k - k % views]) > 0;
        });
        EXPECT_EQ(std::count(mates.begin(), mates.end(), samples[k]), 1);
      }
    }
    EXPECT_EQ(seen.size(), 10) << "views " << views;
    if (views == 1) {
      for (const auto& [sample, count] : seen) EXPECT_EQ(count, 1) << sample;
    }
  }
}

TEST(SampleOrder, IsAFunctionOfSeedAndIteration) {
  const std::vector<std::vector<int>> frames(20, {0, 1, 2});
  const SampleOrder a(frames, 1, 7), b(frames, 1, 7), c(frames, 1, 8);
  EXPECT_EQ(a.Samples(5, 4), b.Samples(5, 4));
  EXPECT_NE(a.Samples(0, 60), c.Samples(0, 60));
  EXPECT_NE(a.Samples(0, 60), a.Samples(1, 60)) << "the second epoch has an order of its own";
  // A batch over the seam of two epochs.
  std::vector<int> joined = a.Samples(0, 40);
  const std::vector<int> rest = a.Samples(1, 40);
  joined.insert(joined.end(), rest.begin(), rest.begin() + 20);
  EXPECT_EQ(joined, a.Samples(0, 60));
}

}  // namespace
}  // namespace likeness
