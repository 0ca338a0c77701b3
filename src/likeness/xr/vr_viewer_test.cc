// The whole way through OpenXR's own loader and its validation layer, with a runtime of ours (mock/mock_headset.h) at
// the end, under a virtual screen. LIKENESS_TEST_PICTURES=FOLDER keeps what the eyes saw.

#include "likeness/xr/vr_viewer.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/viewer/test_avatar.h"
#include "likeness/viewer/test_screen.h"
#include "likeness/xr/mock/mock_headset.h"

namespace likeness {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr char kValidation[] = "XR_APILAYER_LUNARG_core_validation";
constexpr int kMostFrames = 500;  // until what is waited for has happened

bool HasValidation() {
  uint32_t count = 0;
  xrEnumerateApiLayerProperties(0, &count, nullptr);
  std::vector<XrApiLayerProperties> layers(count, Typed<XrApiLayerProperties>(XR_TYPE_API_LAYER_PROPERTIES));
  xrEnumerateApiLayerProperties(count, &count, layers.data());
  return std::any_of(layers.begin(), layers.end(),
                     [](const XrApiLayerProperties& layer) { return std::string(layer.layerName) == kValidation; });
}

XrPosef ToXrPose(const RigidTransform& pose) {
  const Eigen::Quaternionf q(pose.rotation.cast<float>());
  const Eigen::Vector3f metres = (pose.translation / 1000).cast<float>();
  return {{q.x(), q.y(), q.z(), q.w()}, {metres.x(), metres.y(), metres.z()}};
}

class VrViewerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!TestScreen::Available()) return;
    screen_ = new TestScreen;
    scratch_ = new ScratchFolder;
    SaveAvatar(*scratch_ / "avatar.safetensors", MakeTestAvatar());
    void* const library = dlopen(LIKENESS_MOCK_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(library, nullptr) << dlerror();
    mock_ = reinterpret_cast<decltype(&LikenessMockHeadset)>(dlsym(library, "LikenessMockHeadset"))();
    if (!HasValidation()) return;
    setenv("XR_ENABLE_API_LAYERS", kValidation, 1);
    setenv("XR_CORE_VALIDATION_EXPORT_TYPE", "text", 1);
    setenv("XR_CORE_VALIDATION_FILE_NAME", (*scratch_ / "validation.txt").c_str(), 1);
  }
  static void TearDownTestSuite() {
    delete screen_;
    delete scratch_;
    screen_ = nullptr;
    scratch_ = nullptr;
  }
  void SetUp() override {
    if (screen_ == nullptr) GTEST_SKIP() << "Xvfb or xdotool absent; scripts/setup installs them";
    *mock_ = {};
    setenv("XR_RUNTIME_JSON", LIKENESS_MOCK_MANIFEST, 1);
    mock_->local_from_head.position = {0.1f, 1.6f, 0.2f};
  }
  void TearDown() override {
    viewer_.reset();
    if (screen_ == nullptr) return;
    const std::filesystem::path found = *scratch_ / "validation.txt";
    if (!Exists(found)) return;
    EXPECT_EQ(ReadFile(found), "") << "found by OpenXR's validation layer";
    std::filesystem::remove(found);
  }

  static VrOptions Options() {
    VrOptions options;
    options.viewer.avatar = *scratch_ / "avatar.safetensors";
    options.viewer.size = {{400, 300}};
    return options;
  }
  void Start(const VrOptions& options = Options()) {
    viewer_ = std::make_unique<VrViewer>(options);
    FramesUntil([&] { return mock().state == XR_SESSION_STATE_FOCUSED && LastShown() != nullptr; });
  }
  void Frames(int count) {
    for (int i = 0; i < count; ++i) ASSERT_TRUE(viewer_->Frame());
  }
  template <typename Condition>
  void FramesUntil(const Condition& condition) {
    for (int i = 0; i < kMostFrames && !condition(); ++i) ASSERT_TRUE(viewer_->Frame());
    ASSERT_TRUE(condition());
  }
  // The last frame that was handed over, if it had pictures.
  const MockFrame* LastShown() const {
    return mock_->frames.empty() || !mock_->frames.back().shown ? nullptr : &mock_->frames.back();
  }
  // What the eyes see now.
  std::array<ImageU8, 2> Look(const std::string& name) {
    mock().keep_pictures = true;
    Frames(1);
    FramesUntil([&] { return viewer_->face().current(); });
    mock().keep_pictures = false;
    const std::array<ImageU8, 2>& pictures = mock().frames.back().pictures;
    const char* folder = std::getenv("LIKENESS_TEST_PICTURES");
    for (const size_t eye : {kLeft, kRight}) {
      const std::string file = "vr-" + name + (eye == kLeft ? "-left.png" : "-right.png");
      if (folder != nullptr) WritePng(std::filesystem::path(folder) / file, pictures[eye]);
    }
    return pictures;
  }
  // Both hands before the viewer; the right one points at a place of the left one's menu, in mm from its centre.
  void PointAt(double x_mm, double y_mm) {
    const RigidTransform grip = {Eigen::Matrix3d::Identity(), {0, 1350, -150}};
    RigidTransform panel_from_aim;
    panel_from_aim.translation = {x_mm, y_mm, 250};
    for (MockHand& hand : mock().hands) hand.tracked = true;
    mock().hands[kLeft].local_from_grip = ToXrPose(grip);
    mock().hands[kRight].local_from_aim = ToXrPose(MenuAboveHand(grip) * panel_from_aim);
  }
  void Press(bool MockHand::*button, size_t side) {
    mock().hands[side].*button = true;
    Frames(2);
    mock().hands[side].*button = false;
    Frames(2);
  }

  MockHeadset& mock() { return *mock_; }

  static inline TestScreen* screen_ = nullptr;
  static inline ScratchFolder* scratch_ = nullptr;
  static inline MockHeadset* mock_ = nullptr;
  std::unique_ptr<VrViewer> viewer_;
};

