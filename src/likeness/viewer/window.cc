#include "likeness/viewer/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui_impl_glfw.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <cctype>

#include "likeness/base/error.h"
#include "likeness/viewer/theme.h"

namespace likeness {
namespace {

std::string LastGlfwError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "no reason given";
}

}  // namespace

// GLFW calls them; Dear ImGui calls them first where it wants to know, too.
struct Window::Callbacks {
  static Window& Of(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }

  static void Button(GLFWwindow* window, int button, int action, int mods) {
    Window& self = Of(window);
    if (action == GLFW_RELEASE) {
      if (button == GLFW_MOUSE_BUTTON_LEFT) self.turning_ = false;
      self.panning_ = false;
      return;
    }
    if (ImGui::GetIO().WantCaptureMouse) return;
    const bool left = button == GLFW_MOUSE_BUTTON_LEFT, pan = !left || (mods & GLFW_MOD_SHIFT) != 0;
    (pan ? self.panning_ : self.turning_) = true;
  }

  static void Cursor(GLFWwindow* window, double x, double y) {
    Window& self = Of(window);
    const double right = x - self.mouse_x_, down = y - self.mouse_y_;
    self.mouse_x_ = x;
    self.mouse_y_ = y;
    if (self.panning_) {
      self.input_.pan_right += right;
      self.input_.pan_down += down;
    } else if (self.turning_) {
      self.input_.turn_right += right;
      self.input_.turn_down += down;
    }
  }

  static void Wheel(GLFWwindow* window, double, double steps) {
    if (!ImGui::GetIO().WantCaptureMouse) Of(window).input_.wheel += steps;
  }

  static void Key(GLFWwindow* window, int key, int, int action, int) {
    if (action != GLFW_RELEASE && key >= 256 && !ImGui::GetIO().WantTextInput) Of(window).input_.keys.push_back(key);
  }

  static void Character(GLFWwindow* window, unsigned int character) {
    if (character < 128 && !ImGui::GetIO().WantTextInput) {
      Of(window).input_.keys.push_back(std::tolower(static_cast<int>(character)));
    }
  }

  static void Drop(GLFWwindow* window, int count, const char** paths) {
    for (int i = 0; i < count; ++i) Of(window).input_.dropped.emplace_back(paths[i]);
  }
};

void Window::Destroy::operator()(GLFWwindow* window) const {
  glfwDestroyWindow(window);
  glfwTerminate();
}

Window::Window(const WindowOptions& options) : wanted_scale_(options.scale), free_place_(options.place) {
  const std::string what_to_do =
      "a window needs a screen: set DISPLAY, use a virtual one (xvfb-run likeness view ...), or draw to a file with "
      "likeness render";
  if (glfwInit() != GLFW_TRUE) throw Error("no window can be opened ({}); {}", LastGlfwError(), what_to_do);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  glfwWindowHint(GLFW_MAXIMIZED, options.place.maximised ? GLFW_TRUE : GLFW_FALSE);
  GLFWwindow* made =
      glfwCreateWindow(options.place.width, options.place.height, options.title.c_str(), nullptr, nullptr);
  if (made == nullptr) {
    const std::string reason = LastGlfwError();
    glfwTerminate();
    throw Error("no window with OpenGL 3.3 can be opened ({}); {}", reason, what_to_do);
  }
  window_.reset(made);
  if (options.place.x >= 0 && options.place.y >= 0) glfwSetWindowPos(made, options.place.x, options.place.y);
  glfwMakeContextCurrent(made);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(made, this);
  glfwSetMouseButtonCallback(made, Callbacks::Button);
  glfwSetCursorPosCallback(made, Callbacks::Cursor);
  glfwSetScrollCallback(made, Callbacks::Wheel);
  glfwSetKeyCallback(made, Callbacks::Key);
  glfwSetCharCallback(made, Callbacks::Character);
  glfwSetDropCallback(made, Callbacks::Drop);
  glfwGetCursorPos(made, &mouse_x_, &mouse_y_);

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui_ImplGlfw_InitForOpenGL(made, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  if (options.visible) glfwShowWindow(made);
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

bool Window::Closing() const { return glfwWindowShouldClose(window_.get()) == GLFW_TRUE; }

void Window::Close() { glfwSetWindowShouldClose(window_.get(), GLFW_TRUE); }

WindowInput Window::BeginFrame(double wait_s) {
  input_ = {};
  if (wait_s > 0) {
    glfwWaitEventsTimeout(wait_s);
  } else {
    glfwPollEvents();
  }
  UpdateScale();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  return input_;
}

void Window::DrawInterface() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::Swap() { glfwSwapBuffers(window_.get()); }

void Window::SetDark(bool dark) {
  if (dark == dark_) return;
  dark_ = dark;
  ApplyTheme(dark_, scale_);
}

int Window::width() const {
  int width = 0;
  glfwGetFramebufferSize(window_.get(), &width, nullptr);
  return width;
}

int Window::height() const {
  int height = 0;
  glfwGetFramebufferSize(window_.get(), nullptr, &height);
  return height;
}

float Window::pixels_a_unit() const {
  int units = 0;
  glfwGetWindowSize(window_.get(), &units, nullptr);
  return units > 0 ? static_cast<float>(width()) / static_cast<float>(units) : 1.0f;
}

WindowPlace Window::place() const {
  WindowPlace now = free_place_;
  now.maximised = glfwGetWindowAttrib(window_.get(), GLFW_MAXIMIZED) == GLFW_TRUE;
  if (!now.maximised && glfwGetWindowAttrib(window_.get(), GLFW_ICONIFIED) != GLFW_TRUE) {
    glfwGetWindowPos(window_.get(), &now.x, &now.y);
    glfwGetWindowSize(window_.get(), &now.width, &now.height);
    free_place_ = now;
  }
  return now;
}

void Window::Wake() { glfwPostEmptyEvent(); }

void* Window::FunctionAddress(const char* name) { return reinterpret_cast<void*>(glfwGetProcAddress(name)); }

// The screen's scale differs from one monitor to the next; screen coordinates may carry it already.
void Window::UpdateScale() {
  float scale = wanted_scale_;
  if (scale <= 0) {
    glfwGetWindowContentScale(window_.get(), &scale, nullptr);
    scale = std::clamp(scale / pixels_a_unit(), 0.5f, 4.0f);
  }
  if (scale == scale_) return;
  scale_ = scale;
  LoadFont(scale_, pixels_a_unit());
  ImGui_ImplOpenGL3_DestroyDeviceObjects();  // made again, with the new letters, when the frame begins
  ApplyTheme(dark_, scale_);
}

}  // namespace likeness
