// Meshes, their topology and the head poses, as files and numbers.

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/geometry/obj.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/raw_calibration.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostMeshes = 400;  // read unless --all
constexpr size_t kMostPoses = 4000;

fs::path FindObj(const Examination& e) {
  if (!e.options.capture.topology_file.empty()) return e.options.capture.topology_file;
  for (const ExaminedFrame& frame : e.frames) {
    if (Exists(e.layout.MeshObj(frame.id))) return e.layout.MeshObj(frame.id);
  }
  return {};
}

// Vertices that the binaries have, by majority; 0 when there are none.
int64_t CommonVertexCount(const Examination& e) {
  std::map<int64_t, int> votes;
  for (const size_t i : EvenlySpread(e.frames.size(), 25)) {
    std::error_code failed;
    const auto bytes = fs::file_size(e.layout.MeshBinary(e.frames[i].id), failed);
    if (!failed && bytes > 0 && bytes % 12 == 0) ++votes[static_cast<int64_t>(bytes / 12)];
  }
  const auto most = std::max_element(votes.begin(), votes.end(), [](auto& a, auto& b) { return a.second < b.second; });
  return most == votes.end() ? 0 : most->first;
}

void CheckUvs(Examination* e, const std::string& where) {
  size_t outside = 0;
  for (const Eigen::Vector2f& uv : e->topology.uvs) {
    outside += !(uv.x() >= -1e-4f && uv.y() >= -1e-4f && uv.x() <= 1.0001f && uv.y() <= 1.0001f);
  }
  if (outside == 0) return;
  const double share = static_cast<double>(outside) / static_cast<double>(e->topology.uvs.size());
  e->Found("uv-outside", share > 0.02 ? Severity::kMustFix : Severity::kWarning, where,
           "texture coordinates lie outside [0, 1], where the texture ends",
           "scale or move the charts into the unit square (texture coordinates in pixels are divided by the size)")
      .evidence = fmt::format("{} of {} texture coordinates", outside, e->topology.uvs.size());
}

struct Box {
  Eigen::Vector3d centre, size;
};
Box BoxOf(const Vertices& vertices) {
  const Eigen::RowVector3f low = vertices.colwise().minCoeff(), high = vertices.colwise().maxCoeff();
  return {(0.5f * (low + high)).transpose().cast<double>(), (high - low).transpose().cast<double>()};
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Frames whose box has another place or size than most.
void CheckOutliers(Examination* e, const std::vector<std::pair<size_t, Box>>& boxes) {
  if (boxes.size() < 3) return;
  Box usual;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> centres, sizes;
    for (const auto& [frame, box] : boxes) centres.push_back(box.centre[axis]), sizes.push_back(box.size[axis]);
    usual.centre[axis] = Median(centres), usual.size[axis] = Median(sizes);
  }
  const double size = usual.size.norm();
  std::vector<std::string> names;
  std::string evidence;
  for (const auto& [frame, box] : boxes) {
    const double moved = (box.centre - usual.centre).norm() / size, ratio = box.size.norm() / size;
    if (moved < 0.3 && ratio > 0.7 && ratio < 1.4) continue;
    if (names.empty()) {
      evidence = fmt::format("its box is {:.3g} times the usual size and its centre {:.3g} mm from the usual one",
                             ratio, (box.centre - usual.centre).norm());
    }
    names.push_back(e->frames[frame].id.segment + "/" + e->frames[frame].id.frame);
    e->frames[frame].has_mesh = false;
  }
  if (names.empty()) return;
  Finding& finding =
      e->Found("mesh-outlier", Severity::kMustFix, "tracked_mesh/" + names.front() + ".bin",
               fmt::format("{} meshes lie or extend far from where all others do: {}", names.size(), SomeOf(names)),
               "track these frames again, or take them off frame_list.txt");
  finding.evidence = evidence;
  finding.confidence = 0.95;
}

void ReadPoses(Examination* e) {
  std::vector<std::string> unreadable, not_rigid;
  std::string problem, evidence;
  const std::vector<size_t> chosen = EvenlySpread(e->frames.size(), e->options.all ? e->frames.size() : kMostPoses);
  for (ExaminedFrame& frame : e->frames) frame.has_pose = false;
  for (const size_t i : chosen) {
    ExaminedFrame& frame = e->frames[i];
    const fs::path path = e->layout.HeadPose(frame.id);
    try {
      const auto rows = ParseRawTransform(path, ReadFile(path, 1 << 16));
      frame.world_from_head = {rows.leftCols<3>(), rows.col(3)};
      frame.has_pose = true;
    } catch (const Error& error) {
      if (unreadable.empty()) problem = error.what();
      unreadable.push_back(frame.id.segment + "/" + frame.id.frame);
      continue;
    }
    Eigen::Matrix3d& r = frame.world_from_head.rotation;
    if (RotationDefect(r) <= 1e-3) continue;
    if (not_rigid.empty()) {
      evidence = fmt::format("det R = {:.4g}, R^T R differs from the identity by {:.3g}", r.determinant(),
                             (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff());
    }
    not_rigid.push_back(frame.id.segment + "/" + frame.id.frame);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (r.allFinite() && r.determinant() > 0) r = svd.matrixU() * svd.matrixV().transpose();
  }
  if (!unreadable.empty()) {
    e->Found("head-pose-unreadable", Severity::kMustFix, "tracked_mesh/" + unreadable.front() + "_transform.txt",
             problem, "write three lines of four finite numbers, [R | t] from head to world");
  }
  if (!not_rigid.empty()) {
    e->Found("head-pose-not-rigid", Severity::kMustFix, "tracked_mesh/" + not_rigid.front() + "_transform.txt",
             fmt::format("{} head poses are no rotation and translation: {}", not_rigid.size(), SomeOf(not_rigid)),
             "write [R | t] with a rotation R; scale belongs into the mesh")
        .evidence = evidence;
  }
}

}  // namespace