TEST_F(VrViewerTest, SaysWhatIsMissing) {
  const auto error = [] { return ErrorOf([] { VrViewer viewer(Options()); }); };
  setenv("XR_RUNTIME_JSON", "/nowhere/runtime.json", 1);
  EXPECT_THAT(error(), HasSubstr("/nowhere/runtime.json"));
  EXPECT_THAT(error(), HasSubstr("docs/vr.md"));
  unsetenv("XR_RUNTIME_JSON");
  setenv("XDG_CONFIG_HOME", scratch_->path().c_str(), 1);
  EXPECT_THAT(error(), HasSubstr("no OpenXR runtime"));
  EXPECT_THAT(error(), HasSubstr("Monado, SteamVR or WiVRn"));
  unsetenv("XDG_CONFIG_HOME");
  setenv("XR_RUNTIME_JSON", LIKENESS_MOCK_MANIFEST, 1);
  mock().connected = false;
  EXPECT_THAT(error(), HasSubstr("no headset is connected"));
  mock().connected = true;
  mock().formats = {GL_RGBA8};
  EXPECT_THAT(error(), HasSubstr("GL_SRGB8_ALPHA8"));
  mock().has_opengl = false;
  EXPECT_THAT(error(), HasSubstr("lacks OpenGL"));
  mock().has_opengl = true;
  error();  // OpenXR's loader remembers what a runtime has until an instance of it ends
}

TEST_F(VrViewerTest, ChecksItsOptions) {
  VrOptions options = Options();
  options.distance_mm = 100;
  EXPECT_THAT(ErrorOf([&] { VrViewer viewer(options); }), HasSubstr("300 to 10000 mm"));
  options = Options();
  options.viewer.avatar.clear();
  EXPECT_THAT(ErrorOf([&] { VrViewer viewer(options); }), HasSubstr("name its file"));
}

TEST_F(VrViewerTest, CallsComeInOrder) {
  Start();
  mock().calls.clear();
  Frames(1);
  std::vector<std::string> calls;
  for (const std::string& call : mock().calls) {
    if (call != "xrGetActionStateBoolean" && call != "xrLocateSpace") calls.push_back(call);
  }
  EXPECT_THAT(calls,
              ElementsAre("xrWaitFrame", "xrBeginFrame", "xrSyncActions", "xrLocateViews", "xrAcquireSwapchainImage",
                          "xrWaitSwapchainImage", "xrReleaseSwapchainImage", "xrAcquireSwapchainImage",
                          "xrWaitSwapchainImage", "xrReleaseSwapchainImage", "xrEndFrame"));
}

