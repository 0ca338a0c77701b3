// The menu in the hand: a small interface of Dear ImGui's on a texture, and the other hand's ray is its mouse.

#pragma once

#include <memory>
#include <optional>

#include "likeness/gl/objects.h"
#include "likeness/viewer/view_state.h"

struct ImGuiContext;

namespace likeness {

class VrMenu {
 public:
  static constexpr double kWidthMm = 170, kHeightMm = 72;

  // For the OpenGL context that is current now, in every call and at the end.
  explicit VrMenu(const GlFunctions& gl);
  ~VrMenu();
  VrMenu(const VrMenu&) = delete;
  VrMenu& operator=(const VrMenu&) = delete;

  // Draws the texture anew and does what is pressed.
  //   pointer_mm  where the ray meets the menu, from its centre, y up; none where it does not
  //   returns     whether the avatar is to come before the viewer
  bool Update(const std::optional<Eigen::Vector2d>& pointer_mm, bool pressed, double elapsed_s, ViewState* state);

  GLuint texture() const { return texture_.id(); }  // for GlPanelRenderer

 private:
  const GlFunctions* gl_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  ImGuiContext* context_;
};

}  // namespace likeness
