#include "likeness/simulate/glb/shape_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

TEST(ShapeNames, AreMatchedLoosely) {
  const auto expect = [](const char* spelt, const char* name) {
    EXPECT_EQ(ExpressionFromName(spelt), ExpressionIndex(name)) << spelt;
  };
  expect("eyeBlinkLeft", "eyeBlinkLeft");
  expect("EyeBlinkLeft", "eyeBlinkLeft");
  expect("eyeBlink_L", "eyeBlinkLeft");
  expect("eye_blink_left", "eyeBlinkLeft");
  expect("ARKit_eyeBlinkRight", "eyeBlinkRight");
  expect("blendShape1.EYE_BLINK_R", "eyeBlinkRight");
  expect("Head_jawOpen", "jawOpen");
  expect("jaw open", "jawOpen");
  expect("mouth_L", "mouthLeft");
  expect("tongueOut", "tongueOut");
  EXPECT_EQ(ExpressionFromName("eyeBlink"), -1);
  EXPECT_EQ(ExpressionFromName("smile"), -1);
  EXPECT_EQ(ExpressionFromName(""), -1);
  EXPECT_EQ(ExpressionFromName("___"), -1);
  for (const std::string& name : ExpressionNames()) EXPECT_EQ(ExpressionFromName(name), ExpressionIndex(name));
}

TEST(ShapeNames, MapsTargetsByTheirOwnNames) {
  const ShapeMap map = ParseShapeMap("map.json", R"({"JawOpen": {"Mouth_h": 1.3, "absent": 1}, "browInnerUp": {}})");
  const auto shapes = MatchShapes({"h_teeth.t_Mouth_h", "jawOpen", "eyeWide_L", "XMouth_h"}, map);
  const auto& jaw = shapes[ExpressionIndex("jawOpen")];
  ASSERT_EQ(jaw.size(), 1u);
  EXPECT_EQ(jaw[0].target, 0);
  EXPECT_FLOAT_EQ(jaw[0].weight, 1.3f);
  ASSERT_EQ(shapes[ExpressionIndex("eyeWideLeft")].size(), 1u);
  EXPECT_EQ(shapes[ExpressionIndex("eyeWideLeft")][0].target, 2);
  EXPECT_TRUE(shapes[ExpressionIndex("browInnerUp")].empty());
}

TEST(ShapeNames, RefusesWhatIsNoMap) {
  const auto error = [](const char* text) { return ErrorOf([&] { ParseShapeMap("map.json", text); }); };
  EXPECT_THAT(error("nonsense"), HasSubstr("map.json: is no shape map"));
  EXPECT_THAT(error("[1]"), HasSubstr("is no shape map"));
  EXPECT_THAT(error(R"({"jawOpn": {"a": 1}})"), HasSubstr("the nearest is 'jawOpen'"));
  EXPECT_THAT(error(R"({"jawOpen": 3})"), HasSubstr("expected {\"target\": weight"));
  EXPECT_THAT(error(R"({"jawOpen": {"a": "b"}})"), HasSubstr("'a' is no number"));
  EXPECT_THAT(error(R"({"jawOpen": {"a": 1e9}})"), HasSubstr("up to 100"));
}

}  // namespace
}  // namespace likeness
