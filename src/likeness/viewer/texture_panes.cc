#include <imgui.h>

#include <cstdint>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

constexpr float kSide = 300;  // points, at first
constexpr float kGap = 12;

// A square picture as large as the pane, anchored at the right edge at first.
bool BeginSquarePane(const char* name, const Box& face, float scale, int row, bool* open) {
  const float side = kSide * scale, gap = kGap * scale;
  ImGui::SetNextWindowPos(ImVec2(face.x + face.width - gap, face.y + gap + static_cast<float>(row) * (side + 3 * gap)),
                          ImGuiCond_FirstUseEver, ImVec2(1, 0));
  ImGui::SetNextWindowSize(ImVec2(side, side + ImGui::GetFrameHeight()), ImGuiCond_FirstUseEver);
  return ImGui::Begin(name, open, ImGuiWindowFlags_NoScrollbar);
}

ImTextureID IdOf(unsigned texture) {
  // As Dear ImGui's OpenGL backend wants it.
  return reinterpret_cast<ImTextureID>(static_cast<intptr_t>(texture));  // NOLINT(performance-no-int-to-ptr)
}

ImVec2 SquareIn(ImVec2 size) {
  const float side = size.x < size.y ? size.x : size.y;
  return {side, side};
}

void DrawEyes(const ShownTextures& textures) {
  const ImVec2 size = ImGui::GetContentRegionAvail();
  const auto count = static_cast<float>(textures.eyes.size());
  for (size_t i = 0; i < textures.eyes.size(); ++i) {
    if (i > 0) ImGui::SameLine();
    ImGui::Image(IdOf(textures.eyes[i]),
                 SquareIn(ImVec2(size.x / count - (count - 1) * ImGui::GetStyle().ItemSpacing.x / 2, size.y)));
  }
}

}  // namespace

void DrawTexturePanes(const Box& face, float scale, const ShownTextures& textures, ViewState* state) {
  if (state->show_texture) {
    if (BeginSquarePane("Texture", face, scale, 0, &state->show_texture) && !textures.eyes.empty()) DrawEyes(textures);
    ImGui::End();
  }
  if (state->show_uvs) {
    if (BeginSquarePane("UV", face, scale, 1, &state->show_uvs) && textures.uv_layout != 0) {
      const ImVec2 at = ImGui::GetCursorScreenPos(), size = SquareIn(ImGui::GetContentRegionAvail());
      const ImVec2 end(at.x + size.x, at.y + size.y);
      if (!textures.eyes.empty()) ImGui::GetWindowDrawList()->AddImage(IdOf(textures.eyes[0]), at, end);
      ImGui::GetWindowDrawList()->AddImage(IdOf(textures.uv_layout), at, end);
    }
    ImGui::End();
  }
}

}  // namespace likeness
