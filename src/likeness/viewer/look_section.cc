#include <imgui.h>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kMostStops = 3;

}  // namespace

void DrawLookSection(ViewState* state) {
  const auto surface = [&](const char* name, MeshFill value) {
    if (ImGui::RadioButton(name, state->surface == value)) state->surface = value;
  };
  surface("texture", MeshFill::kTexture);
  ImGui::SameLine();
  surface("both", MeshFill::kTextureAndLines);
  ImGui::SameLine();
  surface("wireframe", MeshFill::kLines);
  ImGui::PushItemWidth(ImGui::GetContentRegionAvail().x * 0.62f);
  auto stops = static_cast<float>(state->exposure_stops);
  if (ImGui::SliderFloat("exposure", &stops, -kMostStops, kMostStops, "%+.1f stops")) state->exposure_stops = stops;
  ImGui::ColorEdit3("background", state->background.data(),
                    ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_PickerHueWheel);
  ImGui::PopItemWidth();
  ImGui::SameLine();
  ImGui::Checkbox("dark", &state->dark);
  ImGui::Checkbox("texture", &state->show_texture);
  ImGui::SameLine();
  ImGui::Checkbox("UV", &state->show_uvs);
  ImGui::SameLine();
  ImGui::Checkbox("frame times", &state->show_timing);
}

}  // namespace likeness