TEST_F(VrViewerTest, PosesAreOfTheTimeOfDisplay) {
  Start();
  mock().speed = {0.3f, -0.1f, 0.2f};
  mock().moving_since = mock().frames.back().display_time;
  const size_t before = mock().frames.size();
  mock().located.clear();
  Frames(5);
  ASSERT_EQ(mock().located.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    const MockFrame& frame = mock().frames[before + i];
    EXPECT_EQ(frame.display_time, mock().located[i]);
    const double seconds = static_cast<double>(frame.display_time - mock().moving_since) * 1e-9;
    const double half = mock().eye_distance_m / 2;
    EXPECT_NEAR(frame.local_from_eye[kLeft].position.x, 0.1 + 0.3 * seconds - half, 1e-6);
    EXPECT_NEAR(frame.local_from_eye[kRight].position.x, 0.1 + 0.3 * seconds + half, 1e-6);
    EXPECT_NEAR(frame.local_from_eye[kLeft].position.z, 0.2 + 0.2 * seconds, 1e-6);
    EXPECT_EQ(frame.fields[kRight].angleRight, mock().fields[kRight].angleRight);
  }
}

// The test avatar's red grows with the view's x: the pictures themselves say for which view they were decoded.
TEST_F(VrViewerTest, EachEyeHasItsOwnViewAndTexture) {
  mock().eye_distance_m = 0.5f;
  mock().width = mock().height = 400;
  Start();
  const std::array<ImageU8, 2> pictures = Look("eyes");
  const ViewState& state = viewer_->state();
  // Halves of the eyes' distance aside, the target a metre ahead; the head's centre lies a little off it.
  std::array<Vector3d, 2> views;
  for (const size_t eye : {kLeft, kRight}) {
    const Vector3d eye_in_world = Vector3d(eye == kLeft ? -250 : 250, 0, 1000) + state.orbit.target_in_head;
    views[eye] = eye_in_world.normalized();
    EXPECT_LT((viewer_->face().shown().request.views_in_head[eye].cast<double>() - views[eye]).norm(), 1e-4);
  }
  // A point on the forehead, which both eyes see.
  const DecodedViews& shown = viewer_->face().shown();
  Eigen::Index nearest = 0;
  const Vector3d wanted = state.orbit.target_in_head + Vector3d(0, 50, 200);
  (shown.vertices_in_head.cast<double>().rowwise() - wanted.transpose()).rowwise().norm().minCoeff(&nearest);
  const Vector3d point = viewer_->local_from_world() * shown.vertices_in_head.row(nearest).transpose().cast<double>();
  std::array<Eigen::Vector2d, 2> at;
  std::array<double, 2> red = {};
  for (const size_t eye : {kLeft, kRight}) {
    const MockFrame& frame = mock().frames.back();
    at[eye] = CameraOfEye(frame.local_from_eye[eye], frame.fields[eye], 400, 400).Project(point);
    constexpr int kReach = 6;  // pixels: the skin's own pattern is not seen by both eyes in the same places
    for (int dy = -kReach; dy <= kReach; ++dy) {
      for (int dx = -kReach; dx <= kReach; ++dx) {
        const int x = static_cast<int>(at[eye].x()) + dx, y = static_cast<int>(at[eye].y()) + dy;
        red[eye] += pictures[eye].at(x, y)[0] / std::pow(2 * kReach + 1, 2);
      }
    }
  }
  const double expected = kRedForX * (views[kRight].x() - views[kLeft].x());
  EXPECT_GT(expected, 25);
  EXPECT_NEAR(red[kRight] - red[kLeft], expected, 4);
  // What is stored is sRGB-encoded, as it was drawn.
  for (const size_t eye : {kLeft, kRight}) {
    EXPECT_THAT(std::vector<int>(pictures[eye].at(0, 0), pictures[eye].at(0, 0) + 3), ElementsAre(32, 34, 38));
  }
}

