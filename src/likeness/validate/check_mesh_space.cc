// Head space and texture space by what is known of heads: cameras look at the face, hair is above chins.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

struct Space {
  double volume = 0;  // signed, of the mesh about its middle
  double area = 0;
  double uv_up = 0;          // correlation of v with y over the surface
  double uv_unmirrored = 0;  // share of the texture's area that is not mirrored, seen from outside
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double size = 0;
};

Space Measure(const Examination& e, const ExaminedFrame& frame) {
  const Vertices v = frame.vertices * e.mesh_from_file.cast<float>().transpose();
  Space space;
  for (const Eigen::Vector3i& t : e.topology.triangles) {
    const Eigen::Vector3d a = v.row(t[0]).cast<double>(), b = v.row(t[1]).cast<double>(),
                          c = v.row(t[2]).cast<double>();
    const double area = (b - a).cross(c - a).norm() / 2;
    space.area += area;
    space.middle += area * (a + b + c) / 3;
  }
  space.middle /= space.area;
  space.size = std::sqrt(space.area);
  double n = 0, sy = 0, sv = 0, yy = 0, vv = 0, yv = 0, uv_area = 0, unmirrored = 0;
  for (size_t i = 0; i < e.topology.triangles.size(); ++i) {
    const Eigen::Vector3i& t = e.topology.triangles[i];
    const Eigen::Vector3d a = v.row(t[0]).transpose().cast<double>() - space.middle,
                          b = v.row(t[1]).transpose().cast<double>() - space.middle,
                          c = v.row(t[2]).transpose().cast<double>() - space.middle;
    space.volume += a.dot(b.cross(c)) / 6;
    const auto uv = [&](int k) -> const Eigen::Vector2f& {
      return e.topology.uvs[static_cast<size_t>(e.topology.triangle_uvs[i][k])];
    };
    const Eigen::Vector2f p = uv(1) - uv(0), q = uv(2) - uv(0);
    const double turned = static_cast<double>(p.x()) * q.y() - static_cast<double>(p.y()) * q.x();
    uv_area += std::abs(turned);
    unmirrored += std::max(0.0, turned);
    const double weight = (b - a).cross(c - a).norm(), y = (a + b + c).y() / 3, w = (uv(0) + uv(1) + uv(2)).y() / 3;
    n += weight, sy += weight * y, sv += weight * w, yy += weight * y * y, vv += weight * w * w, yv += weight * y * w;
  }
  const double var_y = yy - sy * sy / n, var_v = vv - sv * sv / n;
  if (var_y > 0 && var_v > 0) space.uv_up = (yv - sy * sv / n) / std::sqrt(var_y * var_v);
  space.uv_unmirrored = uv_area > 0 ? unmirrored / uv_area : 1;
  return space;
}

// Mean directions in head space: to the cameras, and their pictures' up.
struct Views {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero(), up = Eigen::Vector3d::Zero();
};
Views MeanViews(const Examination& e, const ExaminedFrame& frame) {
  Views mean;
  int count = 0;
  for (size_t c = 0; c < e.cameras.size(); ++c) {
    if (frame.views[c].empty()) continue;
    const RigidTransform cam_from_head = e.cameras[c].cam_from_world * frame.world_from_head;
    mean.towards += cam_from_head.Inverse().translation.normalized();
    mean.up -= cam_from_head.rotation.row(1).transpose();
    ++count;
  }
  if (count > 0) mean.towards /= count, mean.up /= count;
  return mean;
}

// "x", "-z": the axis that a direction is nearest to.
std::string AxisName(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", direction[axis] < 0 ? "-" : "", "xyz"[axis]);
}

// Whether an inside-out mesh is mirrored rather than of reversed triangles. Heads are nearly symmetric, so pictures may
// hardly tell; then the texture coordinates do, which reversed triangles leave alone.
bool IsMirrored(const Examination& e, const std::vector<int>& frames, const Space& space) {
  std::vector<size_t> cameras;
  for (size_t c = 0; c < e.cameras.size() && cameras.size() < 6; ++c) cameras.push_back(c);
  const std::vector<Look> looks =
      LooksAt(e, {frames.begin(), frames.begin() + std::min<std::ptrdiff_t>(3, std::ssize(frames))}, cameras);
  Hypothesis mirrored;
  mirrored.mesh = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  const double gain =
      ScoreLooks(looks, FitLooks(e, looks, &mirrored)).Total() - ScoreLooks(looks, FitLooks(e, looks)).Total();
  // Corners in the file's order: what is unmirrored from inside is mirrored from outside.
  const bool uvs_are_mirrored = space.uv_unmirrored > 0.7;
  return gain > 0.02 || (uvs_are_mirrored && gain > -0.02);
}

}  // namespace

