// The window under a virtual screen, with real input: what it shows is compared with the CPU's renderer and with what
// the state says. LIKENESS_TEST_PICTURES=FOLDER keeps the pictures for looking at.

#include "likeness/viewer/viewer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <set>
#include <thread>
#include <tuple>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/render/rasterizer.h"
#include "likeness/viewer/test_avatar.h"
#include "likeness/viewer/test_screen.h"

namespace likeness {
namespace {

using testing::HasSubstr;

ImageU8 Crop(const ImageU8& picture, const Box& box) {
  ImageU8 crop(static_cast<int>(box.width), static_cast<int>(box.height), 3);
  for (int y = 0; y < crop.height(); ++y) {
    const uint8_t* from = picture.at(static_cast<int>(box.x), static_cast<int>(box.y) + y);
    std::copy_n(from, 3 * crop.width(), crop.row(y));
  }
  return crop;
}

int CountColours(const ImageU8& picture) {
  std::set<std::tuple<int, int, int>> colours;
  for (int i = 0; i < picture.width() * picture.height(); ++i) {
    const uint8_t* c = picture.at(i % picture.width(), i / picture.width());
    colours.insert({c[0], c[1], c[2]});
  }
  return static_cast<int>(colours.size());
}

// Share of the pixels that differ by more than the rounding of edges that come to lie a fraction of a pixel elsewhere.
double ShareChanged(const ImageU8& a, const ImageU8& b) {
  int changed = 0;
  for (int i = 0; i < a.width() * a.height(); ++i) {
    bool differs = false;
    for (int c = 3 * i; c < 3 * i + 3; ++c) differs = differs || std::abs(a.values()[c] - b.values()[c]) > 3;
    changed += differs;
  }
  return static_cast<double>(changed) / (a.width() * a.height());
}

class ViewerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!TestScreen::Available()) return;
    screen_ = new TestScreen;
    scratch_ = new ScratchFolder;
    SaveAvatar(AvatarFile(), MakeTestAvatar());
  }
  static void TearDownTestSuite() {
    delete screen_;
    delete scratch_;
    screen_ = nullptr;
    scratch_ = nullptr;
  }
  void SetUp() override {
    if (screen_ == nullptr) GTEST_SKIP() << "Xvfb or xdotool absent; scripts/setup installs them";
  }

  static std::filesystem::path AvatarFile() { return *scratch_ / "avatar.safetensors"; }

  void Start(ViewerOptions options = {}) {
    options.size = {{1000, 700}};
    options.window.place.x = options.window.place.y = 0;
    options.window.scale = 1;
    viewer_ = std::make_unique<Viewer>(options);
    Settle();
  }
  void StartWithAvatar(ViewerOptions options = {}) {
    options.avatar = AvatarFile();
    Start(options);
    ASSERT_NE(state().avatar, nullptr) << state().message;
  }

  // Frames until the window shows what the state says; Dear ImGui needs a few to lay out its panes.
  ImageU8 Settle() {
    ImageU8 picture;
    for (int settled = 0, frames = 0; settled < 3 && frames < 1000; ++frames) {
      viewer_->Frame(&picture);
      settled = viewer_->Settled() && !state().playback.playing ? settled + 1 : 0;
    }
    return picture;
  }
  ImageU8 Do(const std::string& xdotool) {
    screen_->Do(xdotool);
    std::this_thread::sleep_for(std::chrono::milliseconds(30));  // for the screen to pass it on
    return Settle();
  }
  static void Keep(const std::string& name, const ImageU8& picture) {
    const char* folder = std::getenv("LIKENESS_TEST_PICTURES");
    if (folder != nullptr) WritePng(std::filesystem::path(folder) / (name + ".png"), picture);
  }

  ViewState& state() { return viewer_->state(); }

  // Compares what an eye sees with the CPU's picture of the same texture, where neighbours are on the same piece of it
  // and at most a texel apart: OpenGL mixes smaller texels, the CPU's plain renderer does not.
  void ExpectAsOnCpu(const ImageU8& picture, size_t eye_index) {
    const EyeView eye = viewer_->FaceEyes()[eye_index];
    const DecodedViews& shown = viewer_->shown();
    const MeshTopology& topology = shown.avatar->topology;
    const int size = shown.avatar->architecture.texture_size;
    const std::vector<uint8_t>& rgba = shown.textures[std::min(eye_index, shown.textures.size() - 1)];
    ImageF texture(size, size, 3);
    for (int i = 0; i < size * size; ++i) std::copy_n(&rgba[4 * i], 3, texture.at(i % size, i / size));
    DrawOptions options;
    options.supersample = 1;
    const ImageU8 expected =
        DrawMesh(shown.vertices_in_head, topology, texture, eye.camera, HeadPose(state()), options).colour;
    const FragmentImage fragments =
        Rasterize(shown.vertices_in_head, topology.triangles, eye.camera, HeadPose(state()));
    const auto texel_at = [&](const Fragment& f) -> Eigen::Vector2f {
      const Eigen::Vector3i& corners = topology.triangle_uvs[f.triangle];
      return static_cast<float>(size) * ((1 - f.b1 - f.b2) * topology.uvs[corners[0]] +
                                         f.b1 * topology.uvs[corners[1]] + f.b2 * topology.uvs[corners[2]]);
    };
    const auto is_plain = [&](int x, int y) {
      if (fragments.at(x, y).triangle < 0) return false;
      const Eigen::Vector2f here = texel_at(fragments.at(x, y));
      for (int i = 0; i < 9; ++i) {
        const Fragment& other = fragments.at(x + i % 3 - 1, y + i / 3 - 1);
        if (other.triangle < 0 || (texel_at(other) - here).norm() > 1) return false;
      }
      return true;
    };
    const int left = static_cast<int>(viewer_->FaceBox().x) + eye.x;  // asks the window, which is slow
    int compared = 0, differing = 0;
    for (int y = 2; y + 2 < expected.height(); ++y) {
      for (int x = 2; x + 2 < expected.width(); ++x) {
        if (!is_plain(x, y)) continue;
        ++compared;
        const uint8_t* ours = picture.at(left + x, y);
        // 4 for sampling (render/gl/mesh_renderer_test.cc), 1 for samples of a pixel that two triangles share.
        for (int c = 0; c < 3; ++c) differing += std::abs(ours[c] - expected.at(x, y)[c]) > 5;
      }
    }
    EXPECT_GT(compared, 20000);
    // Single pixels where a triangle hides another: eyelids, lips.
    EXPECT_LE(differing, compared / 1000);
  }

  static TestScreen* screen_;
  static ScratchFolder* scratch_;
  std::unique_ptr<Viewer> viewer_;
};

