// How the interface looks.

#pragma once

namespace likeness {

// Colours and sizes; `scale` as Window has it.
void ApplyTheme(bool dark, float scale);

// The interface's font: DejaVu Sans where the system has it, otherwise the one of Dear ImGui.
//   pixels_a_unit  letters are drawn that much finer than screen coordinates
void LoadFont(float scale, float pixels_a_unit);

}  // namespace likeness
