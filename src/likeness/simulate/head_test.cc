#include "likeness/simulate/head.h"

#include <gtest/gtest.h>

#include <set>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

TEST(Expressions, AreFiftyTwoDifferentNamesThatAreFoundAgain) {
  const auto& names = ExpressionNames();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), 52u);
  for (int i = 0; i < kExpressionCount; ++i) EXPECT_EQ(ExpressionIndex(names[i]), i);
}

TEST(Expressions, AnUnknownNameIsAnErrorThatNamesTheNearest) {
  EXPECT_EQ(ErrorOf([] { ExpressionIndex("jawOpem"); }), "'jawOpem' is no expression; the nearest is 'jawOpen'");
}

}  // namespace
}  // namespace likeness
