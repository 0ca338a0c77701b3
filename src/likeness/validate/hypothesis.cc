#include "likeness/validate/hypothesis.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/base/parallel.h"

namespace likeness {
namespace {

// Signed permutation matrices but for the identity: every way to name, swap and turn round three axes.
std::vector<Eigen::Matrix3d> AxisChanges(double determinant) {
  std::vector<Eigen::Matrix3d> changes;
  const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (const auto& order : orders) {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) m(row, order[row]) = (signs >> row & 1) != 0 ? -1 : 1;
      if (m.isIdentity(0) || m.determinant() * determinant < 0) continue;
      changes.push_back(m);
    }
  }
  return changes;
}

// "(x, -z, y)": what the corrected point is, in terms of the file's.
std::string AxesText(const Eigen::Matrix3d& m) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    int column = 0;
    m.row(row).cwiseAbs().maxCoeff(&column);
    text += fmt::format("{}{}{}", row == 0 ? "(" : ", ", m(row, column) < 0 ? "-" : "", "xyz"[column]);
  }
  return text + ")";
}

RigidTransform Scaled(const RigidTransform& t, double scale) { return {t.rotation, scale * t.translation}; }

Hypothesis OfCamera(const char* code, const char* what, const char* advice,
                    std::function<Camera(const Camera&)> change) {
  Hypothesis hypothesis;
  hypothesis.code = code, hypothesis.what = what, hypothesis.advice = advice;
  hypothesis.camera = std::move(change);
  return hypothesis;
}

std::function<Camera(const Camera&)> OfExtrinsics(std::function<RigidTransform(const RigidTransform&)> change) {
  return [change = std::move(change)](const Camera& camera) {
    Camera changed = camera;
    changed.cam_from_world = change(camera.cam_from_world);
    return changed;
  };
}

// (x, y) -> (sx x + ox, sy y + oy) of pixels, by K. Offsets are shares of the width and height.
std::function<Camera(const Camera&)> OfPixels(double sx, double ox, double sy, double oy) {
  return [=](const Camera& camera) {
    Camera changed = camera;
    Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
    map(0, 0) = sx, map(0, 2) = ox * camera.width, map(1, 1) = sy, map(1, 2) = oy * camera.height;
    changed.intrinsics = map * camera.intrinsics;
    return changed;
  };
}

std::function<Camera(const Camera&)> OfCameraAxes(const Eigen::Matrix3d& axes) {
  return OfExtrinsics([axes](const RigidTransform& t) -> RigidTransform {
    return {axes * t.rotation, axes * t.translation};
  });
}

Eigen::Matrix3d Flip(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

}  // namespace

Placement Hypothesis::Apply(const Placement& placement) const {
  Placement changed = placement;
  if (camera) changed.camera = camera(placement.camera);
  if (pose) changed.world_from_head = pose(placement.world_from_head);
  changed.mesh_from_file = mesh * placement.mesh_from_file;
  return changed;
}

std::vector<Hypothesis> CameraHypotheses() {
  const auto inverse = [](const RigidTransform& t) { return t.Inverse(); };
  return {
      OfCamera("extrinsics-inverted", "[R | t] is camera to world; it should be world to camera",
               "invert it: R^T and -R^T t", OfExtrinsics(inverse)),
      OfCamera("rotation-transposed", "R is transposed", "write R's rows as rows: x_cam = R x_world + t",
               OfExtrinsics([](const RigidTransform& t) -> RigidTransform {
                 return {t.rotation.transpose(), t.translation};
               })),
      OfCamera("translation-is-centre", "t is the camera's centre C in the world; it should be -R C", "write t = -R C",
               OfExtrinsics([](const RigidTransform& t) -> RigidTransform {
                 return {t.rotation, -(t.rotation * t.translation)};
               })),
      OfCamera("camera-axes-opengl", "camera space is OpenGL's (y up, z backwards); it should be OpenCV's",
               "negate the second and third row of [R | t]", OfCameraAxes(Flip(1, -1, -1))),
      OfCamera("extrinsics-inverted-opengl",
               "[R | t] is camera to world in OpenGL's axes (as in transforms.json); it should be world to camera in "
               "OpenCV's",
               "invert it, then negate the second and third row",
               OfExtrinsics([](const RigidTransform& t) -> RigidTransform {
                 const RigidTransform inverted = t.Inverse();
                 return {Flip(1, -1, -1) * inverted.rotation, Flip(1, -1, -1) * inverted.translation};
               })),
      OfCamera("images-mirrored", "images are mirrored left to right", "flip the images back", OfPixels(-1, 1, 1, 0)),
      OfCamera("images-upside-down", "images are flipped top to bottom", "flip the images back", OfPixels(1, 0, -1, 1)),
      OfCamera("images-rotated", "images are turned by 180 degrees", "turn the images back", OfPixels(-1, 1, -1, 1)),
      OfCamera("camera-axes-mirrored", "x of camera space points left; it should point right",
               "negate the first row of [R | t]", OfCameraAxes(Flip(-1, 1, 1))),
      OfCamera("camera-axes-mirrored",
               "y of camera space points up while x points right and z forward; it should point down",
               "negate the second row of [R | t]", OfCameraAxes(Flip(1, -1, 1))),
      OfCamera("camera-axes-mirrored",
               "z of camera space points backwards while x points right and y down; it should point forward",
               "negate the third row of [R | t]", OfCameraAxes(Flip(1, 1, -1))),
  };
}

