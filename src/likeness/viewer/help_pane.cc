#include <imgui.h>

#include "likeness/viewer/keys.h"
#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

void Row(const char* name, const char* what) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextUnformatted(name);
  ImGui::TableNextColumn();
  ImGui::TextUnformatted(what);
}

}  // namespace

void DrawHelpPane(ViewState* state) {
  if (!state->show_help) return;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(screen.x / 2, screen.y / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
  if (ImGui::Begin("Help", &state->show_help,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove)) {
    if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
      Row("drag", "turn the head");
      Row("right drag, Shift drag", "move it");
      Row("wheel", "nearer, farther");
      Row("drop a file", "open an avatar or a performance");
      for (const KeyBinding& binding : KeyBindings()) {
        if (*binding.name != '\0') Row(binding.name, binding.what);
      }
      ImGui::EndTable();
    }
  }
  ImGui::End();
}

}  // namespace likeness
