// What the window shows, without a window.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/viewer/decode_thread.h"
#include "likeness/viewer/directions.h"
#include "likeness/viewer/frame_times.h"
#include "likeness/viewer/layout.h"
#include "likeness/viewer/orbit.h"
#include "likeness/viewer/playback.h"
#include "likeness/viewer/settings.h"
#include "likeness/viewer/test_avatar.h"
#include "likeness/viewer/view_state.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::FloatEq;
using testing::HasSubstr;

constexpr double kSmall = 1e-9;  // of rounding, in numbers of some hundreds

TEST(Orbit, TurnsAsTheMouseDrags) {
  Orbit orbit;
  orbit.distance_mm = 500;
  orbit.target_in_head = {1, 2, 3};
  orbit.Turn(200, 0, 400);  // half of the height to the right: a quarter turn, the subject's left side goes away
  EXPECT_NEAR(orbit.azimuth_deg, -90, kSmall);
  EXPECT_LT((orbit.CameraFor(400, 400).CentreInWorld() - Eigen::Vector3d(1 - 500, 2, 3)).norm(), 1e-6);
  orbit.Turn(-200, 400.0 / 6, 400);  // back, and a sixth down: 30 degrees from above
  const double up = 500 * std::sin(M_PI / 6), out = 500 * std::cos(M_PI / 6);
  EXPECT_LT((orbit.CameraFor(400, 400).CentreInWorld() - Eigen::Vector3d(1, 2 + up, 3 + out)).norm(), 1e-6);
  orbit.Turn(0, 10000, 400);
  EXPECT_EQ(orbit.elevation_deg, 89);
}

TEST(Orbit, PansWithTheMouse) {
  Orbit orbit;
  orbit.Turn(50, 30, 400);
  const Eigen::Vector3d point = orbit.target_in_head;
  orbit.Pan(37, -21, 400);
  const Eigen::Vector2d at = orbit.CameraFor(600, 400).Project(point);
  EXPECT_NEAR(at.x(), 300 + 37, 1e-6);
  EXPECT_NEAR(at.y(), 200 - 21, 1e-6);
}

TEST(Orbit, ZoomsWithinItsLimits) {
  Orbit orbit;
  orbit.Zoom(2);
  orbit.Zoom(-2);
  EXPECT_NEAR(orbit.distance_mm, 900, kSmall);
  orbit.Zoom(1000);
  EXPECT_EQ(orbit.distance_mm, Orbit::kNearestMm);
}

TEST(Orbit, BeginsWithTheWholeMesh) {
  const Avatar avatar = MakeTestAvatar(16);
  const Vertices& vertices = avatar.identities[0].vertex_mean;
  const Camera camera = OrbitAround(vertices, avatar.topology).CameraFor(300, 300);
  double highest = 300, lowest = 0;
  for (int i = 0; i < vertices.rows(); ++i) {
    const Eigen::Vector2d at = camera.Project(vertices.row(i).transpose().cast<double>());
    EXPECT_TRUE(at.x() > 0 && at.x() < 300);
    highest = std::min(highest, at.y());
    lowest = std::max(lowest, at.y());
  }
  EXPECT_GT(highest, 0);
  EXPECT_LT(lowest, 300);
  EXPECT_GT(lowest - highest, 200);  // and fills most of the picture
}

TEST(Orbit, TwoEyesSeeTheTargetInTheMiddle) {
  Orbit orbit;
  orbit.target_in_head = {5, 6, 7};
  const std::vector<EyeView> eyes = EyesOf(orbit, 801, 300, true, 60);
  ASSERT_EQ(eyes.size(), 2u);
  EXPECT_EQ(eyes[1].x, 400);
  for (const EyeView& eye : eyes) {
    const Eigen::Vector2d at = eye.camera.Project(orbit.target_in_head);
    EXPECT_NEAR(at.x(), eye.camera.width / 2.0, 1e-6);
    EXPECT_NEAR(at.y(), 150, 1e-6);
  }
  EXPECT_EQ(eyes[0].camera.width + eyes[1].camera.width, 801);
  // From the front, the viewer's right is the subject's left, x.
  const Eigen::Vector3d between = eyes[1].camera.CentreInWorld() - eyes[0].camera.CentreInWorld();
  EXPECT_LT((between - Eigen::Vector3d(60, 0, 0)).norm(), 1e-6);
}

Performance FourFrames() {
  Performance performance;
  performance.latent = 1;
  performance.seconds = {0, 0.1, 0.3, 0.4};
  performance.codes = {0, 1, 2, 3};
  performance.world_from_head.resize(4);
  return performance;
}

