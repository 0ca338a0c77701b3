// Where the menu is, and how it is pointed at: one hand holds it, the other one's ray presses its buttons.

#pragma once

#include <array>
#include <optional>

#include "likeness/viewer/view_state.h"
#include "likeness/xr/eyes.h"
#include "likeness/xr/hands.h"
#include "likeness/xr/menu.h"
#include "likeness/xr/panel_renderer.h"

namespace likeness {

// Above a hand, tilted towards the one who holds it.
RigidTransform MenuAboveHand(const RigidTransform& local_from_grip);

class VrHandMenu {
 public:
  explicit VrHandMenu(const GlFunctions& gl);

  // The menu's button brings it to its hand, or hides it there.
  //   returns  whether the avatar is to come before the viewer, by a button of the menu's or of a controller's
  bool Update(const std::array<VrHand, 2>& hands, double elapsed_s, ViewState* state);

  // After the face: the colours mix with what is behind.
  void Draw(const Camera& camera_in_local) const;

 private:
  struct Shown {
    RigidTransform local_from_panel;
    std::optional<RigidTransform> local_from_aim;  // of the hand that points
    std::optional<PanelHit> hit;
  };

  VrMenu menu_;
  GlPanelRenderer panels_;
  GlTexture ray_, tip_;
  std::optional<size_t> side_ = kLeft;  // none: hidden
  std::optional<Shown> shown_;
};

}  // namespace likeness