TEST_F(VrViewerTest, TheLeftEyeSeesTheFaceFartherRight) {
  mock().fields = {{{-0.7f, 0.7f, 0.7f, -0.7f}, {-0.7f, 0.7f, 0.7f, -0.7f}}};
  mock().width = mock().height = 360;
  Start();
  const std::array<ImageU8, 2> pictures = Look("parallax");
  std::array<double, 2> middle = {};
  for (const size_t eye : {kLeft, kRight}) {
    double sum = 0, count = 0;
    for (int i = 0; i < 360 * 360; ++i) {
      const uint8_t* colour = pictures[eye].at(i % 360, i / 360);
      if (colour[0] == 32 && colour[1] == 34 && colour[2] == 38) continue;
      sum += i % 360;
      ++count;
    }
    ASSERT_GT(count, 500);
    middle[eye] = sum / count;
  }
  // 63 mm a metre away, 180 px being the tangent of 0.7; the face is nearer in front than in its middle.
  const double expected = 0.063 * 180 / std::tan(0.7);
  EXPECT_NEAR(middle[kLeft] - middle[kRight], expected, 0.15 * expected);
}

TEST_F(VrViewerTest, CountsTheDisplaysThatItMisses) {
  Start();
  const auto first = static_cast<size_t>(mock().frames.size() - 1);
  const PacingSummary before = viewer_->pacing().Summary();
  Frames(40);
  const PacingSummary after = viewer_->pacing().Summary();
  EXPECT_EQ(after.frames - before.frames, 40);
  EXPECT_NEAR(after.frames_per_s, 90, 0.01);
  const double displays =
      static_cast<double>(mock().frames.back().display_time - mock().frames[first].display_time) * 90e-9;
  EXPECT_EQ(40 + after.missed - before.missed, std::lround(displays));
}

TEST_F(VrViewerTest, ALateFaceHoldsNoFrameUp) {
  mock().rate_hz = 4000;  // decoding takes longer than the 0.1 ms that it has
  Start();
  mock().speed = {0.2f, 0, 0};  // each frame asks for another face
  const PacingSummary before = viewer_->pacing().Summary();
  Frames(100);
  const PacingSummary after = viewer_->pacing().Summary();
  EXPECT_EQ(after.frames - before.frames, 100);
  EXPECT_GT(after.older_faces, before.older_faces);
  mock().speed = {};
  FramesUntil([&] { return viewer_->face().current(); });  // and it comes in the end
}

TEST_F(VrViewerTest, NothingIsDrawnWhereNothingIsSeen) {
  Start();
  mock().tracked = false;
  Frames(2);
  EXPECT_EQ(LastShown(), nullptr);
  mock().tracked = true;
  Frames(2);
  EXPECT_NE(LastShown(), nullptr);
  mock().Go(XR_SESSION_STATE_SYNCHRONIZED);
  mock().calls.clear();
  Frames(2);
  EXPECT_EQ(LastShown(), nullptr);
  EXPECT_EQ(std::count(mock().calls.begin(), mock().calls.end(), "xrAcquireSwapchainImage"), 0);
}

TEST_F(VrViewerTest, StandsBeforeTheViewerAgain) {
  Start();
  const auto stands = [&] { return Vector3d(viewer_->local_from_world() * viewer_->state().orbit.target_in_head); };
  EXPECT_LT((stands() - Vector3d(100, 1600, -800)).norm(), 0.01);
  mock().local_from_head = ToXrPose({RotationFromYawPitchRoll(M_PI / 2, 0.3, 0), {500, 1200, 0}});
  Frames(2);
  EXPECT_LT((stands() - Vector3d(100, 1600, -800)).norm(), 0.01);
  // The headset's own menu: not before the time that it says.
  const XrTime when = mock().frames.back().display_time + static_cast<XrTime>(10 * 1e9 / 90);
  mock().Recentre(when);
  FramesUntil([&] { return mock().frames.back().display_time >= when; });
  EXPECT_LT((stands() - Vector3d(-500, 1200, 0)).norm(), 0.1);
  // A controller's button.
  mock().local_from_head.position = {0, 1, 0};
  mock().hands[kRight].tracked = true;
  Press(&MockHand::recentre, kRight);
  EXPECT_LT((stands() - Vector3d(-1000, 1000, 0)).norm(), 0.1);
}