void CheckTopology(Examination* e) {
  if (!e->multiface) {
    e->topology = e->capture->topology();
    CheckUvs(e, "topology");
    return;
  }
  const fs::path path = FindObj(*e);
  if (path.empty()) {
    if (e->frames.empty()) return;
    e->Found("topology-missing", Severity::kMustFix, "tracked_mesh",
             "no frame has an .obj, which gives faces and texture coordinates", "copy one, or name it with --topology");
    return;
  }
  try {
    MeshTopology topology = TopologyFromObj(ReadObj(path), path.string());
    topology.Check(path.string());
    if (topology.triangles.empty()) throw FileError(path, "has no faces");
    e->topology = std::move(topology);
  } catch (const Error& error) {
    e->Found("topology-unreadable", Severity::kMustFix, e->Relative(path), error.what(),
             "write v, vt and f v/vt, 1-based; or name another file with --topology");
    return;
  }
  CheckUvs(e, e->Relative(path));
  const int64_t common = CommonVertexCount(*e);
  if (common == 0 || common == e->topology.vertex_count) return;
  e->Found("topology-vertex-count", Severity::kMustFix, e->Relative(path),
           "the topology belongs to another mesh than the tracked ones", "name the right one with --topology")
      .evidence = fmt::format("it has {} vertices, the binaries {}", e->topology.vertex_count, common);
  e->topology = MeshTopology();
}

void CheckMeshes(Examination* e) {
  if (!e->multiface) {
    for (ExaminedFrame& frame : e->frames) frame.has_pose = false;
    for (const size_t i : EvenlySpread(e->frames.size(), e->options.all ? e->frames.size() : kMostMeshes)) {
      ExaminedFrame& frame = e->frames[i];
      try {
        frame.world_from_head = e->capture->ReadTracked(frame.id).world_from_head;
        frame.has_pose = true;
      } catch (const Error& error) {
        frame.has_mesh = false;
        e->Found("mesh-unreadable", Severity::kMustFix, frame.id.segment + "/" + frame.id.frame, error.what(),
                 "copy the file again, or take the frame off the list");
      }
    }
    return;
  }
  ReadPoses(e);
  if (e->topology.vertex_count == 0) return;
  const auto expected = static_cast<uintmax_t>(e->topology.vertex_count) * 12;
  std::vector<std::string> wrong_count, not_finite;
  std::string count_evidence;
  const std::vector<size_t> chosen = EvenlySpread(e->frames.size(), e->options.all ? e->frames.size() : kMostMeshes);
  std::vector<char> is_chosen(e->frames.size());
  for (const size_t i : chosen) is_chosen[i] = 1;
  std::vector<std::pair<size_t, Box>> boxes;
  for (size_t i = 0; i < e->frames.size(); ++i) {
    ExaminedFrame& frame = e->frames[i];
    const std::string name = frame.id.segment + "/" + frame.id.frame;
    std::error_code failed;
    const auto bytes = fs::file_size(e->layout.MeshBinary(frame.id), failed);
    if (failed || bytes != expected) {
      if (wrong_count.empty()) {
        count_evidence = fmt::format("{} bytes are {:.6g} vertices, the topology has {}", failed ? 0 : bytes,
                                     failed ? 0.0 : static_cast<double>(bytes) / 12, e->topology.vertex_count);
      }
      wrong_count.push_back(name);
      frame.has_mesh = false;
      continue;
    }
    if (is_chosen[i] == 0) continue;
    try {
      boxes.emplace_back(i, BoxOf(e->ReadVertices(frame.id)));
    } catch (const Error&) {
      not_finite.push_back(name);
      frame.has_mesh = false;
    }
  }
  if (!wrong_count.empty()) {
    e->Found("mesh-vertex-count", Severity::kMustFix, "tracked_mesh/" + wrong_count.front() + ".bin",
             fmt::format("{} meshes have another number of vertices than the topology: {}", wrong_count.size(),
                         SomeOf(wrong_count)),
             "copy the files again (12 bytes a vertex: float32 x, y, z), or take the frames off frame_list.txt")
        .evidence = count_evidence;
  }
  if (!not_finite.empty()) {
    e->Found("mesh-not-finite", Severity::kMustFix, "tracked_mesh/" + not_finite.front() + ".bin",
             fmt::format("{} meshes hold numbers that are not finite: {}", not_finite.size(), SomeOf(not_finite)),
             "track these frames again, or take them off frame_list.txt");
  }
  CheckOutliers(e, boxes);
}

}  // namespace likeness
