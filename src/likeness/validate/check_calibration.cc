// Calibration as numbers, before any picture is looked at.

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/raw_calibration.h"

namespace likeness {
namespace {

constexpr double kRotationTolerance = 1e-3;  // as capture/calibration.cc refuses

// Cameras by what is wrong with them, so that forty cameras with one mistake give one finding.
class Complaints {
 public:
  void Add(const std::string& code, const std::string& camera, const std::string& evidence) {
    Entry& entry = entries_[code];
    if (entry.cameras.empty()) entry.evidence = evidence;
    entry.cameras.push_back(camera);
  }

  void Tell(Examination* e, const char* code, const std::string& what, const std::string& advice) const {
    const auto found = entries_.find(code);
    if (found == entries_.end()) return;
    const Entry& entry = found->second;
    const std::string who = entry.cameras.size() == e->cameras.size()
                                ? fmt::format("KRT, all {} cameras", e->cameras.size())
                                : fmt::format("KRT, camera {}", SomeOf(entry.cameras));
    e->Found(code, Severity::kMustFix, who, what, advice).evidence = entry.evidence;
  }

 private:
  struct Entry {
    std::vector<std::string> cameras;
    std::string evidence;  // of the first
  };
  std::map<std::string, Entry> entries_;
};

std::string Describe(const Eigen::Matrix3d& m) {
  return fmt::format("[{:.6g} {:.6g} {:.6g}; {:.6g} {:.6g} {:.6g}; {:.6g} {:.6g} {:.6g}]", m(0, 0), m(0, 1), m(0, 2),
                     m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2));
}

bool IsIntrinsics(const Eigen::Matrix3d& k) {
  return k(1, 0) == 0 && k(2, 0) == 0 && k(2, 1) == 0 && k(2, 2) == 1 && k(0, 0) > 0 && k(1, 1) > 0 &&
         k.cwiseAbs().maxCoeff() <= 1e7;
}

Eigen::Matrix3d Intrinsics(const RawCamera& camera, Complaints* complaints) {
  const Eigen::Matrix3d& k = camera.intrinsics;
  if (IsIntrinsics(k)) return k;
  if (IsIntrinsics(k.transpose())) {
    complaints->Add("intrinsics-transposed", camera.name, "K = " + Describe(k));
    return k.transpose();
  }
  complaints->Add("intrinsics-invalid", camera.name, "K = " + Describe(k));
  if (k(2, 2) != 0 && IsIntrinsics(k / k(2, 2))) return k / k(2, 2);
  return Eigen::Matrix3d::Zero();
}

RigidTransform Extrinsics(const RawCamera& camera, Complaints* complaints) {
  const Eigen::Matrix3d r = camera.cam_from_world.leftCols<3>();
  Eigen::Vector3d t = camera.cam_from_world.col(3);
  if (RotationDefect(r) <= kRotationTolerance) return {r, t};
  const std::string evidence = fmt::format("R = {}, det {:.4g}", Describe(r), r.determinant());
  if (RotationDefect(-r) <= kRotationTolerance ||
      RotationDefect(Eigen::Vector3d(-1, 1, 1).asDiagonal() * r) <= kRotationTolerance) {
    complaints->Add("rotation-mirrors", camera.name, evidence);
    return {r, t};  // which axis is flipped, the pictures tell
  }
  const double scale = std::cbrt(std::abs(r.determinant()));
  if (scale > 0 && RotationDefect(r / scale) <= kRotationTolerance) {
    complaints->Add("rotation-scaled", camera.name, fmt::format("R is {:.6g} times a rotation", scale));
    return {r / scale, t};
  }
  complaints->Add("rotation-invalid", camera.name,
                  evidence + fmt::format(", differs from a rotation by {:.3g}", RotationDefect(r)));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU() * svd.matrixV().transpose(), t};
}

}  // namespace

void CheckCalibration(Examination* e) {
  if (!e->multiface) {
    e->cameras = e->capture->cameras();
    return;
  }
  const auto path = e->layout.Calibration();
  if (!Exists(path)) {
    e->Found("calibration-missing", Severity::kMustFix, "KRT", "there is no calibration",
             "put the cameras' K, R and t into KRT (docs/your-own-capture.md)");
    return;
  }
  RawCalibration raw;
  try {
    raw = ParseRawCalibration(path, ReadFile(path));
  } catch (const Error& error) {
    raw.problem = error.what();
  }
  if (!raw.problem.empty()) {
    e->Found("calibration-unreadable", Severity::kMustFix, "KRT", raw.problem,
             "nine lines a camera: name; 3 lines of K; 5 distortion values; 3 lines of [R | t]; an empty line");
  } else if (raw.cameras.empty()) {
    e->Found("calibration-unreadable", Severity::kMustFix, "KRT", "the file describes no cameras", "write it anew");
  }

  Complaints complaints;
  std::set<std::string> names;
  for (const RawCamera& camera : raw.cameras) {
    if (!IsLayoutName(camera.name)) complaints.Add("camera-name", camera.name, fmt::format("line {}", camera.line));
    if (!names.insert(camera.name).second) {
      complaints.Add("camera-twice", camera.name, fmt::format("again in line {}", camera.line));
      continue;
    }
    if (std::any_of(camera.distortion.begin(), camera.distortion.end(), [](double d) { return d != 0; })) {
      complaints.Add("lens-distortion", camera.name,
                     fmt::format("k1 = {:g}, k2 = {:g}", camera.distortion[0], camera.distortion[1]));
    }
    Camera read;
    read.name = camera.name;
    read.intrinsics = Intrinsics(camera, &complaints);
    read.cam_from_world = Extrinsics(camera, &complaints);
    if (camera.width > 0 && camera.height > 0 && camera.width <= 32768 && camera.height <= 32768) {
      read.width = static_cast<int>(camera.width);
      read.height = static_cast<int>(camera.height);
    }
    if (!read.intrinsics.isZero()) e->cameras.push_back(std::move(read));
  }
  complaints.Tell(e, "camera-name", "a camera cannot have this name", "rename it: no blanks, slashes, or 'average'");
  complaints.Tell(e, "camera-twice", "a camera is described twice", "keep the description that is right");
  complaints.Tell(e, "lens-distortion", "images with lens distortion cannot be used as they are",
                  "undistort the images, then write five zeros into KRT");
  complaints.Tell(e, "intrinsics-transposed", "K is transposed", "write its rows as rows: fx s cx / 0 fy cy / 0 0 1");
  complaints.Tell(e, "intrinsics-invalid", "K is no camera matrix", "write fx s cx / 0 fy cy / 0 0 1, in pixels");
  complaints.Tell(e, "rotation-mirrors", "R mirrors: the calibration is left-handed",
                  "make x point right, y down and z forward in camera space, and the world right-handed");
  complaints.Tell(e, "rotation-scaled", "R is not a rotation but a multiple of one",
                  "divide R by the factor (and see whether t has it too)");
  complaints.Tell(e, "rotation-invalid", "R is no rotation", "write the rotation from world to camera, row by row");
}

}  // namespace likeness