TEST_F(VrViewerTest, TheMenuPlaysAndPauses) {
  mock().width = 700;
  mock().height = 700;
  Start();
  PointAt(-42, 0);  // Play
  Frames(3);
  Look("menu");
  Press(&MockHand::select, kRight);
  EXPECT_TRUE(viewer_->state().playback.playing);
  EXPECT_EQ(viewer_->state().clip, 0);
  const double time_s = viewer_->state().playback.time_s;
  Frames(2);
  EXPECT_NE(viewer_->state().playback.time_s, time_s);
  Press(&MockHand::select, kRight);
  EXPECT_FALSE(viewer_->state().playback.playing);
  PointAt(42, 0);  // Next
  Press(&MockHand::select, kRight);
  EXPECT_EQ(viewer_->state().clip, 1);
  mock().local_from_head.position = {0, 1.5f, 0};
  PointAt(0, -22);  // Bring here
  Press(&MockHand::select, kRight);
  EXPECT_LT((viewer_->local_from_world() * viewer_->state().orbit.target_in_head - Vector3d(0, 1500, -1000)).norm(),
            0.1);
}

TEST_F(VrViewerTest, TheMenuHidesAndChangesHands) {
  Start();
  PointAt(-42, 0);
  Press(&MockHand::menu, kLeft);  // hidden
  Press(&MockHand::select, kRight);
  EXPECT_FALSE(viewer_->state().playback.playing);
  Press(&MockHand::menu, kLeft);
  Press(&MockHand::select, kRight);
  EXPECT_TRUE(viewer_->state().playback.playing);
  // In the other hand the first one points.
  std::swap(mock().hands[kLeft], mock().hands[kRight]);
  Press(&MockHand::menu, kRight);
  Press(&MockHand::select, kLeft);
  EXPECT_FALSE(viewer_->state().playback.playing);
}

TEST_F(VrViewerTest, RestsWhileTheHeadsetIsOff) {
  Start();
  mock().TakeOff();
  FramesUntil([&] { return viewer_->phase() == VrSession::Phase::kIdle; });
  EXPECT_FALSE(mock().running);
  const size_t frames = mock().frames.size();
  Frames(2);
  EXPECT_EQ(mock().frames.size(), frames);
  mock().PutOn();
  FramesUntil([&] { return mock().frames.size() > frames + 3 && LastShown() != nullptr; });
  EXPECT_EQ(mock().sessions, 1);
}

TEST_F(VrViewerTest, ComesBackAfterALoss) {
  Start();
  mock().Go(XR_SESSION_STATE_LOSS_PENDING);
  mock().connected = false;
  Frames(1);
  EXPECT_EQ(viewer_->phase(), VrSession::Phase::kLost);
  EXPECT_EQ(mock().session, XR_NULL_HANDLE);
  EXPECT_EQ(mock().instance, XR_NULL_HANDLE);
  Frames(30);  // of waiting: more than a second, with a try that fails
  EXPECT_EQ(viewer_->phase(), VrSession::Phase::kLost);
  mock().connected = true;
  const size_t frames = mock().frames.size();
  FramesUntil([&] { return mock().frames.size() > frames + 3 && LastShown() != nullptr; });
  EXPECT_EQ(mock().sessions, 2);
}

TEST_F(VrViewerTest, ComesBackWhenCallsFail) {
  Start();
  mock().lost = true;
  FramesUntil([&] { return mock().sessions == 2 && LastShown() != nullptr && mock().running; });
}

TEST_F(VrViewerTest, EndsAsAsked) {
  Start();
  viewer_->Quit();
  int frames = 0;
  while (viewer_->Frame() && frames < kMostFrames) ++frames;
  EXPECT_LT(frames, 10);
  std::vector<std::string> calls;
  for (const std::string& call : mock().calls) {
    if (call == "xrRequestExitSession" || call == "xrEndSession") calls.push_back(call);
  }
  EXPECT_THAT(calls, ElementsAre("xrRequestExitSession", "xrEndSession"));
  viewer_.reset();
  EXPECT_THAT(std::vector<std::string>(mock().calls.end() - 2, mock().calls.end()),
              ElementsAre("xrDestroySession", "xrDestroyInstance"));
}

TEST_F(VrViewerTest, EndsWhenTheHeadsetsMenuEndsIt) {
  Start();
  mock().exiting = true;
  mock().TakeOff();
  int frames = 0;
  while (viewer_->Frame() && frames < kMostFrames) ++frames;
  EXPECT_LT(frames, 10);
}

}  // namespace
}  // namespace likeness
