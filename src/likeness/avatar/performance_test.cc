#include "likeness/avatar/performance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

RigidTransform Pose(double yaw, double x) { return {RotationFromYawPitchRoll(yaw, 0, 0), {x, 2, 3}}; }

Performance MakePerformance() {
  Performance p;
  p.avatar = "0123456789abcdef";
  p.person = "anna";
  p.latent = 2;
  p.conditions = {{"gaze", 2}, {"light", 1}};
  p.seconds = {0, 1.0 / 3, 1};
  p.codes = {1, 2, 3, 4, -5, 6};
  p.condition_values = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  p.world_from_head = {Pose(0, 10), Pose(0.5, 20), Pose(-0.5, 30)};
  p.frame_names = {"EXP_a/000001", "EXP_a/000002", "SEN_\"b\"/7"};
  return p;
}

TEST(PerformanceTest, ComesBackAsItWasWritten) {
  const ScratchFolder scratch;
  const Performance written = MakePerformance();
  WritePerformance(scratch / "a.perf.safetensors", written);
  const Performance read = ReadPerformance(scratch / "a.perf.safetensors");
  EXPECT_EQ(read.avatar, written.avatar);
  EXPECT_EQ(read.person, written.person);
  EXPECT_EQ(read.latent, written.latent);
  EXPECT_EQ(read.conditions, written.conditions);
  EXPECT_EQ(read.seconds, written.seconds);
  EXPECT_EQ(read.codes, written.codes);
  EXPECT_EQ(read.condition_values, written.condition_values);
  EXPECT_EQ(read.frame_names, written.frame_names);
  ASSERT_EQ(read.world_from_head.size(), 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(read.world_from_head[i].rotation, written.world_from_head[i].rotation);
    EXPECT_EQ(read.world_from_head[i].translation, written.world_from_head[i].translation);
  }
  EXPECT_THAT(read.Code(1), ElementsAre(3, 4));
  EXPECT_THAT(read.ConditionValues(2), ElementsAre(7, 8, 9));
}

// What a few lines of Python write: no names, no person, nothing about the avatar.
TEST(PerformanceTest, NeedsOnlyTimeCodesAndPoses) {
  const std::vector<double> seconds = {0}, pose = {1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9};
  const std::vector<float> codes = {1, 2, 3};
  const ScratchFolder scratch;
  WriteSafetensors(
      scratch / "a.safetensors",
      {ViewOf("codes", {1, 3}, codes), ViewOf("seconds", {1}, seconds), ViewOf("world_from_head", {1, 3, 4}, pose)},
      {{"format", "likeness-performance"}, {"version", "1"}});
  const Performance p = ReadPerformance(scratch / "a.safetensors");
  EXPECT_EQ(p.latent, 3);
  EXPECT_EQ(p.world_from_head[0].translation, Eigen::Vector3d(7, 8, 9));
  EXPECT_TRUE(p.ConditionValues(0).empty());
  EXPECT_EQ(p.avatar, "");
}

TEST(PerformanceTest, MomentsLieBetweenFrames) {
  const Performance p = MakePerformance();
  const PerformanceMoment middle = MomentAt(p, 1.0 / 6);
  EXPECT_NEAR(middle.code[0], 2, 1e-6);
  EXPECT_NEAR(middle.code[1], 3, 1e-6);
  EXPECT_NEAR(middle.condition_values[2], 4.5, 1e-6);
  EXPECT_NEAR(middle.world_from_head.translation.x(), 15, 1e-12);
  EXPECT_LT((middle.world_from_head.rotation - Pose(0.25, 0).rotation).norm(), 1e-12);
  const PerformanceMoment later = MomentAt(p, 1.0 / 3 + 0.25 * 2 / 3);
  EXPECT_LT((later.world_from_head.rotation - Pose(0.25, 0).rotation).norm(), 1e-12);
  EXPECT_NEAR(later.code[0], 1, 1e-6);
  EXPECT_THAT(MomentAt(p, -1).code, ElementsAre(1, 2));
  EXPECT_THAT(MomentAt(p, 0).code, ElementsAre(1, 2));
  EXPECT_THAT(MomentAt(p, 1.0 / 3).code, ElementsAre(3, 4));
  EXPECT_THAT(MomentAt(p, 1).code, ElementsAre(-5, 6));
  EXPECT_THAT(MomentAt(p, 99).code, ElementsAre(-5, 6));
}

