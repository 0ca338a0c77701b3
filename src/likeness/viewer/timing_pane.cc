#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "likeness/viewer/panes.h"

namespace likeness {
namespace {

struct Stage {
  const char* name;
  double FrameTime::*value;
  ImU32 colour;
};

constexpr Stage kStages[] = {
    {"upload", &FrameTime::upload, IM_COL32(86, 180, 233, 255)},
    {"draw", &FrameTime::draw, IM_COL32(0, 158, 115, 255)},
    {"interface", &FrameTime::interface, IM_COL32(204, 121, 167, 255)},
};
constexpr ImU32 kRestColour = IM_COL32(140, 140, 140, 110);
constexpr ImU32 kDecodeColour = IM_COL32(240, 180, 40, 255);
constexpr ImU32 kBudgetColour = IM_COL32(230, 80, 60, 255);

// Bars of a frame each, its stages on each other; a dot for its decoding; a line at the budget.
void DrawGraph(const FrameTimes& times, ImVec2 at, ImVec2 size) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  double most = 2 * kFrameBudgetMs;
  for (const FrameTime& frame : times.frames()) most = std::max({most, frame.total, frame.decode});
  const auto y_of = [&](double ms) { return at.y + size.y * (1 - static_cast<float>(ms / most)); };
  const float width = size.x / FrameTimes::kMost;
  float x = at.x + size.x - width * static_cast<float>(times.frames().size());
  for (const FrameTime& frame : times.frames()) {
    list->AddRectFilled(ImVec2(x, y_of(frame.total)), ImVec2(x + width, at.y + size.y), kRestColour);
    double sum = 0;
    for (const Stage& stage : kStages) {
      const double top = sum + frame.*stage.value;
      list->AddRectFilled(ImVec2(x, y_of(top)), ImVec2(x + width, y_of(sum)), stage.colour);
      sum = top;
    }
    list->AddRectFilled(ImVec2(x, y_of(frame.decode) - 1), ImVec2(x + width, y_of(frame.decode) + 1), kDecodeColour);
    x += width;
  }
  list->AddLine(ImVec2(at.x, y_of(kFrameBudgetMs)), ImVec2(at.x + size.x, y_of(kFrameBudgetMs)), kBudgetColour, 1.5f);
  list->AddText(ImVec2(at.x + 2, y_of(kFrameBudgetMs) - ImGui::GetTextLineHeight()), kBudgetColour, "11.1 ms");
}

void DrawLegend(const char* name, ImU32 colour, double ms) {
  ImGui::TextColored(ImGui::ColorConvertU32ToFloat4(colour), "%s %.1f", name, ms);
}

}  // namespace

void DrawTimingPane(const Box& face, float scale, const FrameTimes& times, const std::string& decoder,
                    ViewState* state) {
  if (!state->show_timing) return;
  const float gap = 12 * scale;
  ImGui::SetNextWindowPos(ImVec2(face.x + gap, face.y + face.height - gap), ImGuiCond_FirstUseEver, ImVec2(0, 1));
  ImGui::SetNextWindowSize(ImVec2(420 * scale, 0), ImGuiCond_FirstUseEver);
  if (ImGui::Begin("Frame times", &state->show_timing)) {
    const ImVec2 size(ImGui::GetContentRegionAvail().x, 120 * scale);
    DrawGraph(times, ImGui::GetCursorScreenPos(), size);
    ImGui::Dummy(size);
    DrawLegend("decode", kDecodeColour, times.Median(&FrameTime::decode));
    for (const Stage& stage : kStages) {
      ImGui::SameLine();
      DrawLegend(stage.name, stage.colour, times.Median(stage.value));
    }
    ImGui::SameLine();
    ImGui::Text("frame %.1f ms", times.Median(&FrameTime::total));
    ImGui::TextDisabled("medians; %.0f%% of frames within 11.1 ms; decoding runs beside the rest, by %s",
                        100 * times.ShareWithin(kFrameBudgetMs), decoder.c_str());
  }
  ImGui::End();
}

}  // namespace likeness
