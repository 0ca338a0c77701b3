#include <imgui.h>
#include <imgui_stdlib.h>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kWidthInLetters = 34;  // of the font's height

void DrawRecent(const std::vector<std::filesystem::path>& recent, ViewState* state) {
  if (recent.empty()) return;
  ImGui::Spacing();
  ImGui::TextDisabled("Opened before");
  for (const std::filesystem::path& path : recent) {
    if (ImGui::Selectable(path.c_str())) state->wishes.open = path;
  }
}

}  // namespace

void DrawWelcomePane(const std::vector<std::filesystem::path>& recent, bool opening, std::string* typed,
                     ViewState* state) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(screen.x / 2, screen.y / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
  ImGui::SetNextWindowSize(ImVec2(kWidthInLetters * ImGui::GetFontSize(), 0));
  ImGui::Begin("Welcome", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
  ImGui::Text("Likeness");
  ImGui::Separator();
  ImGui::TextWrapped(
      "Drop an avatar on this window, or type where it is: a .safetensors file, or the folder of its "
      "training run.");
  ImGui::Spacing();
  ImGui::SetNextItemWidth(-5 * ImGui::GetFontSize());
  const bool entered = ImGui::InputTextWithHint("##path", "avatars/demo", typed, ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if ((ImGui::Button("Open", ImVec2(-1, 0)) || entered) && !typed->empty()) state->wishes.open = *typed;
  if (opening) ImGui::TextDisabled("Opening ...");
  DrawRecent(recent, state);
  ImGui::Spacing();
  ImGui::TextDisabled("No avatar yet? scripts/demo makes one from nothing in twenty minutes.");
  ImGui::TextDisabled("H shows what the mouse and the keys do.");
  ImGui::End();
}

}  // namespace likeness
