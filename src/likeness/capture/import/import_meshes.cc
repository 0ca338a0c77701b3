#include "likeness/capture/import/import_meshes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <atomic>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// The file of a frame; a pattern without {segment} or {frame} stands for all of them.
const fs::path* FileOf(const std::map<PatternParts, fs::path>& files, const FrameId& frame) {
  for (const PatternParts& parts : {PatternParts{frame.segment, "", frame.frame}, PatternParts{"", "", frame.frame},
                                    PatternParts{frame.segment, "", ""}, PatternParts{}}) {
    if (const auto it = files.find(parts); it != files.end()) return &it->second;
  }
  return nullptr;
}

bool IsObj(const fs::path& path) { return path.extension() == ".obj" || path.extension() == ".OBJ"; }

Eigen::Vector3d ParseUp(const std::string& text, const std::vector<Camera>& cameras) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  if (text.empty()) {
    for (const Camera& camera : cameras) up -= camera.cam_from_world.rotation.row(1);
  } else {
    TextLines line("--up", text);
    line.Next();
    const auto words = line.Fields(',');
    if (words.size() != 3) throw Error("--up {}: expected a direction in the world, as 0,1,0", text);
    for (int i = 0; i < 3; ++i) up[i] = line.Number(words[static_cast<size_t>(i)]);
  }
  if (up.norm() < 1e-6) throw Error("the cameras do not agree on what is up; give a direction with --up x,y,z");
  return up.normalized();
}

class MeshImporter {
 public:
  MeshImporter(const ImportOptions& options, const std::vector<FrameId>& frames, const std::vector<Camera>& cameras)
      : options_(options), frames_(frames), cameras_(cameras), writer_(options.out) {
    mesh_scale_ =
        options.mesh_unit == "same" ? MillimetresPer(options.unit) * options.scale : MillimetresPer(options.mesh_unit);
    meshes_ = FindFiles(options.meshes);
    if (!options.poses.empty()) poses_ = FindFiles(options.poses);
  }

  void Run(ImportResult* result) {
    std::vector<FrameId> with_mesh;
    for (const FrameId& frame : frames_) {
      if (FileOf(meshes_, frame) != nullptr) with_mesh.push_back(frame);
    }
    if (with_mesh.empty()) {
      throw Error("--meshes '{}': none of its {} files belongs to a frame that has images", options_.meshes,
                  meshes_.size());
    }
    FindTopology(with_mesh.front());
    if (options_.mesh_space == "world") FindFirstHead(with_mesh.front());
    std::atomic<int> without_pose = 0;
    ParallelFor(static_cast<int64_t>(with_mesh.size()), [&](int64_t i) {
      if (!Write(with_mesh[static_cast<size_t>(i)])) ++without_pose;
    });
    result->meshes = static_cast<int>(with_mesh.size());
    if (const size_t missing = frames_.size() - with_mesh.size(); missing > 0) {
      result->remarks.push_back(fmt::format("{} frames have no tracked mesh and will be left out", missing));
    }
    if (without_pose > 0) {
      result->remarks.push_back(
          fmt::format("{} frames with a mesh have no head pose and will be left out; give --poses, or --mesh-space "
                      "world where meshes stand in the cameras' world",
                      without_pose.load()));
    }
  }

 private:
  void FindTopology(const FrameId& first) {
    fs::path path = options_.topology;
    if (path.empty() && IsObj(*FileOf(meshes_, first))) path = *FileOf(meshes_, first);
    if (path.empty()) throw Error("meshes are no .obj: name one with faces and UVs with --topology");
    topology_ = TopologyFromObj(ReadObj(path), path.string());
    topology_.Check(path.string());
    if (topology_.triangles.empty()) throw FileError(path, "has no faces");
    std::vector<bool> used(static_cast<size_t>(topology_.vertex_count), false);
    for (const Eigen::Vector3i& triangle : topology_.triangles) {
      for (const int vertex : triangle) used[static_cast<size_t>(vertex)] = true;
    }
    for (int i = 0; i < topology_.vertex_count; ++i) {
      if (used[static_cast<size_t>(i)]) used_.push_back(i);
    }
  }

