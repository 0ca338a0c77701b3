#include <imgui.h>

#include <algorithm>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kLeastSpeed = 0.05f, kMostSpeed = 4;

void DrawClips(float scale, ViewState* state) {
  const Clip* current = state->CurrentClip();
  ImGui::SetNextItemWidth(200 * scale);
  if (!ImGui::BeginCombo("##clip", current != nullptr ? current->name.c_str() : "at rest")) return;
  if (ImGui::Selectable("at rest", current == nullptr)) state->PlayClip(-1);
  for (int i = 0; i < state->ClipCount(); ++i) {
    ImGui::PushID(i);
    if (ImGui::Selectable(state->ClipAt(i).name.c_str(), i == state->clip)) state->PlayClip(i);
    ImGui::PopID();
  }
  ImGui::EndCombo();
}

}  // namespace

void DrawTimelinePane(const Box& box, float scale, ViewState* state) {
  if (box.height <= 0) return;
  ImGui::SetNextWindowPos(ImVec2(box.x, box.y));
  ImGui::SetNextWindowSize(ImVec2(box.width, box.height));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("Timeline", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar();
  Playback& playback = state->playback;
  const Clip* clip = state->CurrentClip();
  if (ImGui::Button(playback.playing ? "Pause" : "Play", ImVec2(64 * scale, 0))) state->PlayOrPause();
  ImGui::SameLine();
  DrawClips(scale, state);
  ImGui::SameLine();
  ImGui::Checkbox("loop", &playback.loop);
  ImGui::SameLine();
  auto speed = static_cast<float>(playback.speed);
  ImGui::SetNextItemWidth(110 * scale);
  if (ImGui::SliderFloat("##speed", &speed, kLeastSpeed, kMostSpeed, "speed %.2f", ImGuiSliderFlags_Logarithmic)) {
    playback.speed = speed;
  }
  ImGui::SameLine();
  ImGui::TextUnformatted(state->FrameName().c_str());
  auto time_s = static_cast<float>(playback.time_s);
  const auto duration_s = static_cast<float>(clip != nullptr ? clip->DurationS() : 0);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##time", &time_s, 0, std::max(duration_s, 1e-3f), "%.2f s")) {
    playback.time_s = std::min(time_s, duration_s);
    playback.playing = false;
  }
  ImGui::End();
}

}  // namespace likeness
