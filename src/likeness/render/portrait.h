// A camera placed around a head, for pictures of it without a capture.

#pragma once

#include <Eigen/Core>
#include <string>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"

namespace likeness {

// The unit vector in head space towards a viewer at these angles: 0 and 0 is +z, the front; a positive azimuth is
// towards the subject's left (+x), a positive elevation upwards (+y).
Eigen::Vector3d ViewDirection(double azimuth_deg, double elevation_deg);

struct PortraitOptions {
  double azimuth_deg = 0;     // towards the subject's left; 0 is the front
  double elevation_deg = 0;   // upwards; -89 ... 89
  int width = 512;            // px, 16 ... 16384
  int height = 768;           // px
  double focal_px = 0;        // 0: the whole mesh fits with a small margin
  double distance_mm = 1100;  // from the mesh's middle

  void Check() const;  // throws Error
};

// The camera in head space. What fits is the triangles' vertices; those without a triangle do not count.
Camera PortraitCamera(const Vertices& vertices_in_head, const MeshTopology& topology, const PortraitOptions& options);

// "AZIMUTH,ELEVATION" in degrees. Throws Error for anything else.
void ParseView(const std::string& text, double* azimuth_deg, double* elevation_deg);

}  // namespace likeness
