#include "likeness/avatar/conditions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Avatar Family(IdentityConditioning identity) {
  Avatar avatar;
  avatar.architecture.identities = 3;
  avatar.architecture.identity = identity;
  avatar.architecture.conditions = {{"gaze", 2}, {"light", 1}};
  avatar.identities = {{"anna", {}, {}}, {"ben", {}, {}}, {"cora", {}, {}}};
  avatar.condition_mean = {1, 2, 3};
  avatar.condition_deviation = {2, 2, 10};
  if (identity == IdentityConditioning::kLearned) {
    avatar.architecture.identity_size = 2;
    avatar.weights[kIdentityVectors] = {{3, 2}, {10, 11, 20, 21, 30, 31}};
  }
  return avatar;
}

TEST(Conditions, VectorIsIdentityThenStandardisedConditions) {
  EXPECT_THAT(ConditionVector(Family(IdentityConditioning::kOneHot), {1, {}}), ElementsAre(0, 1, 0, 0, 0, 0));
  EXPECT_THAT(ConditionVector(Family(IdentityConditioning::kLearned), {2, {5, 0, 3}}), ElementsAre(30, 31, 2, -1, 0));
  EXPECT_THAT(ConditionVector(Family(IdentityConditioning::kNone), {0, {1, 2, 23}}), ElementsAre(0, 0, 2));
  EXPECT_THAT(ConditionVector(Avatar(), {}), IsEmpty());
}

TEST(Conditions, WhatIsNotTheAvatarsIsAnError) {
  const Avatar avatar = Family(IdentityConditioning::kOneHot);
  EXPECT_THAT(ErrorOf([&] { ConditionVector(avatar, {3, {}}); }), HasSubstr("no person 3"));
  EXPECT_THAT(ErrorOf([&] { ConditionVector(avatar, {-1, {}}); }), HasSubstr("no person -1"));
  EXPECT_THAT(ErrorOf([&] { ConditionVector(avatar, {0, {1}}); }), HasSubstr("this avatar has 3"));
  EXPECT_EQ(FindIdentity(avatar, "cora"), 2);
  EXPECT_THAT(ErrorOf([&] { FindIdentity(avatar, "coro"); }), HasSubstr("did you mean 'cora'"));
}

TEST(Conditions, AreSetByName) {
  const Avatar avatar = Family(IdentityConditioning::kNone);
  FrameConditions conditions;
  SetCondition(avatar, "light=-4", &conditions);
  EXPECT_THAT(conditions.values, ElementsAre(1, 2, -4));
  SetCondition(avatar, "gaze=0.5, 7", &conditions);
  EXPECT_THAT(conditions.values, ElementsAre(0.5, 7, -4));
  for (const char* wrong : {"gaze", "gaze=", "gaze=1", "gaze=1,2,3", "gaze=1,x", "gaze=1,nan"}) {
    EXPECT_THAT(ErrorOf([&] { SetCondition(avatar, wrong, &conditions); }), HasSubstr("gaze")) << wrong;
  }
  EXPECT_THAT(ErrorOf([&] { SetCondition(avatar, "gase=1,2", &conditions); }), HasSubstr("did you mean 'gaze'"));
  EXPECT_THAT(ErrorOf([&] { SetCondition(Avatar(), "gaze=1", &conditions); }), HasSubstr("it has none"));
}

}  // namespace
}  // namespace likeness