std::vector<Hypothesis> WorldHypotheses() {
  std::vector<Hypothesis> list;
  for (const double scale : {1000.0, 10.0, 25.4, 100.0, 0.001, 0.1}) {
    list.push_back(OfCamera("units-calibration", "", "multiply t by the factor: lengths are millimetres",
                            OfExtrinsics([scale](const RigidTransform& t) { return Scaled(t, scale); })));
    list.back().what = fmt::format("the calibration's translations are {}; meshes are in millimetres", UnitName(scale));
    list.back().advice = fmt::format("multiply every t of the calibration by {:g}", scale);
  }
  for (const double determinant : {1.0, -1.0}) {
    for (const Eigen::Matrix3d& axes : AxisChanges(determinant)) {
      Hypothesis hypothesis;
      hypothesis.code = determinant > 0 ? "world-axes" : "world-handedness";
      hypothesis.what = fmt::format(
          "the calibration's world has other axes than the head poses': the point that poses call (x, y, z) is {} to "
          "it",
          AxesText(axes));
      hypothesis.advice =
          "turn the calibration or the poses so that both mean the same world (y-up against z-up is the usual cause)";
      hypothesis.camera = OfExtrinsics([axes](const RigidTransform& t) -> RigidTransform {
        return {t.rotation * axes, t.translation};
      });
      list.push_back(std::move(hypothesis));
    }
  }
  return list;
}

std::vector<Hypothesis> PoseHypotheses() {
  std::vector<Hypothesis> list(3);
  list[0].code = "head-pose-inverted";
  list[0].what = "head poses are world to head; they should be head to world";
  list[0].advice = "invert them: R^T and -R^T t";
  list[0].pose = [](const RigidTransform& t) { return t.Inverse(); };
  list[1].code = "head-pose-transposed";
  list[1].what = "R of the head poses is transposed";
  list[1].advice = "write R's rows as rows: x_world = R x_head + t";
  list[1].pose = [](const RigidTransform& t) -> RigidTransform { return {t.rotation.transpose(), t.translation}; };
  list[2].code = "head-pose-twice";
  list[2].what = "meshes are in world space already: the head pose moves them a second time";
  list[2].advice = "move meshes into head space by the inverse of each pose (or write the identity for every pose)";
  list[2].pose = [](const RigidTransform&) { return RigidTransform(); };
  for (const double scale : {1000.0, 10.0, 25.4, 0.001, 0.1}) {
    Hypothesis hypothesis;
    hypothesis.code = "units-head-pose";
    hypothesis.what = fmt::format("translations of head poses are {}; they should be millimetres", UnitName(scale));
    hypothesis.advice = fmt::format("multiply t of every *_transform.txt by {:g}", scale);
    hypothesis.pose = [scale](const RigidTransform& t) { return Scaled(t, scale); };
    list.push_back(std::move(hypothesis));
  }
  return list;
}