TestScreen* ViewerTest::screen_ = nullptr;
ScratchFolder* ViewerTest::scratch_ = nullptr;

TEST_F(ViewerTest, ShowsWhatTheCpuDraws) {
  ViewerOptions options;
  options.opened = [](ViewState* opened) {
    opened->GoTo("smile/002");
    opened->orbit.azimuth_deg = 25;
  };
  StartWithAvatar(options);
  const ImageU8 picture = Settle();
  Keep("avatar", picture);
  ExpectAsOnCpu(picture, 0);
  const WindowLayout layout = LayOut(1000, 700, 1, true, true);
  EXPECT_GT(CountColours(Crop(picture, layout.controls)), 100);  // smooth letters
  EXPECT_GT(CountColours(Crop(picture, layout.timeline)), 50);
}

TEST_F(ViewerTest, TheMouseTurnsMovesAndZooms) {
  StartWithAvatar();
  const Orbit before = state().orbit;
  const float height = viewer_->FaceBox().height;
  Do("mousemove 600 300");
  Do("mousedown 1");
  Do("mousemove 700 340");
  Do("mouseup 1");
  EXPECT_NEAR(state().orbit.azimuth_deg, before.azimuth_deg - 180 * 100 / height, 1e-6);
  EXPECT_NEAR(state().orbit.elevation_deg, before.elevation_deg + 180 * 40 / height, 1e-6);
  const ImageU8 turned = Do("mousemove 100 650");  // nothing is held
  EXPECT_NEAR(state().orbit.azimuth_deg, before.azimuth_deg - 180 * 100 / height, 1e-6);
  ExpectAsOnCpu(turned, 0);

  const Orbit turned_orbit = state().orbit;
  Do("mousemove 600 300");
  Do("mousedown 3");
  Do("mousemove 630 310");
  Do("mouseup 3");
  const Camera camera = viewer_->FaceEyes()[0].camera;
  const Eigen::Vector2d target = camera.Project(turned_orbit.target_in_head);
  EXPECT_NEAR(target.x(), camera.width / 2.0 + 30, 0.01);
  EXPECT_NEAR(target.y(), camera.height / 2.0 + 10, 0.01);

  Do("click 4");  // the wheel, one step away
  EXPECT_NEAR(state().orbit.distance_mm, before.distance_mm * std::exp(-0.12), 1e-6);
  Do("mousemove 100 300");
  Do("click 4");  // over the controls it is theirs
  EXPECT_NEAR(state().orbit.distance_mm, before.distance_mm * std::exp(-0.12), 1e-6);
}

