#include "likeness/viewer/theme.h"

#include <imgui.h>

#include <cmath>

#include "likeness/base/file.h"

namespace likeness {
namespace {

constexpr float kFontSize = 15;  // points
// Where Debian, Ubuntu and Fedora have it.
constexpr const char* kFontFiles[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                      "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf"};

}  // namespace

void ApplyTheme(bool dark, float scale) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = {};
  if (dark) {
    ImGui::StyleColorsDark();
    style.Colors[ImGuiCol_WindowBg] = ImVec4(0.09f, 0.10f, 0.11f, 0.97f);
  } else {
    ImGui::StyleColorsLight();
    style.Colors[ImGuiCol_WindowBg] = ImVec4(0.95f, 0.95f, 0.96f, 0.97f);
  }
  style.WindowRounding = 6;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.WindowPadding = ImVec2(12, 10);
  style.FramePadding = ImVec2(7, 4);
  style.ItemSpacing = ImVec2(8, 6);
  style.WindowBorderSize = dark ? 0.0f : 1.0f;
  style.ScaleAllSizes(scale);
}

void LoadFont(float scale, float pixels_a_unit) {
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->Clear();
  io.FontGlobalScale = 1 / pixels_a_unit;
  const float size = std::round(kFontSize * scale * pixels_a_unit);
  for (const char* file : kFontFiles) {
    if (Exists(file) && io.Fonts->AddFontFromFileTTF(file, size) != nullptr) return;
  }
  ImFontConfig config;
  config.SizePixels = size;
  io.Fonts->AddFontDefault(&config);
}

}  // namespace likeness
