#include "likeness/xr/menu.h"

#include <imgui.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <string>

#include "likeness/viewer/theme.h"

namespace likeness {
namespace {

constexpr double kPixelsPerMm = 4;  // at arm's length a headset shows fewer
constexpr int kWidth = static_cast<int>(VrMenu::kWidthMm * kPixelsPerMm);
constexpr int kHeight = static_cast<int>(VrMenu::kHeightMm * kPixelsPerMm);
constexpr float kScale = 2.4f;  // of letters and buttons, to be hit by an unsteady hand

// The window has a Dear ImGui of its own, which is current before and after.
class CurrentImGui {
 public:
  explicit CurrentImGui(ImGuiContext* context) : before_(ImGui::GetCurrentContext()) {
    ImGui::SetCurrentContext(context);
  }
  ~CurrentImGui() { ImGui::SetCurrentContext(before_); }
  CurrentImGui(const CurrentImGui&) = delete;
  CurrentImGui& operator=(const CurrentImGui&) = delete;

 private:
  ImGuiContext* before_;
};

void NextClip(ViewState* state) {
  if (state->ClipCount() > 0) state->PlayClip((state->clip + 1) % state->ClipCount());
}

bool DrawButtons(ViewState* state) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float width = (ImGui::GetContentRegionAvail().x - gap) / 2, height = ImGui::GetFrameHeight() * 1.35f;
  // The id stays while the words change: what is pressed is released on the same button.
  if (ImGui::Button(state->playback.playing ? "Pause###play" : "Play###play", ImVec2(width, height))) {
    state->PlayOrPause();
  }
  ImGui::SameLine();
  if (ImGui::Button("Next", ImVec2(-1, height))) NextClip(state);
  return ImGui::Button("Bring here", ImVec2(-1, height));
}

}  // namespace

VrMenu::VrMenu(const GlFunctions& gl)
    : gl_(&gl),
      texture_(MakeTexture(gl, GL_RGBA8, kWidth, kHeight)),
      framebuffer_(MakeFramebuffer(gl)),
      context_(ImGui::CreateContext()) {
  gl.BindTexture(GL_TEXTURE_2D, texture());
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.BindTexture(GL_TEXTURE_2D, 0);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture(), 0);
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
  const CurrentImGui current(context_);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  io.DisplaySize = ImVec2(kWidth, kHeight);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  LoadFont(kScale, 1);
  ApplyTheme(true, kScale);
}

VrMenu::~VrMenu() {
  const CurrentImGui current(context_);
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext(context_);
}

bool VrMenu::Update(const std::optional<Eigen::Vector2d>& pointer_mm, bool pressed, double elapsed_s,
                    ViewState* state) {
  const CurrentImGui current(context_);
  ImGuiIO& io = ImGui::GetIO();
  io.DeltaTime = std::max(static_cast<float>(elapsed_s), 1e-4f);  // Dear ImGui takes no 0
  io.MousePos = ImVec2(-1e6f, -1e6f);
  if (pointer_mm) {
    io.MousePos = ImVec2(static_cast<float>(kWidth / 2.0 + pointer_mm->x() * kPixelsPerMm),
                         static_cast<float>(kHeight / 2.0 - pointer_mm->y() * kPixelsPerMm));
  }
  io.MouseDown[0] = pressed;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  ImGui::SetNextWindowPos(ImVec2(0, 0));
  ImGui::SetNextWindowSize(io.DisplaySize);
  ImGui::Begin("menu", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  ImGui::TextUnformatted(state->FrameName().c_str());
  const Clip* const clip = state->CurrentClip();
  const double played = clip != nullptr && clip->DurationS() > 0 ? state->playback.time_s / clip->DurationS() : 0;
  ImGui::ProgressBar(static_cast<float>(played), ImVec2(-1, ImGui::GetFontSize() / 3), "");
  const bool bring_here = DrawButtons(state);
  ImGui::End();
  ImGui::Render();

  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  gl_->ClearColor(0, 0, 0, 0);
  gl_->Clear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_->BindTexture(GL_TEXTURE_2D, texture());
  gl_->GenerateMipmap(GL_TEXTURE_2D);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
  return bring_here;
}

}  // namespace likeness
