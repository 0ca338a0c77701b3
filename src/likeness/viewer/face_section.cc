#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kMostDeviations = 3;
constexpr size_t kMostSliders = 16;  // the others hardly move the face

// The frame's name beneath one end of the slider, cut to what fits.
void DrawEnd(const std::string& name, float width, bool right) {
  const float wanted = ImGui::CalcTextSize(name.c_str()).x;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float x = right ? at.x + std::max(0.0f, width - wanted) : at.x;
  ImGui::PushClipRect(at, ImVec2(at.x + width, at.y + ImGui::GetTextLineHeight()), true);
  ImGui::GetWindowDrawList()->AddText(ImVec2(x, at.y), ImGui::GetColorU32(ImGuiCol_TextDisabled), name.c_str());
  ImGui::PopClipRect();
  ImGui::Dummy(ImVec2(width, ImGui::GetTextLineHeight()));
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("most similar training frame: %s", name.c_str());
}

void DrawSlider(const CodeDirection& direction, float* value) {
  const float width = ImGui::GetContentRegionAvail().x;
  ImGui::SetNextItemWidth(width);
  ImGui::SliderFloat("##value", value, -kMostDeviations, kMostDeviations, "%+.1f");
  if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip("standard deviations; one moves the face by %.2f mm. Ctrl and a click: type a number",
                      direction.movement_mm);
  }
  const float half = (width - ImGui::GetStyle().ItemSpacing.x) / 2;
  DrawEnd(direction.minus, half, false);
  ImGui::SameLine();
  DrawEnd(direction.plus, half, true);
}

}  // namespace

void DrawFaceSection(ViewState* state) {
  if (ImGui::Button("Random (N)")) state->RandomFace(static_cast<uint64_t>(ImGui::GetFrameCount()));
  ImGui::SameLine();
  if (ImGui::Button("At rest (0)")) state->ResetFace();
  ImGui::SameLine();
  if (ImGui::Button("Sliders to 0")) std::fill(state->sliders.begin(), state->sliders.end(), 0.0f);
  if (state->sliders.empty()) ImGui::TextWrapped("The avatar knows too few frames to find its main directions.");
  for (size_t i = 0; i < std::min(kMostSliders, state->sliders.size()); ++i) {
    ImGui::PushID(static_cast<int>(i));
    DrawSlider(state->avatar->directions[i], &state->sliders[i]);
    ImGui::PopID();
  }
}

}  // namespace likeness