  // In millimetres.
  Vertices ReadMesh(const FrameId& frame) const {
    const fs::path& path = *FileOf(meshes_, frame);
    Vertices vertices;
    if (IsObj(path)) {
      vertices = ReadObj(path).vertices;
      if (vertices.rows() != topology_.vertex_count) {
        throw FileError(path,
                        fmt::format("has {} vertices; the topology has {}", vertices.rows(), topology_.vertex_count));
      }
    } else {
      const auto values = ReadFloats(path, 3 * static_cast<size_t>(topology_.vertex_count));
      vertices = Eigen::Map<const Vertices>(values.data(), topology_.vertex_count, 3);
    }
    vertices *= static_cast<float>(mesh_scale_);
    if (!vertices.allFinite()) throw FileError(path, "has vertices that are not finite");
    return vertices;
  }

  Eigen::MatrixX3d Used(const Vertices& vertices) const {
    Eigen::MatrixX3d rows(static_cast<Eigen::Index>(used_.size()), 3);
    for (size_t i = 0; i < used_.size(); ++i) {
      rows.row(static_cast<Eigen::Index>(i)) = vertices.row(used_[i]).cast<double>();
    }
    return rows;
  }

  void FindFirstHead(const FrameId& first) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Camera& camera : cameras_) centre += camera.CentreInWorld() / static_cast<double>(cameras_.size());
    first_in_world_ = Used(ReadMesh(first));
    first_pose_ = HeadAxes(first_in_world_, centre, ParseUp(options_.up, cameras_));
  }

  // False when the frame has no pose; its mesh is written all the same.
  bool Write(const FrameId& frame) const {
    Vertices vertices = ReadMesh(frame);
    if (options_.mesh_space == "world") {
      const RigidTransform pose = AlignRigidly(first_in_world_, Used(vertices)) * first_pose_;
      const RigidTransform head_from_world = pose.Inverse();
      for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
        const Eigen::Vector3d in_world = vertices.row(i).cast<double>();
        vertices.row(i) = (head_from_world * in_world).cast<float>();
      }
      writer_.WriteTracked(frame, {vertices, pose});
      writer_.WriteObj(frame, vertices, topology_);
      return true;
    }
    writer_.WriteObj(frame, vertices, topology_);
    const fs::path* file = FileOf(poses_, frame);
    if (file == nullptr) {
      WriteFloats(writer_.layout().MeshBinary(frame), {vertices.data(), static_cast<size_t>(vertices.size())});
      return false;
    }
    RigidTransform pose = ParseTransform(*file, ReadFile(*file, 1 << 16));
    pose.translation *= mesh_scale_;
    writer_.WriteTracked(frame, {vertices, pose});
    return true;
  }

  const ImportOptions& options_;
  const std::vector<FrameId>& frames_;
  const std::vector<Camera>& cameras_;
  const CaptureWriter writer_;
  double mesh_scale_ = 1;  // to millimetres
  std::map<PatternParts, fs::path> meshes_, poses_;
  MeshTopology topology_;
  std::vector<int> used_;  // vertices that belong to a triangle
  Eigen::MatrixX3d first_in_world_;
  RigidTransform first_pose_;  // world from head
};

}  // namespace

double MillimetresPer(const std::string& unit) {
  static const std::map<std::string, double> units = {{"m", 1000}, {"cm", 10}, {"mm", 1}, {"inch", 25.4}};
  const auto it = units.find(unit);
  if (it == units.end()) throw Error("there is no unit '{}'; expected m, cm, mm or inch", unit);
  return it->second;
}

RigidTransform HeadAxes(const Eigen::MatrixX3d& vertices_in_world, const Eigen::Vector3d& camera_centre,
                        const Eigen::Vector3d& up) {
  RigidTransform pose;
  pose.translation = vertices_in_world.colwise().mean().transpose();
  const Eigen::Vector3d y = up.normalized(), towards = camera_centre - pose.translation;
  const Eigen::Vector3d level = towards - y * y.dot(towards);
  if (!(level.norm() > 1e-3 * towards.norm())) {
    throw Error("the mean camera stands right above or below the head: where its front is cannot be told; check --up");
  }
  const Eigen::Vector3d z = level.normalized();
  pose.rotation << y.cross(z), y, z;
  return pose;
}

void ImportMeshes(const ImportOptions& options, const std::vector<FrameId>& frames, const std::vector<Camera>& cameras,
                  ImportResult* result) {
  MeshImporter(options, frames, cameras).Run(result);
}

}  // namespace likeness
