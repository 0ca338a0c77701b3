#include "likeness/base/interrupt.h"

#include <gtest/gtest.h>

#include <csignal>

namespace likeness {
namespace {

TEST(InterruptScopeTest, TheFirstSignalIsARequestAndTheSecondEndsTheProgram) {
  {
    const InterruptScope scope;
    EXPECT_FALSE(scope.Requested());
    std::raise(SIGINT);
    EXPECT_TRUE(scope.Requested());
    EXPECT_EXIT(std::raise(SIGINT), ::testing::KilledBySignal(SIGINT), "");
  }
  const InterruptScope next;
  EXPECT_FALSE(next.Requested());
}

}  // namespace
}  // namespace likeness
