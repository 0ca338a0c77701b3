// The parts of the interface, a file each. They show the state and change it; each is called once a frame, between
// Window::BeginFrame and Window::DrawInterface.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/viewer/frame_times.h"
#include "likeness/viewer/layout.h"
#include "likeness/viewer/view_state.h"

namespace likeness {

// A texture of OpenGL's, by its id; 0: none yet.
struct ShownTextures {
  std::vector<unsigned> eyes;  // the decoded ones
  unsigned uv_layout = 0;
};

// Without an avatar: what this is and how to open one.
//   typed    the field's contents
//   opening  something is being opened now
void DrawWelcomePane(const std::vector<std::filesystem::path>& recent, bool opening, std::string* typed,
                     ViewState* state);

// Left: face_section.cc, view_section.cc and look_section.cc under each other.
void DrawControlsPane(const Box& box, ViewState* state);
void DrawFaceSection(ViewState* state);  // sliders
void DrawViewSection(ViewState* state);  // where from, view dependence, stereo
void DrawLookSection(ViewState* state);  // surface, light, panes

// Bottom: what plays.
void DrawTimelinePane(const Box& box, float scale, ViewState* state);

// Over the face, where the state shows them.
void DrawTexturePanes(const Box& face, float scale, const ShownTextures& textures, ViewState* state);
void DrawTimingPane(const Box& face, float scale, const FrameTimes& times, const std::string& decoder,
                    ViewState* state);
void DrawHelpPane(ViewState* state);
void DrawMessagePane(const Box& face, ViewState* state);

}  // namespace likeness