TEST_F(ViewerTest, KeysDoWhatTheHelpSays) {
  StartWithAvatar();
  const ImageU8 plain = Do("mousemove 990 10");  // over nothing that would light up
  const Box face = viewer_->FaceBox();
  const ImageU8 stereo = Do("key s");
  Keep("stereo", stereo);
  ASSERT_TRUE(state().stereo);
  ASSERT_EQ(viewer_->shown().textures.size(), 2u);
  ExpectAsOnCpu(stereo, 0);
  ExpectAsOnCpu(stereo, 1);
  Do("key s");

  const ImageU8 both = Do("key w");
  Keep("both", both);
  EXPECT_EQ(state().surface, MeshFill::kTextureAndLines);
  const ImageU8 lines = Do("key w");
  Keep("wireframe", lines);
  EXPECT_GT(ShareChanged(Crop(plain, face), Crop(lines, face)), 0.1);
  Do("key w");
  EXPECT_EQ(state().surface, MeshFill::kTexture);

  const ImageU8 help = Do("key h");
  Keep("help", help);
  EXPECT_TRUE(state().show_help);
  EXPECT_GT(ShareChanged(plain, help), 0.1);
  const ImageU8 after = Do("key Escape mousemove 990 10");
  Keep("plain", plain);
  Keep("after", after);
  EXPECT_EQ(ShareChanged(plain, after), 0);  // all is as it was

  Do("key v");
  EXPECT_FALSE(state().view_dependent);
  const ImageU8 light = Do("key d");
  Keep("light", light);
  EXPECT_GT(ShareChanged(plain, light), 0.2);
  Do("key n");
  EXPECT_NE(state().sliders, std::vector<float>(3));
  Do("key 0 key Tab");
  EXPECT_EQ(state().sliders, std::vector<float>(3));
  EXPECT_EQ(viewer_->FaceBox().width, 1000);
}

TEST_F(ViewerTest, PlaysAndSteps) {
  StartWithAvatar();
  screen_->Do("key space");
  const DecodeRequest rest = viewer_->shown().request;
  for (int i = 0; i < 1000 && viewer_->shown().request == rest; ++i) viewer_->Frame();
  EXPECT_TRUE(state().playback.playing);
  EXPECT_EQ(state().clip, 0);
  EXPECT_NE(viewer_->shown().request, rest);  // other codes are decoded while it plays
  screen_->Do("key space");
  for (int i = 0; i < 1000 && state().playback.playing; ++i) viewer_->Frame();
  state().GoTo("jaw/001");
  Do("key Right");
  EXPECT_EQ(state().FrameName(), "jaw/002 (2 of 3)");
  Do("key Left key Left");
  EXPECT_EQ(state().FrameName(), "jaw/003 (3 of 3)");  // around the beginning
  EXPECT_FLOAT_EQ(viewer_->shown().request.code[0], 1);
}