TEST(PerformanceTest, WrongOnesAreErrors) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto error = [](const std::function<void(Performance*)>& break_it) {
    Performance p = MakePerformance();
    break_it(&p);
    const std::string of_check = ErrorOf([&] { p.Check("FILE"); });
    EXPECT_THAT(of_check, testing::StartsWith("FILE: "));
    return of_check;
  };
  EXPECT_THAT(error([](Performance* p) { *p = Performance(); }), HasSubstr("at least one frame"));
  EXPECT_THAT(error([](Performance* p) { p->latent = 0; }), HasSubstr("at least one value"));
  EXPECT_THAT(error([](Performance* p) { p->codes.pop_back(); }), HasSubstr("5 values of codes; expected 6"));
  EXPECT_THAT(error([](Performance* p) { p->condition_values.clear(); }), HasSubstr("0 values of conditions"));
  EXPECT_THAT(error([](Performance* p) { p->world_from_head.pop_back(); }), HasSubstr("2 head poses"));
  EXPECT_THAT(error([](Performance* p) { p->frame_names.pop_back(); }), HasSubstr("2 frame names"));
  EXPECT_THAT(error([](Performance* p) { p->codes[3] = kNaN; }), HasSubstr("codes hold values that are not finite"));
  EXPECT_THAT(error([](Performance* p) { p->condition_values[3] = kNaN; }), HasSubstr("not finite"));
  EXPECT_THAT(error([](Performance* p) { p->seconds[0] = 0.5; }), HasSubstr("frame 0 is at 0.5 s"));
  EXPECT_THAT(error([](Performance* p) { p->seconds[2] = p->seconds[1]; }), HasSubstr("rise from frame to frame"));
  EXPECT_THAT(error([](Performance* p) { p->seconds[2] = kNaN; }), HasSubstr("frame 2"));
  EXPECT_THAT(error([](Performance* p) { p->world_from_head[1].rotation *= 1.01; }), HasSubstr("pose of frame 1"));
  EXPECT_THAT(error([](Performance* p) { p->world_from_head[1].rotation(0, 0) = kNaN; }), HasSubstr("pose of frame 1"));
  EXPECT_THAT(error([](Performance* p) { p->world_from_head[2].translation.x() = kNaN; }), HasSubstr("frame 2"));
  EXPECT_THAT(error([](Performance* p) { p->conditions[0].size = 0; }), HasSubstr("'gaze' of 0 values"));
  EXPECT_THAT(error([](Performance* p) { p->conditions[0].name = "../x"; }), HasSubstr("'../x'"));
}

TEST(PerformanceTest, WrongFilesAreErrorsThatSayWhatToDo) {
  const std::string good = PerformanceBytes(MakePerformance());
  const auto error = [&](const std::string& from, const std::string& to) {
    std::string bytes = good;
    const size_t at = bytes.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    EXPECT_EQ(from.size(), to.size());
    bytes.replace(at, from.size(), to);
    return ErrorOf([&] { ParsePerformance("FILE", bytes); });
  };
  EXPECT_EQ(error("anna", "anne"), "");
  EXPECT_THAT(error("likeness-performance", "likeness-performancx"), HasSubstr("likeness encode makes one"));
  EXPECT_THAT(error("\"version\":\"1\"", "\"version\":\"2\""), HasSubstr("version '2'"));
  EXPECT_THAT(error("gaze", "g/ze"), HasSubstr("'g/ze'"));
  EXPECT_THAT(error("[[\\\"gaze\\\",2]", "[[\\\"gaze\\\",3]"), HasSubstr("[3, 4]"));
  EXPECT_THAT(error("[[\\\"gaze\\\",2]", "[ \\\"gaze\\\",2 "), HasSubstr("metadata 'conditions'"));
  EXPECT_THAT(error("[3,2]", "[2,3]"), HasSubstr("tensor 'codes' is F32 [2, 3]"));
  EXPECT_THAT(ErrorOf([&] { ParsePerformance("FILE", good.substr(0, good.size() - 1)); }), HasSubstr("FILE: "));
}

TEST(PerformanceTest, BelongsToOneAvatar) {
  const Performance p = MakePerformance();
  Architecture architecture;
  architecture.latent = 2;
  architecture.conditions = p.conditions;
  const auto error = [&](const std::string& id) { return ErrorOf([&] { CheckBelongs(p, "FILE", architecture, id); }); };
  EXPECT_EQ(error(p.avatar), "");
  EXPECT_EQ(error(""), "");
  EXPECT_THAT(error("fedcba9876543210"), HasSubstr("likeness encode"));
  architecture.conditions.clear();
  EXPECT_THAT(error(p.avatar), HasSubstr("gaze"));
  architecture.latent = 3;
  EXPECT_THAT(error(p.avatar), HasSubstr("codes of 2 values; this avatar's have 3"));
}

}  // namespace
}  // namespace likeness
