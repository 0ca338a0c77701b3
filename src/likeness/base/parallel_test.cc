#include "likeness/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

TEST(ParallelForTest, VisitsEveryItemOnce) {
  for (const int threads : {1, 2, 7}) {
    SetThreadCount(threads);
    std::vector<std::atomic<int>> visits(1000);
    ParallelFor(1000, [&](int64_t i) { ++visits[i]; });
    for (const auto& count : visits) EXPECT_EQ(count, 1);
  }
  SetThreadCount(0);
}

TEST(ParallelForTest, PassesExceptionsOnAndCanBeNested) {
  SetThreadCount(4);
  EXPECT_THROW(ParallelFor(100,
                           [](int64_t i) {
                             if (i == 13) throw Error("13");
                           }),
               Error);
  std::atomic<int> sum = 0;
  ParallelFor(8, [&](int64_t) { ParallelFor(8, [&](int64_t) { ++sum; }); });
  EXPECT_EQ(sum, 64);
  SetThreadCount(0);
}

}  // namespace
}  // namespace likeness
