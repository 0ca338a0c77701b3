#include <fmt/format.h>
#include <imgui.h>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

void DrawPeople(ViewState* state) {
  const ViewedAvatar& avatar = *state->avatar;
  if (avatar.people.size() < 2) return;
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::BeginCombo("##person", avatar.people[static_cast<size_t>(avatar.person)].c_str())) return;
  for (size_t i = 0; i < avatar.people.size(); ++i) {
    const bool shown = static_cast<int>(i) == avatar.person;
    if (ImGui::Selectable(avatar.people[i].c_str(), shown) && !shown) {
      state->wishes.open = avatar.file;
      state->wishes.person = avatar.people[i];
    }
  }
  ImGui::EndCombo();
}

}  // namespace

void DrawControlsPane(const Box& box, ViewState* state) {
  if (box.width <= 0) return;
  ImGui::SetNextWindowPos(ImVec2(box.x, box.y));
  ImGui::SetNextWindowSize(ImVec2(box.width, box.height));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("Controls", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar();
  const ViewedAvatar& avatar = *state->avatar;
  const std::string file = avatar.file.filename() == "avatar.safetensors" && avatar.file.has_parent_path()
                               ? avatar.file.parent_path().filename().string()
                               : avatar.file.filename().string();
  ImGui::TextUnformatted(file.c_str());
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", avatar.file.c_str());
  ImGui::TextDisabled("%d vertices, %d x %d texels", avatar.topology.vertex_count, avatar.architecture.texture_size,
                      avatar.architecture.texture_size);
  DrawPeople(state);
  if (ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) DrawViewSection(state);
  if (ImGui::CollapsingHeader("Look", ImGuiTreeNodeFlags_DefaultOpen)) DrawLookSection(state);
  if (ImGui::CollapsingHeader("Face", ImGuiTreeNodeFlags_DefaultOpen)) DrawFaceSection(state);
  ImGui::Spacing();
  if (ImGui::Button("Help (H)")) state->show_help = true;
  ImGui::SameLine();
  if (ImGui::Button("Picture (P)")) state->wishes.screenshot = true;
  ImGui::End();
}

}  // namespace likeness
