#include "likeness/capture/proxy.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/text.h"
#include "likeness/capture/derived_folder.h"
#include "likeness/capture/proxy_record.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/proxy_mesh.h"
#include "likeness/geometry/smooth.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kDirections = 1000;            // that extreme vertices are looked for in
constexpr double kMostOffFrontCosine = 0.5;  // of cameras that a board is made for: 60 degrees

const std::vector<std::pair<std::string, Geometry>> kKinds = {
    {"taubin", Geometry::kSmoothed}, {"ellipsoid", Geometry::kEllipsoid}, {"billboard", Geometry::kBillboard}};

// Evenly over the sphere, on a spiral.
Eigen::Matrix3Xf Directions() {
  Eigen::Matrix3Xf directions(3, kDirections);
  for (int i = 0; i < kDirections; ++i) {
    const double y = 1 - 2 * (i + 0.5) / kDirections, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - y * y);
    directions.col(i) << static_cast<float>(r * std::cos(turn)), static_cast<float>(y),
        static_cast<float>(r * std::sin(turn));
  }
  return directions;
}

class Maker {
 public:
  Maker(const Capture& source, const ProxyOptions& options)
      : source_(source), options_(options), writer_(options.out), triangles_(source.topology().triangles) {
    std::vector<bool> used(source.topology().vertex_count, false);
    for (const Eigen::Vector3i& triangle : triangles_) {
      for (const int vertex : triangle) used[vertex] = true;
    }
    for (size_t i = 0; i < used.size(); ++i) {
      if (used[i]) used_.push_back(static_cast<int>(i));
    }
  }

  ProxyReport Run() {
    CheckSource();
    CheckApart(source_.root(), options_.out);
    ClaimFolder(options_.out, "proxy.json", "made",
                {{"source", AbsolutePath(source_.root()).string()},
                 {"kind", options_.kind},
                 {"iterations", ProxyGeometry(options_.kind) == Geometry::kSmoothed ? options_.iterations : 0}});
    report_.geometry = ProxyGeometry(options_.kind);
    if (report_.geometry == Geometry::kEllipsoid) still_ = FitEllipsoid();
    if (report_.geometry == Geometry::kBillboard) still_ = FitBillboard();
    WriteTables();
    WriteMeshes();
    LinkImages();
    const MeshTopology& topology = still_.vertices.size() > 0 ? still_.topology : source_.topology();
    report_.frames = static_cast<int>(source_.frames().size());
    report_.vertices = topology.vertex_count;
    report_.triangles = static_cast<int>(topology.triangles.size());
    report_.files_linked = linked_;
    report_.files_kept = kept_;
    return report_;
  }

 private:
  void CheckSource() const {
    if (source_.layout_name() != "Multiface") {
      throw Error("{}: is a capture in the layout of {}, whose images cannot be shared; first: likeness convert {} OUT",
                  source_.root().string(), source_.layout_name(), source_.root().string());
    }
    if (const Geometry geometry = GeometryOf(source_.root()); geometry != Geometry::kTracked) {
      throw Error("{}: its meshes are {} already; name the capture that they were made from", source_.root().string(),
                  ToString(geometry));
    }
  }

  template <typename Work>  // work(frame's index, tracked frame)
  void ForFrames(const char* what, const Work& work) {
    const auto count = static_cast<int64_t>(source_.frames().size());
    Progress progress(what, count, "frames");
    ParallelFor(count, [&](int64_t i) {
      if (interrupt_.Requested()) return;
      work(static_cast<size_t>(i), source_.ReadTracked(source_.frames()[static_cast<size_t>(i)]));
      progress.Advance();
    });
    progress.Finish();
    StopIfAsked();
  }

  void StopIfAsked() const {
    if (interrupt_.Requested()) throw Error("interrupted; the same command goes on with {}", options_.out.string());
  }

