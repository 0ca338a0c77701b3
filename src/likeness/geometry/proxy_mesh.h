// Shapes that stand in for a head: an ellipsoid around it and a board before it, each with texture coordinates.

#pragma once

#include <Eigen/Core>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct ProxyMesh {
  Vertices vertices;
  MeshTopology topology;
};

struct Ellipsoid {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  // Takes the unit ball to the ellipsoid around 0; symmetric and positive definite, so that it turns nothing.
  Eigen::Matrix3d from_ball = Eigen::Matrix3d::Identity();

  // Distance from the centre in radii of the ellipsoid: at most 1 inside.
  double RadiiOf(const Eigen::Vector3d& point) const;
};

// The smallest ellipsoid around points in rows, by Khachiyan's algorithm (Todd and Yildirim 2007) to 1% of its
// volume, then grown until it holds all of them. Throws Error when there are fewer than four points or they lie in a
// plane.
Ellipsoid EnclosingEllipsoid(const Eigen::MatrixX3d& points);

// A closed mesh around the ellipsoid: its faces touch it from outside, so that it contains what the ellipsoid does.
// Its texture has the front (+z) in the middle and the subject's left at the right, is cut at the back, and gives the
// front half two thirds of the texels, as cameras stand there.
ProxyMesh EllipsoidMesh(const Ellipsoid& ellipsoid);

// Two triangles that face +z: x from low.x to high.x, y from low.y to high.y. The texture fills them.
ProxyMesh BillboardMesh(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z);

}  // namespace likeness
