#include "likeness/capture/calibration_formats/calibration.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "likeness/base/error.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

constexpr int kLargestSide = 32768;
constexpr double kRotationTolerance = 1e-3;

std::string LayoutName(std::string name) {
  for (char& c : name) {
    if (!IsLayoutName(std::string(1, c)) && c != '.') c = '_';
  }
  if (name.empty() || name.front() == '.' || name == "average") name += '_';
  if (name.front() == '.') name.front() = '_';
  return name.substr(0, 199);
}

}  // namespace

void CheckCameras(const std::filesystem::path& path, const DistortedCameras& cameras) {
  if (cameras.empty()) throw FileError(path, "describes no cameras");
  for (const DistortedCamera& source : cameras) {
    const Camera& camera = source.camera;
    const auto fail = [&](const std::string& what) {
      throw FileError(path, fmt::format("camera '{}' has {}", camera.name, what));
    };
    const Eigen::Matrix3d& k = camera.intrinsics;
    const RigidTransform& pose = camera.cam_from_world;
    const auto finite = [](double v) { return std::isfinite(v) && std::abs(v) < 1e9; };
    if (!std::all_of(k.reshaped().begin(), k.reshaped().end(), finite) ||
        !std::all_of(source.lens.k.begin(), source.lens.k.end(), finite) ||
        !std::all_of(pose.rotation.reshaped().begin(), pose.rotation.reshaped().end(), finite) ||
        !std::all_of(pose.translation.begin(), pose.translation.end(), finite)) {
      fail("numbers that are not finite or too large");
    }
    if (k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 || k(2, 2) != 1)
      fail("a K that is not upper triangular; transposed?");
    if (k(0, 0) <= 0 || k(1, 1) <= 0) fail(fmt::format("focal lengths of {:g} and {:g} pixels", k(0, 0), k(1, 1)));
    if (camera.width < 0 || camera.height < 0 || camera.width > kLargestSide || camera.height > kLargestSide) {
      fail(fmt::format("an image of {} x {} pixels; expected at most {}", camera.width, camera.height, kLargestSide));
    }
    if (const double defect = RotationDefect(pose.rotation); !(defect <= kRotationTolerance)) {
      fail(std::isfinite(defect) ? fmt::format("a rotation that is none, by {:.3g}", defect)
                                 : std::string("a rotation that mirrors"));
    }
  }
}

void NameByImages(const std::filesystem::path& path, DistortedCameras* cameras) {
  using Rule = std::function<std::string(const std::filesystem::path&)>;
  const Rule rules[] = {
      [](const auto& image) { return image.stem().string(); },
      [](const auto& image) { return image.parent_path().filename().string(); },
      [](const auto& image) {
        return (image.parent_path() / image.stem()).lexically_normal().relative_path().string();
      },
  };
  for (const Rule& rule : rules) {
    std::set<std::string> names;
    for (DistortedCamera& camera : *cameras) {
      camera.camera.name = LayoutName(rule(camera.image));
      names.insert(camera.camera.name);
    }
    if (names.size() == cameras->size()) return;
  }
  throw FileError(path, "gives several cameras the same image; a camera may be described once");
}

void Scale(DistortedCameras* cameras, double mm_per_unit) {
  for (DistortedCamera& camera : *cameras) camera.camera.cam_from_world.translation *= mm_per_unit;
}

double DistanceToFocus(const DistortedCameras& cameras) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const DistortedCamera& camera : cameras) {
    const Eigen::Vector3d axis = camera.camera.cam_from_world.rotation.row(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * camera.camera.CentreInWorld();
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(normal);
  if (cameras.size() < 2 || std::abs(normal.determinant()) < 1e-6) return 0;
  const Eigen::Vector3d focus = solver.solve(right);
  std::vector<double> distances;
  for (const DistortedCamera& camera : cameras) distances.push_back((camera.camera.CentreInWorld() - focus).norm());
  std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2),
                   distances.end());
  return distances[distances.size() / 2];
}

}  // namespace likeness
