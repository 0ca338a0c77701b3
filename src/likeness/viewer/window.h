// A window with an OpenGL 3.3 core context and Dear ImGui in it, and what the mouse, the keyboard and dropped files
// say.

#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

struct GLFWwindow;

namespace likeness {

// How a window stands on the desk.
struct WindowPlace {
  int x = -1, y = -1;  // of the top left corner, screen coordinates; -1: where the desk likes
  int width = 1280, height = 800;
  bool maximised = false;
};

struct WindowOptions {
  std::string title = "Likeness";
  WindowPlace place;
  bool visible = true;
  float scale = 0;  // of all sizes of the interface; 0: the screen's
};

// Since the last frame.
struct WindowInput {
  // The mouse moved this far, in screen coordinates, with a button held that went down outside of the interface.
  double turn_right = 0, turn_down = 0;  // left button
  double pan_right = 0, pan_down = 0;    // right or middle button, or left with Shift
  double wheel = 0;                      // steps away from the user, outside of the interface
  // Typed characters in lower case, and GLFW's codes of keys without one (all at least 256), while no field is edited.
  std::vector<int> keys;
  std::vector<std::filesystem::path> dropped;
};

class Window {
 public:
  // Throws Error when there is no display or no OpenGL 3.3. One at a time.
  explicit Window(const WindowOptions& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  bool Closing() const;
  void Close();

  // Takes events (waits for the next one up to so long) and begins a frame of the interface.
  WindowInput BeginFrame(double wait_s);
  // Ends it and draws it over what is in the window.
  void DrawInterface();
  // Shows what was drawn.
  void Swap();

  void SetDark(bool dark);
  int width() const;  // of the framebuffer, px
  int height() const;
  float scale() const { return scale_; }  // interface's sizes: screen coordinates a point
  float pixels_a_unit() const;            // framebuffer's pixels a screen coordinate
  WindowPlace place() const;
  // Makes a BeginFrame that waits return; may be called on any thread.
  static void Wake();
  // Of OpenGL, by its name; null where there is none.
  static void* FunctionAddress(const char* name);

 private:
  struct Callbacks;
  struct Destroy {
    void operator()(GLFWwindow* window) const;
  };

  void UpdateScale();

  std::unique_ptr<GLFWwindow, Destroy> window_;
  WindowInput input_;
  bool turning_ = false, panning_ = false;
  double mouse_x_ = 0, mouse_y_ = 0;
  float wanted_scale_ = 0, scale_ = 0;
  bool dark_ = true;
  mutable WindowPlace free_place_;  // when it was last not maximised
};

}  // namespace likeness