std::vector<Hypothesis> MeshHypotheses(double mesh_size_in_file) {
  std::vector<Hypothesis> list;
  if (const double scale = UnitFromSize(mesh_size_in_file); scale != 1) {
    const auto move = [scale](const RigidTransform& t) { return Scaled(t, scale); };
    for (const int shared : {0, 1, 2}) {
      Hypothesis hypothesis;
      hypothesis.code = shared == 2 ? "units-capture" : "units-mesh";
      const char* who[] = {"the meshes are", "meshes and head poses are", "meshes, head poses and calibration are"};
      hypothesis.what = fmt::format("{} in {}; lengths should be millimetres", who[shared], UnitName(scale));
      hypothesis.advice = fmt::format("multiply {} by {:g}",
                                      shared == 0   ? "all vertices"
                                      : shared == 1 ? "all vertices and the poses' translations"
                                                    : "all vertices, the poses' translations and the calibration's t",
                                      scale);
      hypothesis.mesh = scale * Eigen::Matrix3d::Identity();
      if (shared >= 1) hypothesis.pose = move;
      if (shared == 2) hypothesis.camera = OfExtrinsics(move);
      list.push_back(std::move(hypothesis));
    }
  }
  for (const double determinant : {1.0, -1.0}) {
    for (const Eigen::Matrix3d& axes : AxisChanges(determinant)) {
      Hypothesis hypothesis;
      hypothesis.code = determinant > 0 ? "mesh-axes" : "mesh-mirrored";
      hypothesis.what =
          determinant > 0
              ? fmt::format("meshes have other axes than head space: {} of the file is the point", AxesText(axes))
              : fmt::format("meshes are mirrored: {} of the file is the point", AxesText(axes));
      hypothesis.advice =
          fmt::format("write {} for every vertex: x to the subject's left, y up, z out of the nose", AxesText(axes));
      hypothesis.mesh = axes;
      list.push_back(std::move(hypothesis));
    }
  }
  return list;
}

double UnitFromSize(double diagonal) {
  constexpr double kUsual_mm = 330;
  double best = 1, nearest = std::log(1.9);
  for (const double scale : {1.0, 1000.0, 10.0, 25.4, 100.0, 0.001}) {
    const double off = std::abs(std::log(diagonal * scale / kUsual_mm));
    if (off < nearest) nearest = off, best = scale;
  }
  return best;
}

std::string UnitName(double scale) {
  if (scale == 1000) return "metres";
  if (scale == 100) return "decimetres";
  if (scale == 10) return "centimetres";
  if (scale == 25.4) return "inches";
  if (scale == 0.001) return "micrometres";
  if (scale == 0.1) return "tenths of millimetres";
  return "millimetres";
}

std::vector<Look> LooksAt(const Examination& e, const std::vector<int>& frames, const std::vector<size_t>& cameras) {
  std::vector<Look> looks;
  for (const int f : frames) {
    for (const size_t c : cameras) {
      const View& view = e.frames[static_cast<size_t>(f)].views[c];
      if (!view.empty()) looks.push_back({static_cast<size_t>(f), c, &view});
    }
  }
  return looks;
}

std::vector<ViewFit> FitLooks(const Examination& e, const std::vector<Look>& looks, const Hypothesis* hypothesis) {
  std::vector<ViewFit> fits(looks.size());
  ParallelFor(static_cast<int64_t>(looks.size()), [&](int64_t i) {
    const Look& look = looks[static_cast<size_t>(i)];
    const ExaminedFrame& frame = e.frames[look.frame];
    Placement placement = e.Place(frame, look.camera);
    if (hypothesis != nullptr) placement = hypothesis->Apply(placement);
    fits[static_cast<size_t>(i)] = FitView(*look.view, placement, frame.vertices, e.topology, e.points);
  });
  return fits;
}

std::vector<FitScore> ScoreFrames(const std::vector<Look>& looks, const std::vector<ViewFit>& fits) {
  std::map<size_t, FitScore> scores;
  for (size_t i = 0; i < looks.size(); ++i) {
    FitScore& score = scores[looks[i].frame];
    score.Add(fits[i]);
    for (size_t k = i + 1; k < looks.size(); ++k) {
      if (looks[k].frame == looks[i].frame) score.Add(Agree(fits[i], fits[k]));
    }
  }
  std::vector<FitScore> list;
  for (const auto& [frame, score] : scores) list.push_back(score);
  return list;
}

FitScore ScoreLooks(const std::vector<Look>& looks, const std::vector<ViewFit>& fits) {
  FitScore sum;
  for (const FitScore& score : ScoreFrames(looks, fits)) {
    sum.views += score.views;
    sum.views_with_foreground += score.views_with_foreground;
    sum.overlap_sum += score.overlap_sum;
    sum.inside_sum += score.inside_sum;
    sum.agreement_sum += score.agreement_sum;
    sum.agreement_weight += score.agreement_weight;
  }
  return sum;
}

