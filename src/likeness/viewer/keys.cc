#include "likeness/viewer/keys.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <chrono>

namespace likeness {
namespace {

void Step(ViewState* s, int frames) {
  if (s->CurrentClip() != nullptr) s->playback.Step(s->CurrentClip()->performance, frames);
}

// Whatever lies over the face, the uppermost first.
void CloseSomething(ViewState* s) {
  if (!s->message.empty()) {
    s->message.clear();
  } else {
    s->show_help = false;
  }
}

void ToggleLines(ViewState* s) {
  s->surface = s->surface == MeshFill::kTexture           ? MeshFill::kTextureAndLines
               : s->surface == MeshFill::kTextureAndLines ? MeshFill::kLines
                                                          : MeshFill::kTexture;
}

constexpr KeyBinding kBindings[] = {
    {' ', "Space", "play or pause", [](ViewState* s) { s->PlayOrPause(); }},
    {GLFW_KEY_LEFT, "Left", "the frame before", [](ViewState* s) { Step(s, -1); }},
    {GLFW_KEY_RIGHT, "Right", "the next frame", [](ViewState* s) { Step(s, 1); }},
    {'l', "L", "loop", [](ViewState* s) { s->playback.loop = !s->playback.loop; }},
    {'n', "N", "a random face",
     [](ViewState* s) {
       s->RandomFace(static_cast<uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()));
     }},
    {'0', "0", "the face at rest", [](ViewState* s) { s->ResetFace(); }},
    {'r', "R", "look from the front", [](ViewState* s) { s->ResetView(); }},
    {'v', "V", "texture follows the view, or stays", [](ViewState* s) { s->ToggleViewDependence(); }},
    {'s', "S", "stereo, side by side", [](ViewState* s) { s->stereo = !s->stereo; }},
    {'w', "W", "texture, wireframe, or both", ToggleLines},
    {'t', "T", "the decoded texture", [](ViewState* s) { s->show_texture = !s->show_texture; }},
    {'u', "U", "the mesh in the texture (UV)", [](ViewState* s) { s->show_uvs = !s->show_uvs; }},
    {'g', "G", "frame times", [](ViewState* s) { s->show_timing = !s->show_timing; }},
    {'d', "D", "dark or light", [](ViewState* s) { s->dark = !s->dark; }},
    {'p', "P", "picture of the face (PNG)", [](ViewState* s) { s->wishes.screenshot = true; }},
    {GLFW_KEY_TAB, "Tab", "show or hide the controls", [](ViewState* s) { s->show_controls = !s->show_controls; }},
    {'h', "H or ?", "this help", [](ViewState* s) { s->show_help = !s->show_help; }},
    {'?', "", "", [](ViewState* s) { s->show_help = !s->show_help; }},
    {GLFW_KEY_ESCAPE, "Esc", "close help or message", CloseSomething},
    {'q', "Q", "quit", [](ViewState* s) { s->wishes.quit = true; }},
};

}  // namespace

std::span<const KeyBinding> KeyBindings() { return kBindings; }

void PressKey(int key, ViewState* state) {
  for (const KeyBinding& binding : kBindings) {
    if (binding.key == key) binding.act(state);
  }
}

}  // namespace likeness