TEST(Playback, LoopsOrStops) {
  Playback playback;
  playback.Advance(1, 0.4);
  EXPECT_EQ(playback.time_s, 0);  // does not play
  playback.playing = true;
  playback.speed = 2;
  playback.Advance(0.25, 0.4);
  EXPECT_NEAR(playback.time_s, 0.1, kSmall);
  playback.loop = false;
  playback.Advance(1, 0.4);
  EXPECT_EQ(playback.time_s, 0.4);
  EXPECT_FALSE(playback.playing);
}

TEST(Playback, StepsFromTheNearestFrame) {
  const Performance performance = FourFrames();
  EXPECT_EQ(FrameAt(performance, 0.19), 1);
  EXPECT_EQ(FrameAt(performance, 0.21), 2);
  EXPECT_EQ(FrameAt(performance, 9), 3);
  Playback playback;
  playback.time_s = 0.29;
  playback.Step(performance, 1);
  EXPECT_EQ(playback.time_s, 0.4);
  playback.Step(performance, 1);
  EXPECT_EQ(playback.time_s, 0);
  playback.loop = false;
  playback.Step(performance, -1);
  EXPECT_EQ(playback.time_s, 0);
}

// Codes vary along two directions that stand 30 degrees to the axes: by much along the first, which hardly moves the
// mesh, and by little along the second.
TEST(Directions, AreOrderedByHowFarTheyMoveTheFace) {
  const float c = std::sqrt(3.0f) / 2, s = 0.5f;
  const std::array<float, 2> mean = {10, -20};
  std::vector<FrameCode> frames;
  const auto add = [&](const std::string& name, float first, float second) {
    frames.push_back({"s", name, {mean[0] + c * first - s * second, mean[1] + s * first + c * second}});
  };
  add("much", 4, 0);
  add("less", -2, 0);
  add("again", -2, 0);
  add("up", 0, 1);
  add("down", 0, -0.5f);
  add("low", 0, -0.5f);
  // Two vertices; the second stands still. 0.1 mm a unit along the first direction, 10 mm along the second.
  std::vector<float> jacobian(12, 0.0f);
  jacobian[0] = 0.1f * c;
  jacobian[1] = 0.1f * s;
  jacobian[2] = -10 * s;
  jacobian[3] = 10 * c;
  std::vector<const FrameCode*> codes;
  for (const FrameCode& frame : frames) codes.push_back(&frame);
  const std::vector<CodeDirection> directions = FindDirections(codes, mean, jacobian);
  ASSERT_EQ(directions.size(), 2u);
  const float deviation = 0.5f;  // sqrt((1 + 0.25 + 0.25) / 6)
  EXPECT_NEAR(directions[0].movement_mm, 10 * deviation / std::sqrt(2), 1e-5);
  EXPECT_NEAR(directions[0].step[0], -s * deviation, 1e-5);
  EXPECT_NEAR(directions[0].step[1], c * deviation, 1e-5);
  EXPECT_EQ(directions[0].plus, "s/up");
  EXPECT_EQ(directions[0].minus, "s/down");
  EXPECT_NEAR(directions[1].movement_mm, 0.1 * 2 / std::sqrt(2), 1e-5);  // sqrt((16 + 4 + 4) / 6)
  EXPECT_EQ(directions[1].plus, "s/much");
  EXPECT_TRUE(FindDirections({codes[0]}, mean, jacobian).empty());
}

TEST(FrameTimes, KeepsTheLastOnes) {
  FrameTimes times;
  for (int i = 1; i <= FrameTimes::kMost + 10; ++i) times.Add({.draw = static_cast<double>(i), .total = i % 4 * 5.0});
  EXPECT_EQ(times.frames().size(), static_cast<size_t>(FrameTimes::kMost));
  EXPECT_EQ(times.frames().front().draw, 11);
  EXPECT_NEAR(times.Median(&FrameTime::draw), 10 + FrameTimes::kMost / 2.0, 1);
  EXPECT_EQ(times.ShareWithin(kFrameBudgetMs), 0.75);  // 0, 5 and 10 of 0, 5, 10 and 15
}

TEST(WindowLayout, CoversTheWindow) {
  const WindowLayout layout = LayOut(1000, 700, 1.5f, true, true);
  EXPECT_EQ(layout.controls.width + layout.face.width, 1000);
  EXPECT_EQ(layout.timeline.height + layout.face.height, 700);
  EXPECT_EQ(layout.face.x, layout.controls.width);
  EXPECT_EQ(layout.timeline.y, layout.face.height);
  EXPECT_EQ(LayOut(1000, 700, 1.5f, false, false).face.width, 1000);
  EXPECT_GT(LayOut(10, 10, 4, true, true).face.width, 4);
}