void CheckMeshSpace(Examination* e) {
  const std::vector<int> frames = e->SampledFrames();
  if (frames.empty()) return;
  const ExaminedFrame& frame = e->frames[static_cast<size_t>(frames.front())];
  const Space space = Measure(*e, frame);
  const double roundness = space.volume / std::pow(space.size, 3);  // 0.094 for a ball
  const bool mesh_was_corrected = e->mesh_from_file.determinant() < 0;
  if (roundness < -0.01 && !mesh_was_corrected && IsMirrored(*e, frames, space)) {
    Finding& finding =
        e->Found("mesh-mirrored", Severity::kMustFix, "meshes, all frames",
                 "meshes are mirrored: left and right of the head are exchanged", "write (-x, y, z) for every vertex");
    finding.evidence = fmt::format(
        "triangles and texture coordinates are both the wrong way round: the volume is {:.3g} times the area to the "
        "power 1.5 (a head's about 0.06), {:.0f}% of the charts' area is unmirrored inside out",
        roundness, 100 * space.uv_unmirrored);
    finding.confidence = 0.85;
    e->mesh_from_file = Eigen::Vector3d(-1, 1, 1).asDiagonal() * e->mesh_from_file;
  } else if (roundness < -0.01 && !mesh_was_corrected) {
    // A mirrored mesh on mirrored pictures fits, and only its orientation tells.
    Finding& finding = e->Found(
        "mesh-inside-out", Severity::kMustFix, "topology",
        "triangles are clockwise seen from outside: their order is reversed, or the whole capture is mirrored",
        "swap two corners of every face; if left and right are exchanged in the pictures too, mirror images, meshes, "
        "poses and calibration");
    finding.evidence =
        fmt::format("the mesh's volume is {:.3g} times its area to the power 1.5; a head's is about 0.06", roundness);
    finding.confidence = 0.95;
    for (size_t i = 0; i < e->topology.triangles.size(); ++i) {
      std::swap(e->topology.triangles[i][1], e->topology.triangles[i][2]);
      std::swap(e->topology.triangle_uvs[i][1], e->topology.triangle_uvs[i][2]);
    }
    for (SurfacePoint& point : e->points) std::swap(point.b1, point.b2);
  }
  const Space upright = Measure(*e, frame);
  if (e->placed) {
    const Views views = MeanViews(*e, frame);
    const bool away = views.towards.norm() > 0.6 && views.towards.normalized().z() < 0.5;
    const bool tilted = views.up.norm() > 0.6 && views.up.normalized().y() < 0.5;
    if (away || tilted) {
      Finding& finding =
          e->Found("head-axes", Severity::kMustFix, "head space",
                   fmt::format("head space has other axes: cameras look at the head from {} (expected z), and up in "
                               "their pictures is {} (expected y)",
                               AxisName(views.towards), AxisName(views.up)),
                   "turn meshes so that x points to the subject's left, y up and z out of the nose, and multiply every "
                   "head pose by the inverse turn");
      finding.evidence = fmt::format(
          "mean direction to the cameras ({:.2f}, {:.2f}, {:.2f}), mean up ({:.2f}, {:.2f}, {:.2f})", views.towards.x(),
          views.towards.y(), views.towards.z(), views.up.x(), views.up.y(), views.up.z());
      finding.confidence = 0.9;
      return;  // v against y would mislead
    }
    if (upright.middle.norm() > 0.8 * upright.size) {
      e->Found("head-origin", Severity::kWarning, "head space",
               "the origin of head space is far from the head: view vectors are taken from it",
               "move meshes so that the head's centre is the origin, and head poses against it")
          .evidence = fmt::format("the mesh's middle is {:.0f} mm from the origin", upright.middle.norm());
    }
  }
  if (upright.uv_up < -0.3 && upright.uv_unmirrored < 0.3) {
    Finding& finding = e->Found(
        "uv-upside-down", Severity::kMustFix, "topology",
        "v runs downwards: texture coordinates are flipped (v = 1 should be the texture's first row, the forehead)",
        "write 1 - v for every vt");
    finding.evidence = fmt::format("correlation of v with height {:.2f}; {:.0f}% of the charts' area is mirrored",
                                   upright.uv_up, 100 * (1 - upright.uv_unmirrored));
    finding.confidence = 0.9;
    for (Eigen::Vector2f& uv : e->topology.uvs) uv.y() = 1 - uv.y();
  } else if (upright.uv_unmirrored < 0.2) {
    Finding& finding =
        e->Found("uv-mirrored", Severity::kWarning, "topology",
                 "texture coordinates are mirrored: the face in the texture has left and right exchanged",
                 "write 1 - u for every vt, unless that is how the charts are meant");
    finding.evidence = fmt::format("{:.0f}% of the charts' area is mirrored", 100 * (1 - upright.uv_unmirrored));
    finding.confidence = 0.8;
  }
}

}  // namespace likeness