  ProxyMesh FitEllipsoid() {
    const Eigen::Matrix3Xf directions = Directions();
    Eigen::VectorXf farthest = Eigen::VectorXf::Constant(kDirections, -std::numeric_limits<float>::max());
    Eigen::MatrixX3d extreme(kDirections, 3);
    std::mutex mutex;
    ForFrames("fit an ellipsoid", [&](size_t, const TrackedFrame& tracked) {
      const Vertices vertices = tracked.vertices_in_head(used_, Eigen::all);
      const Eigen::MatrixXf along = vertices * directions;
      const std::lock_guard lock(mutex);
      for (int d = 0; d < kDirections; ++d) {
        Eigen::Index vertex = 0;
        const float most = along.col(d).maxCoeff(&vertex);
        if (most <= farthest[d]) continue;
        farthest[d] = most;
        extreme.row(d) = vertices.row(vertex).cast<double>();
      }
    });
    Ellipsoid ellipsoid = EnclosingEllipsoid(extreme);
    // What lies between the directions may still stick out a little.
    std::vector<double> radii(source_.frames().size());
    ForFrames("grow the ellipsoid", [&](size_t i, const TrackedFrame& tracked) {
      for (const int v : used_) {
        radii[i] = std::max(radii[i], ellipsoid.RadiiOf(tracked.vertices_in_head.row(v).transpose().cast<double>()));
      }
    });
    ellipsoid.from_ball *= std::max(1.0, *std::max_element(radii.begin(), radii.end()));
    return EllipsoidMesh(ellipsoid);
  }

