#include <imgui.h>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kMostEyeDistanceMm = 120;

bool SliderFor(const char* label, double* value, float least, float most, const char* format) {
  auto shown = static_cast<float>(*value);
  if (!ImGui::SliderFloat(label, &shown, least, most, format)) return false;
  *value = shown;
  return true;
}

}  // namespace

void DrawViewSection(ViewState* state) {
  Orbit& orbit = state->orbit;
  ImGui::PushItemWidth(ImGui::GetContentRegionAvail().x * 0.62f);
  SliderFor("azimuth", &orbit.azimuth_deg, -180, 180, "%.0f deg");
  SliderFor("elevation", &orbit.elevation_deg, -89, 89, "%.0f deg");
  bool follows = state->view_dependent;
  if (ImGui::Checkbox("texture follows the view", &follows)) state->ToggleViewDependence();
  if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip(
        "On: the texture is decoded for where you look from, as the person was seen from there.\n"
        "Off: it stays as it was decoded for one view; turn the head to see what that costs.");
  }
  if (!state->view_dependent) {
    ImGui::TextDisabled("decoded for %.0f, %.0f deg", state->fixed_azimuth_deg, state->fixed_elevation_deg);
    if (ImGui::Button("for the front")) state->fixed_azimuth_deg = state->fixed_elevation_deg = 0;
    ImGui::SameLine();
    if (ImGui::Button("for this view")) {
      state->fixed_azimuth_deg = orbit.azimuth_deg;
      state->fixed_elevation_deg = orbit.elevation_deg;
    }
  }
  ImGui::Checkbox("stereo, side by side", &state->stereo);
  if (state->stereo) SliderFor("between eyes", &state->eye_distance_mm, 0, kMostEyeDistanceMm, "%.0f mm");
  if (state->clip >= static_cast<int>(state->avatar->clips.size())) {
    ImGui::Checkbox("head moves as it did", &state->head_moves);
  }
  if (ImGui::Button("From the front (R)")) state->ResetView();
  ImGui::PopItemWidth();
}

}  // namespace likeness