TEST(ViewerSettings, SurviveWritingAndReading) {
  const ScratchFolder scratch;
  ViewerSettings settings;
  settings.place = {12, 34, 567, 456, true};
  settings.dark = false;
  settings.Remember("/a/one");
  settings.Remember("/a/two");
  settings.Remember("/a/one");
  SaveViewerSettings(scratch / "likeness/viewer.json", settings);
  const ViewerSettings read = LoadViewerSettings(scratch / "likeness/viewer.json");
  EXPECT_EQ(read.place.x, 12);
  EXPECT_EQ(read.place.height, 456);
  EXPECT_TRUE(read.place.maximised);
  EXPECT_FALSE(read.dark);
  EXPECT_THAT(read.recent, ElementsAre("/a/one", "/a/two"));
  EXPECT_EQ(LoadViewerSettings(scratch / "none").place.width, 1280);
  EXPECT_THAT(ErrorOf([] { ParseViewerSettings("x.json", R"({"window": 3})"); }), HasSubstr("x.json"));
}

class AvatarTest : public testing::Test {
 protected:
  AvatarTest() { SaveAvatar(file(), MakeTestAvatar()); }

  std::filesystem::path file() const { return scratch_ / "avatar.safetensors"; }

  ScratchFolder scratch_;
};

TEST_F(AvatarTest, OpensWithWhatTheWindowNeeds) {
  const ViewedAvatar viewed = OpenAvatar(scratch_.path());  // by its folder
  ASSERT_EQ(viewed.clips.size(), 3u);
  EXPECT_EQ(viewed.clips[1].name, "smile");
  EXPECT_EQ(viewed.clips[0].performance.frame_names[2], "jaw/003");
  EXPECT_THAT(viewed.rest, ElementsAre(FloatEq(0.25f), FloatEq(1.6f / 6), FloatEq(1.0f / 6), FloatEq(1)));
  // The fourth value never varies: three directions. An opening jaw moves the most.
  ASSERT_EQ(viewed.directions.size(), 3u);
  const CodeDirection& first = viewed.directions[0];
  EXPECT_TRUE(first.plus.starts_with("jaw/") || first.minus.starts_with("jaw/")) << first.minus << " " << first.plus;
  EXPECT_GT(viewed.directions[0].movement_mm, viewed.directions[2].movement_mm);
  const std::vector<float> moved = MovedCode(viewed, viewed.rest, std::vector<float>{2});
  for (size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(moved[i], viewed.rest[i] + 2 * viewed.directions[0].step[i]);
}

TEST_F(AvatarTest, SaysWhatIsNotThere) {
  EXPECT_THAT(ErrorOf([&] { OpenAvatar(scratch_ / "absent"); }), HasSubstr("absent"));
  EXPECT_THAT(ErrorOf([&] { OpenAvatar(file(), "Nobody"); }), HasSubstr("Nobody"));
  ViewState state;
  state.Show(std::make_shared<const ViewedAvatar>(OpenAvatar(file())));
  EXPECT_THAT(ErrorOf([&] { state.GoTo("smile/003"); }), HasSubstr("did you mean 'smile/00"));
}

TEST_F(AvatarTest, AsksForWhatTheStateSays) {
  ViewState state;
  state.Show(std::make_shared<const ViewedAvatar>(OpenAvatar(file())));
  EXPECT_EQ(state.FrameName(), "at rest");
  state.GoTo("jaw/002");
  EXPECT_EQ(state.FrameName(), "jaw/002 (2 of 3)");
  state.sliders = {1, 0, -1};
  state.orbit.azimuth_deg = 90;
  state.orbit.target_in_head.setZero();
  const DecodeRequest request = RequestFor(state, EyesOf(state.orbit, 200, 100, false, 0));
  EXPECT_EQ(request.code, MovedCode(*state.avatar, {0.5f, 0, 0, 1}, state.sliders));
  ASSERT_EQ(request.views_in_head.size(), 1u);
  EXPECT_LT((request.views_in_head[0] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-6);

  // Fixed at this view: it stays, for both eyes, when the camera goes elsewhere.
  state.ToggleViewDependence();
  state.orbit.azimuth_deg = 0;
  const DecodeRequest fixed = RequestFor(state, EyesOf(state.orbit, 200, 100, true, 60));
  ASSERT_EQ(fixed.views_in_head.size(), 1u);
  EXPECT_LT((fixed.views_in_head[0] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-6);
  state.ToggleViewDependence();
  EXPECT_EQ(RequestFor(state, EyesOf(state.orbit, 200, 100, true, 60)).views_in_head.size(), 2u);

  state.RandomFace(5);
  EXPECT_EQ(state.clip, -1);
  EXPECT_NE(state.sliders, std::vector<float>(3));
  state.ResetFace();
  EXPECT_EQ(state.sliders, std::vector<float>(3));
}

TEST_F(AvatarTest, PlaysAPerformanceWithItsHead) {
  const auto avatar = std::make_shared<const ViewedAvatar>(OpenAvatar(file()));
  Performance performance;
  performance.latent = 4;
  performance.avatar = avatar->id;
  performance.seconds = {0, 1};
  performance.codes = {0, 0, 0, 1, 1, 0, 0, 1};
  performance.world_from_head = {{Eigen::Matrix3d::Identity(), {100, 0, 0}},
                                 {Eigen::Matrix3d::Identity(), {100, 0, 8}}};
  WritePerformance(scratch_ / "talk.safetensors", performance);
  EXPECT_TRUE(IsPerformance(scratch_ / "talk.safetensors"));
  EXPECT_FALSE(IsPerformance(file()));
  ViewState state;
  state.Show(avatar);
  state.performances.push_back(OpenPerformance(scratch_ / "talk.safetensors", *avatar));
  state.PlayClip(3);
  state.playback.time_s = 0.5;
  EXPECT_EQ(state.FrameName(), "talk (2 of 2)");
  EXPECT_LT((HeadPose(state).translation - Eigen::Vector3d(0, 0, 4)).norm(), kSmall);
  EXPECT_FLOAT_EQ(RequestFor(state, EyesOf(state.orbit, 200, 100, false, 0)).code[0], 0.5f);
  performance.avatar = "0123456789abcdef";
  WritePerformance(scratch_ / "other.safetensors", performance);
  EXPECT_THAT(ErrorOf([&] { OpenPerformance(scratch_ / "other.safetensors", *avatar); }),
              HasSubstr("other.safetensors"));
}

template <typename Done>
bool WaitUntil(const Done& done) {
  for (int i = 0; i < 20000; ++i) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST_F(AvatarTest, DecodesTheNewestRequest) {
  DecodeThread thread([] {});
  thread.Open(file(), "");
  std::shared_ptr<const ViewedAvatar> avatar;
  ASSERT_TRUE(WaitUntil([&] { return (avatar = thread.TakeOpened()) != nullptr; }));
  DecodeRequest request;
  for (int i = 0; i <= 50; ++i) {
    request = {{static_cast<float>(i) / 50, 0, 0, 1}, {Eigen::Vector3f(0.6f, 0, 0.8f), Eigen::Vector3f(0, 0, 1)}};
    thread.Decode(avatar, request);
  }
  DecodedViews views;
  int taken = 0;
  ASSERT_TRUE(WaitUntil([&] {
    taken += thread.TakeViews(&views);
    return views.request == request;
  }));
  EXPECT_LE(taken, 51);
  ASSERT_EQ(views.textures.size(), 2u);
  // The test avatar's law: 0.6 to the side makes it redder by 36, where that is not clamped.
  int compared = 0;
  for (size_t i = 0; i < views.textures[0].size(); i += 4) {
    if (views.textures[1][i] > 210) continue;
    ++compared;
    EXPECT_NEAR(views.textures[0][i] - views.textures[1][i], 0.6 * kRedForX, 1);
    EXPECT_EQ(views.textures[0][i + 1], views.textures[1][i + 1]);
  }
  EXPECT_GT(compared, 1000);
  ViewedAvatar plain = OpenAvatar(file());
  Vertices vertices(plain.topology.vertex_count, 3);
  plain.decoder->Decode(request.code, {}, {vertices.data()});
  EXPECT_EQ(vertices, views.vertices_in_head);
}

TEST_F(AvatarTest, SaysWhyAFileCannotBeOpened) {
  WriteFile(scratch_ / "text.safetensors", "this is no avatar");
  DecodeThread thread([] {});
  thread.Open(scratch_ / "text.safetensors", "");
  std::string error;
  ASSERT_TRUE(WaitUntil([&] { return !(error = thread.TakeError()).empty(); }));
  EXPECT_THAT(error, HasSubstr("text.safetensors"));
  EXPECT_EQ(thread.TakeOpened(), nullptr);
}

}  // namespace
}  // namespace likeness
