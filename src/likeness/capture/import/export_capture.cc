#include "likeness/capture/import/export_capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration_formats/colmap.h"
#include "likeness/capture/calibration_formats/nerfstudio.h"
#include "likeness/capture/import/import_meshes.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

FrameId FindFrame(const Capture& capture, const std::string& name) {
  if (name.empty()) return capture.frames().front();
  std::vector<std::string> known;
  for (const FrameId& frame : capture.frames()) {
    known.push_back(frame.segment + '/' + frame.frame);
    if (known.back() == name) return frame;
  }
  const std::string nearest = NearestWord(name, known);
  throw Error("{}: there is no frame '{}'{}", capture.root().string(), name,
              nearest.empty() ? "; expected SEGMENT/FRAME" : fmt::format(", did you mean '{}'?", nearest));
}

// The capture's own file where it has one under the layout's name, else its pixels.
void PlaceImage(const Capture& capture, const FrameId& frame, const Camera& camera, const fs::path& to, bool link) {
  const fs::path from = CaptureLayout(capture.root()).Image(frame, camera.name);
  if (!LooksWholePng(from)) {
    WritePng(to, capture.ReadCameraImage(frame, camera), 1);
    return;
  }
  WriteFileWith(
      to,
      [&](const fs::path& temporary) {
        if (link) {
          fs::create_symlink(fs::absolute(from), temporary);
        } else {
          fs::copy_file(from, temporary, fs::copy_options::overwrite_existing);
        }
      },
      Sync::kNo);
}

// Head and valid together; none where all pixels may be used.
std::optional<ImageU8> UsableMask(const Capture& capture, const FrameId& frame, const Camera& camera) {
  std::optional<ImageU8> mask = capture.ReadHeadMask(frame, camera);
  std::optional<ImageU8> valid = capture.ReadValidMask(camera);
  if (!mask) return valid;
  for (size_t i = 0; valid && i < mask->values().size(); ++i) mask->values()[i] &= valid->values()[i];
  return mask;
}

// The mesh's vertices in the world, mm, each with the colour of the camera that it faces.
std::vector<ColouredPoint> MeshPoints(const Capture& capture, const FrameId& frame,
                                      const std::vector<Camera>& cameras) {
  const TrackedFrame tracked = capture.ReadTracked(frame);
  const Vertices normals = VertexNormals(tracked.vertices_in_head, capture.topology().triangles);
  std::vector<ColouredPoint> points;
  std::vector<size_t> facing;
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    if (normals.row(i).isZero()) continue;  // in no triangle
    const Eigen::Vector3d point = tracked.world_from_head * tracked.vertices_in_head.row(i).transpose().cast<double>();
    const Eigen::Vector3d normal = tracked.world_from_head.rotation * normals.row(i).transpose().cast<double>();
    const auto cosine = [&](const Camera& camera) { return normal.dot((camera.CentreInWorld() - point).normalized()); };
    const auto best = std::max_element(cameras.begin(), cameras.end(),
                                       [&](const Camera& a, const Camera& b) { return cosine(a) < cosine(b); });
    points.push_back({point, {128, 128, 128}});
    facing.push_back(static_cast<size_t>(best - cameras.begin()));
  }
  ParallelFor(static_cast<int64_t>(cameras.size()), [&](int64_t c) {
    const Camera& camera = cameras[static_cast<size_t>(c)];
    const ImageU8 image = capture.ReadCameraImage(frame, camera);
    for (size_t i = 0; i < points.size(); ++i) {
      if (facing[i] != static_cast<size_t>(c) || (camera.cam_from_world * points[i].position).z() <= 0) continue;
      const Eigen::Vector2d pixel = camera.Project(points[i].position);
      if (!(pixel.minCoeff() >= 0 && pixel.x() < image.width() && pixel.y() < image.height())) continue;
      std::copy_n(image.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())), 3, points[i].rgb.begin());
    }
  });
  return points;
}

std::string FormatPly(const std::vector<ColouredPoint>& points) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      points.size());
  for (const ColouredPoint& point : points) {
    const Eigen::Vector3f position = point.position.cast<float>();
    bytes.append(reinterpret_cast<const char*>(position.data()), 3 * sizeof(float));
    bytes.append(reinterpret_cast<const char*>(point.rgb.data()), 3);
  }
  return bytes;
}

}  // namespace

void ExportOptions::Check() const {
  if (out.empty()) throw Error("an export needs a folder to go to");
  if (format != "nerfstudio" && format != "colmap") throw Error("--format {}: expected nerfstudio or colmap", format);
  MillimetresPer(unit);
}

ExportResult ExportCapture(const Capture& capture, const ExportOptions& options) {
  options.Check();
  const bool colmap = options.format == "colmap";
  ExportResult result;
  result.frame = FindFrame(capture, options.frame);
  std::vector<Camera> cameras;
  for (const Camera& camera : capture.cameras()) {
    if (capture.HasCameraImage(result.frame, camera)) {
      cameras.push_back(camera);
    } else {
      result.without_image.push_back(camera.name);
    }
  }
  if (cameras.empty()) throw Error("{}: no camera has an image of this frame", capture.root().string());
  DistortedCameras written(cameras.size());
  ParallelFor(static_cast<int64_t>(cameras.size()), [&](int64_t i) {
    const Camera& camera = cameras[static_cast<size_t>(i)];
    DistortedCamera& source = written[static_cast<size_t>(i)];
    source.camera = camera;
    const std::string name = camera.name + ".png";
    PlaceImage(capture, result.frame, camera, options.out / "images" / name, options.link);
    source.image = colmap ? fs::path(name) : fs::path("images") / name;  // COLMAP names images within their folder
    if (const auto mask = UsableMask(capture, result.frame, camera)) {
      source.mask = fs::path("masks") / (colmap ? name + ".png" : name);
      WritePng(options.out / source.mask, *mask, 1);
    }
  });
  for (const DistortedCamera& source : written) result.masks += source.mask.empty() ? 0 : 1;
  result.cameras = static_cast<int>(written.size());

  std::vector<ColouredPoint> points = MeshPoints(capture, result.frame, cameras);
  result.points = static_cast<int>(points.size());
  const double per_mm = 1 / MillimetresPer(options.unit);
  Scale(&written, per_mm);
  for (ColouredPoint& point : points) point.position *= per_mm;
  if (colmap) {
    result.written = options.out / "sparse" / "0";
    const ColmapFiles files = options.text ? FormatColmapText(written, points) : FormatColmapBinary(written, points);
    const std::string ending = options.text ? ".txt" : ".bin";
    WriteFile(result.written / ("cameras" + ending), files.cameras);
    WriteFile(result.written / ("images" + ending), files.images);
    WriteFile(result.written / ("points3D" + ending), files.points);
  } else {
    result.written = options.out / "transforms.json";
    WriteFile(options.out / "points.ply", FormatPly(points));
    WriteFile(result.written, FormatNerfstudio(written, "points.ply"));
  }
  return result;
}

}  // namespace likeness