std::vector<Hypothesis> IntrinsicsFits(const Examination& e, const std::vector<Look>& looks) {
  std::vector<double> scales_x, scales_y, offsets_x, offsets_y;
  for (const Look& look : looks) {
    const ImageU8& foreground = look.view->foreground;
    if (foreground.empty()) continue;
    Eigen::Array2d low(1e9, 1e9), high(-1e9, -1e9), mesh_low = low, mesh_high = high;
    for (int y = 0; y < foreground.height(); ++y) {
      for (int x = 0; x < foreground.width(); ++x) {
        if (*foreground.at(x, y) == 0) continue;
        low = low.min(Eigen::Array2d(x, y));
        high = high.max(Eigen::Array2d(x + 1, y + 1));
      }
    }
    const Placement placement = e.Place(e.frames[look.frame], look.camera);
    const Vertices& vertices = e.frames[look.frame].vertices;
    const Eigen::Matrix3d map = placement.mesh_from_file;
    bool before = true;
    for (const Eigen::Vector3i& t : e.topology.triangles) {
      const Eigen::Vector3d in_world =
          placement.world_from_head * Eigen::Vector3d(map * vertices.row(t[0]).transpose().cast<double>());
      before = before && (placement.camera.cam_from_world * in_world).z() > 0;
      if (!before) break;
      const Eigen::Array2d pixel = placement.camera.Project(in_world).array();
      mesh_low = mesh_low.min(pixel);
      mesh_high = mesh_high.max(pixel);
    }
    if (!before) continue;
    const Eigen::Array2d size = high - low, mesh_size = mesh_high - mesh_low;
    const double width = placement.camera.width, height = placement.camera.height;
    scales_x.push_back(size.x() / mesh_size.x());
    scales_y.push_back(size.y() / mesh_size.y());
    offsets_x.push_back((low.x() + high.x() - mesh_low.x() - mesh_high.x()) / (2 * width));
    offsets_y.push_back((low.y() + high.y() - mesh_low.y() - mesh_high.y()) / (2 * height));
  }
  if (scales_x.empty()) return {};
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  const double fit_x = median(scales_x), fit_y = median(scales_y);
  std::vector<Hypothesis> list;
  const auto add_scale = [&](double sx, double sy) {
    const double across = std::max(std::abs(std::log(sx)), std::abs(std::log(sy)));
    if (!(across > 0.05 && across < 4)) return;
    const auto& camera = e.cameras[looks.front().camera];
    list.push_back(OfCamera("intrinsics-resolution", "", "", OfPixels(sx, 0, sy, 0)));
    list.back().what = fmt::format("K belongs to images of another size: about {:.0f} x {:.0f}, these are {} x {}",
                                   camera.width / sx, camera.height / sy, camera.width, camera.height);
    list.back().advice = sx == sy ? fmt::format("multiply the first two rows of K by {:.5g}", sx)
                                  : fmt::format("multiply the first row of K by {:.5g}, the second by {:.5g}", sx, sy);
  };
  for (const double s : {0.5, 2.0, 0.25, 4.0, 1 / 3.0, 3.0, 0.125, 8.0}) {
    if (std::abs(std::log(fit_y / s)) < 0.4) add_scale(s, s);
  }
  add_scale(std::sqrt(fit_x * fit_y), std::sqrt(fit_x * fit_y));
  add_scale(fit_y, fit_y);
  if (std::abs(std::log(fit_x / fit_y)) > 0.06) add_scale(fit_x, fit_y);
  const double shift_x = median(offsets_x), shift_y = median(offsets_y);
  if (std::max(std::abs(shift_x), std::abs(shift_y)) > 0.03) {
    const auto& camera = e.cameras[looks.front().camera];
    list.push_back(OfCamera("principal-point", "", "", OfPixels(1, shift_x, 1, shift_y)));
    list.back().what = "the principal point is off, as when images were cropped or padded after calibration";
    list.back().advice =
        fmt::format("add about {:.0f} to cx and {:.0f} to cy of K", shift_x * camera.width, shift_y * camera.height);
  }
  return list;
}

std::string DescribeGain(const FitScore& before, const FitScore& after) {
  std::string text;
  if (after.views_with_foreground > 0) {
    text = fmt::format("mesh over foreground {:.0f}% -> {:.0f}%", 100 * before.Overlap(), 100 * after.Overlap());
  }
  if (after.agreement_weight > 0) {
    text += fmt::format("{}agreement of cameras {:.2f} -> {:.2f}", text.empty() ? "" : ", ", before.Agreement(),
                        after.Agreement());
  }
  return text + fmt::format(", in {} pictures", after.views);
}

double ConfidenceOf(double gain) { return 1 - 0.5 * std::exp(-4 * std::max(0.0, gain)); }

}  // namespace likeness