  ProxyMesh FitBillboard() {
    std::vector<double> depths(source_.frames().size());
    ForFrames("place a board",
              [&](size_t i, const TrackedFrame& tracked) { depths[i] = FrontDepth(tracked.vertices_in_head); });
    double z = 0;
    for (const double depth : depths) z += depth / static_cast<double>(depths.size());
    Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::max()), high = -low;
    std::mutex mutex;
    ForFrames("size the board", [&](size_t, const TrackedFrame& tracked) {
      const auto [frame_low, frame_high] = Silhouettes(tracked, z);
      const std::lock_guard lock(mutex);
      low = low.min(frame_low);
      high = high.max(frame_high);
    });
    return BillboardMesh(low, high, z);
  }

  // Mean z, by area as the front sees it, of the triangles that face the front.
  double FrontDepth(const Vertices& vertices) const {
    double sum = 0, area = 0;
    for (const Eigen::Vector3i& t : triangles_) {
      const Eigen::RowVector3d a = vertices.row(t[0]).cast<double>(), b = vertices.row(t[1]).cast<double>(),
                               c = vertices.row(t[2]).cast<double>();
      const double facing = std::max(0.0, (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()));
      sum += facing * (a.z() + b.z() + c.z()) / 3;
      area += facing;
    }
    if (area == 0) throw Error("{}: nothing of a mesh faces the front", source_.root().string());
    return sum / area;
  }

  // The corners of the vertices' shadows on the plane at z, from infinity and from the cameras before it.
  std::pair<Eigen::Array2d, Eigen::Array2d> Silhouettes(const TrackedFrame& tracked, double z) const {
    const Eigen::MatrixX3d points = tracked.vertices_in_head(used_, Eigen::all).cast<double>();
    Eigen::Array2d low = points.leftCols<2>().colwise().minCoeff().transpose();
    Eigen::Array2d high = points.leftCols<2>().colwise().maxCoeff().transpose();
    for (const Camera& camera : source_.cameras()) {
      const Eigen::RowVector3d eye = (tracked.world_from_head.Inverse() * camera.CentreInWorld()).transpose();
      if (eye.z() < kMostOffFrontCosine * eye.norm() || eye.z() <= points.col(2).maxCoeff()) continue;
      const Eigen::ArrayXd share = (eye.z() - z) / (eye.z() - points.col(2).array());
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::ArrayXd shadow = eye[axis] + share * (points.col(axis).array() - eye[axis]);
        low[axis] = std::min(low[axis], shadow.minCoeff());
        high[axis] = std::max(high[axis], shadow.maxCoeff());
      }
    }
    return {low, high};
  }

  void WriteTables() const {
    writer_.WriteCalibration(source_.cameras());
    writer_.WriteFrameList(source_.frames());
    const Split& split = source_.split();
    if (!split.held_out_cameras.empty() || !split.held_out_segments.empty() ||
        split.training_cameras.size() != source_.cameras().size()) {
      writer_.WriteSplit(split);
    }
    WriteGeometry(options_.out, report_.geometry);
  }

  void WriteMeshes() {
    const bool still = still_.vertices.size() > 0;
    ForFrames("write meshes", [&](size_t i, TrackedFrame tracked) {
      const FrameId& frame = source_.frames()[i];
      const CaptureLayout& layout = writer_.layout();
      if (Exists(layout.MeshBinary(frame)) && Exists(layout.HeadPose(frame))) return;
      tracked.vertices_in_head =
          still ? still_.vertices : TaubinSmooth(tracked.vertices_in_head, triangles_, {options_.iterations});
      writer_.WriteTracked(frame, tracked);
      // Faces and texture coordinates once: readers need no more.
      if (i == 0) writer_.WriteObj(frame, tracked.vertices_in_head, still ? still_.topology : source_.topology());
    });
  }

  // Paths in a capture are the same in every capture, so that the way from one link tells all.
  void LinkImages() {
    const fs::path from = AbsolutePath(source_.root()), to = AbsolutePath(options_.out);
    const CaptureLayout source(from), out(to);
    const auto cameras = static_cast<int64_t>(source_.cameras().size());
    const auto count = cameras * static_cast<int64_t>(source_.frames().size());
    Progress progress("link images", count, "images");
    ParallelFor(count, [&](int64_t i) {
      if (interrupt_.Requested()) return;
      const FrameId& frame = source_.frames()[static_cast<size_t>(i / cameras)];
      const std::string& camera = source_.cameras()[static_cast<size_t>(i % cameras)].name;
      Link(source.Image(frame, camera), out.Image(frame, camera));
      Link(source.HeadMask(frame, camera), out.HeadMask(frame, camera));
      progress.Advance();
    });
    for (const Camera& camera : source_.cameras()) Link(source.ValidMask(camera.name), out.ValidMask(camera.name));
    progress.Finish();
    StopIfAsked();
  }

  void Link(const fs::path& from, const fs::path& to) {
    std::error_code code;
    if (!Exists(from)) return;
    if (fs::is_symlink(to, code)) {
      ++kept_;
      return;
    }
    fs::create_directories(to.parent_path(), code);
    if (!code) fs::create_symlink(from.lexically_relative(to.parent_path()), to, code);
    if (code) throw FileError(to, fmt::format("cannot be made a link to {}: {}", from.string(), code.message()));
    ++linked_;
  }

  const Capture& source_;
  const ProxyOptions& options_;
  const CaptureWriter writer_;
  const std::vector<Eigen::Vector3i>& triangles_;
  std::vector<int> used_;  // vertices in triangles
  ProxyMesh still_;        // the mesh of all frames; empty when each has its own
  const InterruptScope interrupt_;
  ProxyReport report_;
  std::atomic<int64_t> linked_ = 0, kept_ = 0;
};

}  // namespace

const std::vector<std::string>& ProxyKinds() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, geometry] : kKinds) all.push_back(name);
    return all;
  }();
  return names;
}

Geometry ProxyGeometry(const std::string& kind) {
  for (const auto& [name, geometry] : kKinds) {
    if (name == kind) return geometry;
  }
  throw Error("--kind is '{}'; known are {}", kind, fmt::join(ProxyKinds(), ", "));
}

void ProxyOptions::Check() const {
  if (out.empty()) throw Error("a proxy capture needs a folder to go to");
  ProxyGeometry(kind);
  TaubinOptions{iterations}.Check();
}

ProxyReport MakeProxy(const Capture& source, const ProxyOptions& options) {
  options.Check();
  return Maker(source, options).Run();
}

}  // namespace likeness
