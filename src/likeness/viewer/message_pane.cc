#include <imgui.h>

#include <algorithm>

#include "likeness/viewer/panes.h"

namespace likeness {

void DrawMessagePane(const Box& face, ViewState* state) {
  if (state->message.empty()) return;
  const float letter = ImGui::GetFontSize();
  ImGui::SetNextWindowPos(ImVec2(face.x + face.width / 2, face.y + letter), ImGuiCond_Always, ImVec2(0.5f, 0));
  ImGui::SetNextWindowSize(ImVec2(std::min(face.width - 2 * letter, 40 * letter), 0));
  ImGui::Begin("Message", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
  ImGui::TextWrapped("%s", state->message.c_str());
  const bool close = ImGui::Button("Close (Esc)");
  ImGui::End();
  if (close) state->message.clear();
}

}  // namespace likeness
