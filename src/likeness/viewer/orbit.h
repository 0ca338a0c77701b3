// A camera that circles a point of the head, as a mouse moves it.

#pragma once

#include <Eigen/Core>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"

namespace likeness {

struct Orbit {
  double azimuth_deg = 0;                                    // towards the subject's left; 0 is the front
  double elevation_deg = 0;                                  // upwards, -89 ... 89
  double distance_mm = 900;                                  // from the target, kNearestMm ... kFarthestMm
  Eigen::Vector3d target_in_head = Eigen::Vector3d::Zero();  // mm, in the middle of the picture

  static constexpr double kNearestMm = 150;
  static constexpr double kFarthestMm = 20000;
  static constexpr double kFieldDeg = 22;  // angle of view from the picture's bottom to its top: a portrait lens

  // The mouse has moved right and down by so many pixels of a picture of this height. The head follows the mouse.
  void Turn(double right_px, double down_px, int height_px);  // half a turn over the height
  void Pan(double right_px, double down_px, int height_px);   // what is as far as the target stays under the mouse
  void Zoom(double steps);                                    // of the wheel; more than 0 is nearer

  // In head space; pixels are square.
  Camera CameraFor(int width, int height) const;

  bool operator==(const Orbit&) const = default;
};

// From the front, with all triangles of the mesh in a picture that is at least as wide as it is high.
Orbit OrbitAround(const Vertices& vertices_in_head, const MeshTopology& topology);

// What one eye sees, in its part of a picture.
struct EyeView {
  Camera camera;  // in head space, with the part's size
  int x = 0;      // px, the part's left edge; it is as high as the picture
};

// One eye for the whole picture, or the left and the right eye in its left and right half. Two eyes look in parallel,
// each with its picture shifted so that the target appears in the middle of both halves.
//   eye_distance_mm  between the two; unused for one
std::vector<EyeView> EyesOf(const Orbit& orbit, int width, int height, bool stereo, double eye_distance_mm);

}  // namespace likeness
