#include "likeness/viewer/viewer.h"

#include <fmt/chrono.h>
#include <imgui.h>

#include <cmath>
#include <ctime>
#include <tuple>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/image/image_io.h"
#include "likeness/viewer/keys.h"

namespace likeness {
namespace {

// Frames that are drawn after the last event: Dear ImGui needs two to settle.
constexpr int kFramesAfterEvent = 3;
constexpr double kIdleWaitS = 0.5;
constexpr double kMostStepS = 0.25;  // of playing: a window that was held still does not jump

constexpr int kLeastSide = 200, kMostSide = 8192;  // of a window, in screen coordinates

bool InRange(int side) { return side >= kLeastSide && side <= kMostSide; }

double MsBetween(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

bool IsEvent(const WindowInput& input) {
  return !input.keys.empty() || !input.dropped.empty() || input.wheel != 0 || input.turn_right != 0 ||
         input.turn_down != 0 || input.pan_right != 0 || input.pan_down != 0;
}

WindowOptions WindowFor(const ViewerOptions& options) {
  WindowOptions window = options.window;
  if (options.size)
    std::tie(window.place.width, window.place.height) = std::tie((*options.size)[0], (*options.size)[1]);
  return window;
}

const ViewerOptions& Checked(const ViewerOptions& options) {
  options.Check();
  return options;
}

}  // namespace

void ViewerOptions::Check() const {
  if (samples < 1 || samples > 16) throw Error("samples is {}; expected 1 to 16 a pixel", samples);
  if (size && (!InRange((*size)[0]) || !InRange((*size)[1]))) {
    throw Error("a window of {} x {} cannot be; expected {} to {} a side", (*size)[0], (*size)[1], kLeastSide,
                kMostSide);
  }
  LIKENESS_CHECK(state.avatar == nullptr);
}

Viewer::Viewer(const ViewerOptions& options)
    : options_(Checked(options)),
      window_(WindowFor(options)),
      gl_(Window::FunctionAddress, 3, 3),
      state_(options.state),
      recent_(options.recent),
      renderer_(gl_),
      textures_{GlTextureStream(gl_), GlTextureStream(gl_)},
      uv_layout_(gl_),
      decoding_(Window::Wake) {
  state_.dark = options.dark.value_or(true);
  state_.wishes.open = options.avatar;
  state_.wishes.person = options.person;
}

bool Viewer::Frame(ImageU8* picture) {
  const double wait_s = WaitS();
  const WindowInput input = window_.BeginFrame(wait_s);
  const Clock::time_point began = Clock::now();
  now_.total = MsBetween(frame_began_, began);
  times_.Add(now_);
  frame_began_ = began;
  // Waiting ends early for an event, be it the mouse that passes over a button.
  const bool event = wait_s > 0 && now_.total < 1000 * wait_s;
  idle_frames_ = event || IsEvent(input) || ImGui::IsAnyMouseDown() ? 0 : idle_frames_ + 1;
  Listen(input);
  TakeNews();
  FulfilWishes();
  Advance();
  window_.SetDark(state_.dark);
  if (window_.width() > 0 && window_.height() > 0) {
    AskForFace();
    Lap();
    UploadFace();
    now_.upload = Lap();
    DrawFace();
    now_.draw = Lap();
    if (std::exchange(state_.wishes.screenshot, false)) SavePicture();
  }
  DrawPanes();
  window_.DrawInterface();
  now_.interface = Lap();
  if (picture != nullptr) *picture = ReadFramebuffer(gl_, 0, 0, 0, window_.width(), window_.height());
  window_.Swap();
  return !window_.Closing();
}

double Viewer::WaitS() const {
  // The decoding thread sends an event when it has something.
  const bool lively =
      state_.playback.playing || state_.show_timing || !state_.wishes.open.empty() || idle_frames_ < kFramesAfterEvent;
  return lively ? 0 : kIdleWaitS;
}

bool Viewer::Settled() const {
  if (!state_.wishes.open.empty() || decoding_.Busy()) return false;
  return state_.avatar == nullptr || (faces_ > 0 && shown_.avatar == state_.avatar && shown_.request == asked_);
}

void Viewer::Listen(const WindowInput& input) {
  for (const int key : input.keys) PressKey(key, &state_);
  if (!input.dropped.empty()) state_.wishes.open = input.dropped.back();
  if (state_.avatar == nullptr) return;
  const int height = static_cast<int>(CurrentLayout().face.height);
  state_.orbit.Turn(input.turn_right, input.turn_down, height);
  state_.orbit.Pan(input.pan_right, input.pan_down, height);
  state_.orbit.Zoom(input.wheel);
}

void Viewer::FulfilWishes() {
  if (!state_.wishes.open.empty()) {
    Open(std::exchange(state_.wishes.open, {}), std::exchange(state_.wishes.person, ""));
  }
  if (state_.wishes.quit) window_.Close();
}

void Viewer::Open(const std::filesystem::path& path, const std::string& person) {
  try {
    if (!IsPerformance(path)) {
      decoding_.Open(path, person);
    } else if (state_.avatar != nullptr) {
      state_.performances.push_back(OpenPerformance(path, *state_.avatar));
      state_.PlayClip(state_.ClipCount() - 1);
    } else {
      state_.message = fmt::format("{} is a performance; open the avatar that gives it first", path.string());
    }
  } catch (const Error& error) {  // a wrong file is no reason to end
    state_.message = error.what();
  }
}

void Viewer::TakeNews() {
  if (std::string error = decoding_.TakeError(); !error.empty()) state_.message = std::move(error);
  std::shared_ptr<const ViewedAvatar> avatar = decoding_.TakeOpened();
  if (avatar == nullptr) return;
  state_.message.clear();
  opened_files_.push_back(avatar->file);
  state_.Show(std::move(avatar));
  if (!std::exchange(opened_once_, true) && options_.opened) options_.opened(&state_);
}

void Viewer::Advance() {
  const Clip* clip = state_.CurrentClip();
  if (clip != nullptr) state_.playback.Advance(std::min(now_.total / 1000, kMostStepS), clip->DurationS());
}

WindowLayout Viewer::CurrentLayout() const {
  const float unit = window_.pixels_a_unit();
  const bool avatar = state_.avatar != nullptr;
  return LayOut(static_cast<float>(window_.width()) / unit, static_cast<float>(window_.height()) / unit,
                window_.scale(), avatar && state_.show_controls, avatar && state_.show_controls);
}

Box Viewer::FaceBox() const {
  const Box face = CurrentLayout().face;
  const float unit = window_.pixels_a_unit();
  return {std::round(face.x * unit), 0, std::round(face.width * unit), std::round(face.height * unit)};
}

std::vector<EyeView> Viewer::FaceEyes() const {
  const Box box = FaceBox();
  return EyesOf(state_.orbit, static_cast<int>(box.width), static_cast<int>(box.height), state_.stereo,
                state_.eye_distance_mm);
}

void Viewer::AskForFace() {
  if (state_.avatar == nullptr) return;
  DecodeRequest request = RequestFor(state_, FaceEyes());
  if (request == asked_ && state_.avatar == asked_avatar_) return;
  asked_ = request;
  asked_avatar_ = state_.avatar;
  decoding_.Decode(state_.avatar, std::move(request));
}

void Viewer::UploadFace() {
  if (!decoding_.TakeViews(&shown_) || shown_.avatar != state_.avatar) return;
  if (shown_.avatar != uploaded_avatar_) {
    renderer_.SetTopology(shown_.avatar->topology);
    uv_layout_.Upload(shown_.avatar->uv_layout.values().data(), shown_.avatar->uv_layout.width());
    uploaded_avatar_ = shown_.avatar;
  }
  renderer_.SetVertices(shown_.vertices_in_head);
  for (size_t i = 0; i < shown_.textures.size(); ++i) {
    textures_[i].Upload(shown_.textures[i].data(), shown_.avatar->architecture.texture_size);
  }
  now_.decode = shown_.decode_ms;
  ++faces_;
}

void Viewer::DrawFace() {
  const Box box = FaceBox();
  const int width = static_cast<int>(box.width), height = static_cast<int>(box.height);
  if (!canvas_ || canvas_->width() != width || canvas_->height() != height) {
    canvas_.emplace(gl_, width, height, options_.samples);
    drawn_ = {};
  }
  const RigidTransform head = HeadPose(state_);
  const bool has_face = state_.avatar != nullptr && shown_.avatar == state_.avatar;
  const Drawn wanted = {.orbit = state_.orbit,
                        .stereo = state_.stereo,
                        .eye_distance_mm = state_.eye_distance_mm,
                        .exposure_stops = state_.exposure_stops,
                        .surface = state_.surface,
                        .background = state_.background,
                        .width = width,
                        .height = height,
                        .face = has_face ? faces_ : -1,
                        .head_rotation = head.rotation,
                        .head_translation = head.translation};
  if (!(wanted == drawn_)) {
    drawn_ = wanted;
    canvas_->Begin(state_.background);
    MeshStyle style;
    style.surface = state_.surface;
    style.exposure = static_cast<float>(std::exp2(state_.exposure_stops));
    const std::vector<EyeView> eyes = FaceEyes();
    for (size_t i = 0; has_face && i < eyes.size(); ++i) {
      const size_t texture = std::min(i, shown_.textures.size() - 1);
      renderer_.Draw(textures_[texture].id(), eyes[i].camera, head, eyes[i].x, style);
    }
    canvas_->End();
  }
  canvas_->CopyTo(0, static_cast<int>(box.x), window_.height() - height);
}

void Viewer::DrawPanes() {
  const WindowLayout layout = CurrentLayout();
  if (state_.avatar == nullptr) {
    DrawWelcomePane(recent_, decoding_.Busy(), &typed_path_, &state_);
  } else {
    DrawControlsPane(layout.controls, &state_);
    DrawTimelinePane(layout.timeline, window_.scale(), &state_);
    ShownTextures textures;
    for (size_t i = 0; i < shown_.textures.size(); ++i) textures.eyes.push_back(textures_[i].id());
    textures.uv_layout = uv_layout_.id();
    DrawTexturePanes(layout.face, window_.scale(), textures, &state_);
    DrawTimingPane(layout.face, window_.scale(), times_, state_.avatar->decoder->kernel(), &state_);
  }
  DrawHelpPane(&state_);
  DrawMessagePane(layout.face, &state_);
}

void Viewer::SavePicture() {
  const std::filesystem::path file = fmt::format("likeness-{:%Y%m%d-%H%M%S}.png", fmt::localtime(std::time(nullptr)));
  try {
    WritePng(file, canvas_->Read());
    state_.message = fmt::format("Saved {}", std::filesystem::absolute(file).string());
  } catch (const Error& error) {  // the window goes on
    state_.message = error.what();
  }
}

double Viewer::Lap() {
  if (state_.show_timing) gl_.Finish();
  const Clock::time_point now = Clock::now();
  return MsBetween(std::exchange(lap_began_, now), now);
}

}  // namespace likeness
