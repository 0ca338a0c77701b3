// OpenXR's poses and angles of view as the house's transforms and cameras, and where the avatar stands. OpenXR's local
// space has x to the right, y up and -z where the viewer looked at the start; it is kept in millimetres here.

#pragma once

#include <optional>

#include "likeness/geometry/camera.h"
#include "likeness/xr/api.h"

namespace likeness {

// space_from_posed: metres become millimetres, the axes stay OpenXR's.
RigidTransform FromXrPose(const XrPosef& pose);

// What an eye sees: the camera's world is the space of the eye's pose. The four angles need not be symmetrical.
Camera CameraOfEye(const XrPosef& local_from_eye, const XrFovf& field, int width, int height);

// Where the avatar's world stands so that `target_in_world` is so far before the viewer's eyes, at their height, and
// its z axis (the avatar's nose at rest) points to the viewer. A nod or a tilted head does not count, nor is the
// avatar tilted.
//   returns  local_from_world
RigidTransform PlaceBefore(const RigidTransform& local_from_viewer, double distance_mm,
                           const Eigen::Vector3d& target_in_world);

// Where a ray along a pose's -z axis meets a panel's plane (z = 0, seen from +z): on the panel, mm, and how far that
// is. None where it points away or comes from behind.
struct PanelHit {
  Eigen::Vector2d on_panel_mm;
  double distance_mm = 0;
};
std::optional<PanelHit> HitPanel(const RigidTransform& local_from_aim, const RigidTransform& local_from_panel);

}  // namespace likeness
