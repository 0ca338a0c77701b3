#include "likeness/xr/hand_menu.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace likeness {
namespace {

constexpr double kAboveMm = 100, kBeforeMm = 60;  // clear of the controller
constexpr double kTiltRadians = 0.6;              // a hand is held lower than the eyes
constexpr double kRayMm = 600, kRayWidthMm = 1.5, kTipMm = 6;
constexpr double kTipAboveMm = 1;  // the menu does not hide it

// Panels along the ray, across each other: one of them is seen from anywhere.
RigidTransform AlongRay(const RigidTransform& local_from_aim, double length_mm, bool upright) {
  const Eigen::Vector3d x(0, 0, -1);
  const Eigen::Vector3d y = upright ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  RigidTransform aim_from_panel;
  aim_from_panel.rotation << x, y, x.cross(y);
  aim_from_panel.translation.z() = -length_mm / 2;
  return local_from_aim * aim_from_panel;
}

bool OnMenu(const PanelHit& hit) {
  return std::abs(hit.on_panel_mm.x()) <= VrMenu::kWidthMm / 2 &&
         std::abs(hit.on_panel_mm.y()) <= VrMenu::kHeightMm / 2;
}

}  // namespace

RigidTransform MenuAboveHand(const RigidTransform& local_from_grip) {
  RigidTransform grip_from_panel;
  grip_from_panel.rotation = Eigen::AngleAxisd(-kTiltRadians, Eigen::Vector3d::UnitX()).toRotationMatrix();
  grip_from_panel.translation = {0, kAboveMm, -kBeforeMm};
  return local_from_grip * grip_from_panel;
}

VrHandMenu::VrHandMenu(const GlFunctions& gl)
    : menu_(gl),
      panels_(gl),
      ray_(PlainTexture(gl, {70, 102, 128, 128})),
      tip_(PlainTexture(gl, {255, 255, 255, 255})) {}

bool VrHandMenu::Update(const std::array<VrHand, 2>& hands, double elapsed_s, ViewState* state) {
  bool bring_here = false;
  for (const size_t side : {kLeft, kRight}) {
    bring_here = bring_here || hands[side].recentre_pressed;
    if (hands[side].menu_pressed) side_ = side_ == side ? std::nullopt : std::optional<size_t>(side);
  }
  shown_.reset();
  if (!side_ || !hands[*side_].held) return bring_here;
  const VrHand& pointing = hands[*side_ == kLeft ? kRight : kLeft];
  shown_.emplace();
  shown_->local_from_panel = MenuAboveHand(hands[*side_].local_from_grip);
  if (pointing.held) {
    shown_->local_from_aim = pointing.local_from_aim;
    shown_->hit = HitPanel(pointing.local_from_aim, shown_->local_from_panel);
    if (shown_->hit && !OnMenu(*shown_->hit)) shown_->hit.reset();
  }
  std::optional<Eigen::Vector2d> pointer;
  if (shown_->hit) pointer = shown_->hit->on_panel_mm;
  return menu_.Update(pointer, pointing.select, elapsed_s, state) || bring_here;
}

void VrHandMenu::Draw(const Camera& camera_in_local) const {
  if (!shown_) return;
  panels_.Draw(menu_.texture(), camera_in_local, shown_->local_from_panel, VrMenu::kWidthMm, VrMenu::kHeightMm);
  if (!shown_->local_from_aim) return;
  const double length = shown_->hit ? shown_->hit->distance_mm : kRayMm;
  for (const bool upright : {true, false}) {
    panels_.Draw(ray_.id(), camera_in_local, AlongRay(*shown_->local_from_aim, length, upright), length, kRayWidthMm);
  }
  if (!shown_->hit) return;
  RigidTransform panel_from_tip;
  panel_from_tip.translation << shown_->hit->on_panel_mm, kTipAboveMm;
  panels_.Draw(tip_.id(), camera_in_local, shown_->local_from_panel * panel_from_tip, kTipMm, kTipMm);
}

}  // namespace likeness
