#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration_formats/colmap_internal.h"

namespace likeness::colmap {
namespace {

// https://colmap.github.io/cameras.html
constexpr Model kModels[] = {{0, "SIMPLE_PINHOLE", 3, true},
                             {kPinholeId, "PINHOLE", 4, true},
                             {2, "SIMPLE_RADIAL", 4, true},
                             {3, "RADIAL", 5, true},
                             {4, "OPENCV", 8, true},
                             {5, "OPENCV_FISHEYE", 8, true},
                             {6, "FULL_OPENCV", 12, true},
                             {7, "FOV", 5, false},
                             {8, "SIMPLE_RADIAL_FISHEYE", 4, false},
                             {9, "RADIAL_FISHEYE", 5, false},
                             {10, "THIN_PRISM_FISHEYE", 12, false},
                             {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, false}};

const Model& Known(const std::filesystem::path& path, const Model& model) {
  if (model.is_known) return model;
  throw FileError(path, fmt::format("camera model {} is not read here; convert it with colmap image_undistorter, or "
                                    "calibrate with OPENCV, FULL_OPENCV or OPENCV_FISHEYE",
                                    model.name));
}

}  // namespace

const Model& FindModel(const std::filesystem::path& path, std::string_view name) {
  std::vector<std::string> names;
  for (const Model& model : kModels) {
    if (name == model.name) return Known(path, model);
    names.emplace_back(model.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw FileError(path, fmt::format("there is no camera model '{}'{}", name.substr(0, 40),
                                    nearest.empty() ? "" : fmt::format(", did it mean {}?", nearest)));
}

const Model& FindModel(const std::filesystem::path& path, int64_t id) {
  for (const Model& model : kModels) {
    if (id == model.id) return Known(path, model);
  }
  throw FileError(path, fmt::format("there is no camera model number {}", id));
}

DistortedCamera MakeCamera(const std::filesystem::path& path, const Model& model, uint64_t width, uint64_t height,
                           std::span<const double> p) {
  LIKENESS_CHECK(p.size() == model.parameters);
  if (width < 1 || height < 1 || width > 32768 || height > 32768) {
    throw FileError(path, fmt::format("a camera of {} x {} pixels; expected 1 to 32768", width, height));
  }
  DistortedCamera made;
  made.camera.width = static_cast<int>(width);
  made.camera.height = static_cast<int>(height);
  const bool one_focal = model.id == 0 || model.id == 2 || model.id == 3;
  const size_t first = one_focal ? 1 : 2;
  made.camera.intrinsics << p[0], 0, p[first], 0, p[first - 1], p[first + 1], 0, 0, 1;
  // The rest is distortion, in the order that Lens has: k | k1 k2 | k1 k2 p1 p2 | k1 k2 p1 p2 k3 k4 k5 k6.
  if (model.id > kPinholeId) {
    made.lens.model = model.id == 5 ? Lens::Model::kFisheye : Lens::Model::kRadialTangential;
    std::copy(p.begin() + static_cast<std::ptrdiff_t>(first) + 2, p.end(), made.lens.k.begin());
  }
  return made;
}

DistortedCamera MakeImage(const std::filesystem::path& path, const std::map<uint32_t, DistortedCamera>& cameras,
                          uint32_t camera_id, std::span<const double, 7> pose, std::string_view name) {
  const auto found = cameras.find(camera_id);
  if (found == cameras.end()) {
    throw FileError(path, fmt::format("image '{}' names camera {}, which is not described", name, camera_id));
  }
  const Eigen::Quaterniond rotation(pose[0], pose[1], pose[2], pose[3]);
  if (!(std::abs(rotation.norm() - 1) < 0.01)) {
    throw FileError(path, fmt::format("image '{}' has a quaternion of length {:g}", name, rotation.norm()));
  }
  DistortedCamera image = found->second;
  image.camera.cam_from_world = {rotation.normalized().toRotationMatrix(), {pose[4], pose[5], pose[6]}};
  image.image = name;
  return image;
}

std::array<double, 4> PinholeParameters(const DistortedCamera& source) {
  const Eigen::Matrix3d& k = source.camera.intrinsics;
  if (!source.lens.IsPinhole()) throw Error("camera {}: only undistorted cameras are written", source.camera.name);
  if (k(0, 1) != 0) throw Error("camera {}: COLMAP's PINHOLE cannot hold a K with skew", source.camera.name);
  return {k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
}

std::array<double, 7> Pose(const DistortedCamera& source) {
  const Eigen::Quaterniond q(source.camera.cam_from_world.rotation);
  const Eigen::Vector3d& t = source.camera.cam_from_world.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

}  // namespace likeness::colmap
