// How well a mesh, placed by a camera and a head pose, fits what that camera's picture shows.

#pragma once

#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

// One camera's picture of one frame, made small.
struct View {
  ImageU8 colour;      // RGB
  ImageU8 foreground;  // 255 = head; empty where it cannot be told
  ImageF contrast;     // LocalContrast of the colour
  bool empty() const { return colour.empty(); }
};

// A place on the mesh, as in RayHit.
struct SurfacePoint {
  int triangle = 0;
  float b1 = 0, b2 = 0;
};

// `count` points spread evenly over the area; the same for the same mesh.
std::vector<SurfacePoint> SpreadPoints(const Vertices& vertices, const MeshTopology& topology, int count);

// What a camera sees of the mesh where files (or a hypothesis) put it. Not necessarily rigid: a hypothesis may mirror.
struct Placement {
  Camera camera;  // of the view's size
  RigidTransform world_from_head;
  Eigen::Matrix3d mesh_from_file = Eigen::Matrix3d::Identity();  // scale, axes
};

struct ViewFit {
  double overlap = -1;              // intersection over union of silhouette and foreground; -1: no foreground is known
  double inside = 0;                // share of the silhouette that is foreground
  double size = 0;                  // share of the picture that the silhouette takes
  std::vector<float> contrast;      // the view's at each surface point
  std::vector<uint8_t> seen;        // whether the camera sees the point
  std::vector<Eigen::Vector2f> at;  // its pixel position; only where seen
};

ViewFit FitView(const View& view, const Placement& placement, const Vertices& vertices, const MeshTopology& topology,
                const std::vector<SurfacePoint>& points);

// The mesh's silhouette: 255 where it covers a pixel's centre.
ImageU8 Silhouette(const Placement& placement, const Vertices& vertices, const MeshTopology& topology);

// Correlation of what two cameras see at the surface points that both see. `points` is how many there were; nothing is
// said (0) for fewer than kLeastPoints.
inline constexpr int kLeastPoints = 100;
struct Agreement {
  double correlation = 0;
  int points = 0;
};
Agreement Agree(const ViewFit& a, const ViewFit& b);

// A sum of agreements, weighted by their points, and of overlaps.
struct FitScore {
  double overlap_sum = 0, inside_sum = 0, agreement_sum = 0, agreement_weight = 0;
  int views = 0, views_with_foreground = 0;

  void Add(const ViewFit& fit);
  void Add(const Agreement& agreement);
  double Overlap() const { return views_with_foreground > 0 ? overlap_sum / views_with_foreground : 0; }
  double Inside() const { return views_with_foreground > 0 ? inside_sum / views_with_foreground : 0; }
  double Agreement() const { return agreement_weight > 0 ? agreement_sum / agreement_weight : 0; }
  double Total() const { return Overlap() + Agreement(); }
};

}  // namespace likeness