TEST_F(ViewerTest, PanesShowTextureUvsAndTimes) {
  ViewerOptions options;
  options.state.show_texture = options.state.show_uvs = true;
  StartWithAvatar(options);
  const ImageU8 panes = Settle();
  Keep("panes", panes);
  // The texture pane lies in the face's upper right corner, its middle shows the texture's.
  const int size = viewer_->shown().avatar->architecture.texture_size;
  const std::vector<uint8_t>& rgba = viewer_->shown().textures[0];
  const uint8_t* shown = panes.at(1000 - 12 - 150, 12 + 150);
  for (int c = 0; c < 3; ++c) {
    int least = 255, most = 0;  // of the texels around, as the pane's borders shift it a little
    for (int dy = -8; dy <= 8; ++dy) {
      for (int dx = -8; dx <= 8; ++dx) {
        const int value = rgba[4 * ((size / 2 + dy) * size + size / 2 + dx) + c];
        least = std::min(least, value);
        most = std::max(most, value);
      }
    }
    EXPECT_GE(shown[c] + 1, least);
    EXPECT_LE(shown[c] - 1, most);
  }
  state().show_timing = true;
  state().show_texture = state().show_uvs = false;
  ImageU8 times;
  for (int i = 0; i < 20; ++i) viewer_->Frame(&times);
  Keep("times", times);
  EXPECT_GT(ShareChanged(panes, times), 0.1);
  state().show_timing = false;
}

TEST_F(ViewerTest, WelcomesAndOpensWhatIsTyped) {
  Start();
  const ImageU8 welcome = Settle();
  Keep("welcome", welcome);
  EXPECT_GT(CountColours(welcome), 50);
  state().wishes.open = *scratch_ / "absent.safetensors";  // as a drop does
  const ImageU8 message = Settle();
  Keep("message", message);
  EXPECT_THAT(state().message, HasSubstr("absent.safetensors"));
  EXPECT_GT(ShareChanged(welcome, message), 0.02);
  Do("key Escape");
  EXPECT_EQ(state().message, "");
  Do("mousemove 400 360 click 1");
  Do("type --delay 1 " + AvatarFile().string());
  Keep("typed", Settle());
  Do("keydown Return");  // Dear ImGui looks at keys once a frame
  Do("keyup Return");
  ASSERT_NE(state().avatar, nullptr) << state().message;
  ExpectAsOnCpu(Settle(), 0);
  EXPECT_FALSE(state().show_help);  // letters that were typed are no keys

  // A wrong file leaves what is shown.
  state().wishes.open = std::string(__FILE__);
  Settle();
  EXPECT_THAT(state().message, HasSubstr("viewer_test.cc"));
  EXPECT_NE(state().avatar, nullptr);
}

TEST_F(ViewerTest, DrawsOneFrameForAFile) {
  ViewerOptions options;
  options.avatar = AvatarFile();
  options.size = {{640, 400}};
  options.window.visible = false;
  options.window.scale = 2;  // as on a screen of fine pixels
  const ImageU8 picture = DrawViewer(options);
  Keep("fine", picture);
  EXPECT_EQ(picture.width(), 640);
  EXPECT_GT(CountColours(picture), 500);
  options.avatar = *scratch_ / "absent.safetensors";
  EXPECT_THAT(ErrorOf([&] { DrawViewer(options); }), HasSubstr("absent.safetensors"));
}

}  // namespace
}  // namespace likeness
