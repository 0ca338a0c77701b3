// Which part of the window shows what.

#pragma once

namespace likeness {

// Screen coordinates from the window's top left corner.
struct Box {
  float x = 0, y = 0, width = 0, height = 0;
};

struct WindowLayout {
  Box controls;  // left; no width when they are hidden
  Box timeline;  // bottom, beside the controls
  Box face;      // the rest
};

//   scale  of the interface's sizes
WindowLayout LayOut(float width, float height, float scale, bool controls, bool timeline);

}  // namespace likeness
