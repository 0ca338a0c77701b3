#include "likeness/capture/calibration_formats/nerfstudio.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"

namespace likeness {
namespace {

using nlohmann::json;

class Reader {
 public:
  Reader(const std::filesystem::path& path, std::string_view bytes) : path_(path) {
    // A deeper nesting than any such file has would exhaust the stack.
    int depth = 0;
    const json::parser_callback_t shallow = [&](int at, json::parse_event_t, json&) {
      depth = std::max(depth, at);
      if (depth > 16) throw FileError(path_, "is nested too deeply to be a transforms.json");
      return true;
    };
    root_ = json::parse(bytes, shallow, false);
    if (!root_.is_object()) throw FileError(path_, "is no JSON object; expected a nerfstudio transforms.json");
  }

  DistortedCameras Read() {
    const auto frames = root_.find("frames");
    if (frames == root_.end() || !frames->is_array()) throw FileError(path_, "expected \"frames\": [...]");
    ReadApplied();
    DistortedCameras cameras;
    for (const json& frame : *frames) cameras.push_back(ReadFrame(frame));
    NameByImages(path_, &cameras);
    CheckCameras(path_, cameras);
    return cameras;
  }

 private:
  [[noreturn]] void Fail(const std::string& message) const { throw FileError(path_, where_ + message); }

  // From the frame, else from the top of the file.
  const json* Find(const json& frame, const char* key) const {
    if (const auto it = frame.find(key); it != frame.end()) return &*it;
    if (const auto it = root_.find(key); it != root_.end()) return &*it;
    return nullptr;
  }

  double Number(const json& value, const char* key) const {
    if (!value.is_number() || !std::isfinite(value.get<double>())) Fail(fmt::format("\"{}\" is no number", key));
    return value.get<double>();
  }

  double Number(const json& frame, const char* key, double standard) const {
    const json* value = Find(frame, key);
    return value == nullptr ? standard : Number(*value, key);
  }

  int Side(const json& frame, const char* key) const {
    const double side = Number(frame, key, 0);
    if (side < 0 || side > 32768 || side != std::floor(side)) Fail(fmt::format("\"{}\" is {:g} pixels", key, side));
    return static_cast<int>(side);
  }

  // Three or four rows of four; a fourth must be 0 0 0 1.
  Eigen::Matrix<double, 3, 4> Matrix(const json& value, const char* key) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (!value.is_array() || value.size() < 3 || value.size() > 4) Fail(fmt::format("\"{}\" is no 4 x 4 matrix", key));
    for (size_t row = 0; row < value.size(); ++row) {
      if (!value[row].is_array() || value[row].size() != 4) Fail(fmt::format("\"{}\" is no 4 x 4 matrix", key));
      for (size_t column = 0; column < 4; ++column) {
        matrix(static_cast<int>(row), static_cast<int>(column)) = Number(value[row][column], key);
      }
    }
    if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
      Fail(fmt::format("the last row of \"{}\" is not 0 0 0 1", key));
    return matrix.topRows<3>();
  }

  RigidTransform Rigid(const json& value, const char* key) const {
    const Eigen::Matrix<double, 3, 4> matrix = Matrix(value, key);
    const RigidTransform rigid = {matrix.leftCols<3>(), matrix.col(3)};
    if (const double defect = RotationDefect(rigid.rotation); !(defect <= 1e-3)) {
      Fail(fmt::format("\"{}\" {}", key, std::isfinite(defect) ? "is no rigid transform" : "mirrors"));
    }
    return rigid;
  }

  void ReadApplied() {
    if (const auto it = root_.find("applied_transform"); it != root_.end()) applied_ = Rigid(*it, "applied_transform");
    if (const auto it = root_.find("applied_scale"); it != root_.end()) applied_scale_ = Number(*it, "applied_scale");
    if (!(applied_scale_ > 0)) Fail("\"applied_scale\" is not positive");
  }

  DistortedCamera ReadFrame(const json& frame) {
    if (!frame.is_object()) Fail("\"frames\" holds something that is no object");
    const auto file = frame.find("file_path");
    if (file == frame.end() || !file->is_string()) Fail("a frame has no \"file_path\"");
    where_ = fmt::format("frame '{}': ", file->get<std::string>());
    DistortedCamera source;
    source.image = file->get<std::string>();
    if (const auto mask = frame.find("mask_path"); mask != frame.end() && mask->is_string()) {
      source.mask = mask->get<std::string>();
    }
    ReadIntrinsics(frame, &source);
    ReadLens(frame, &source.lens);
    const auto matrix = frame.find("transform_matrix");
    if (matrix == frame.end()) Fail("has no \"transform_matrix\"");
    RigidTransform world_from_cam = Rigid(*matrix, "transform_matrix");
    world_from_cam.translation /= applied_scale_;
    world_from_cam = applied_.Inverse() * world_from_cam;
    world_from_cam.rotation.col(1) *= -1;  // OpenGL's y up and z back to y down and z forward
    world_from_cam.rotation.col(2) *= -1;
    source.camera.cam_from_world = world_from_cam.Inverse();
    where_.clear();
    return source;
  }

  void ReadIntrinsics(const json& frame, DistortedCamera* source) const {
    Camera& camera = source->camera;
    camera.width = Side(frame, "w");
    camera.height = Side(frame, "h");
    double fx = Number(frame, "fl_x", 0), fy = Number(frame, "fl_y", 0);
    if (fx == 0 && Find(frame, "camera_angle_x") != nullptr && camera.width > 0) {
      fx = camera.width / (2 * std::tan(Number(frame, "camera_angle_x", 0) / 2));
    }
    if (fx == 0) Fail("has no \"fl_x\"; expected intrinsics with the frame or at the top");
    if (fy == 0) fy = fx;
    if (camera.width == 0 && Find(frame, "cx") == nullptr) Fail("has neither \"cx\" nor \"w\"");
    camera.intrinsics << fx, 0, Number(frame, "cx", camera.width / 2.0), 0, fy,
        Number(frame, "cy", camera.height / 2.0), 0, 0, 1;
  }

  void ReadLens(const json& frame, Lens* lens) const {
    const json* model = Find(frame, "camera_model");
    const std::string name = model == nullptr ? "OPENCV" : model->is_string() ? model->get<std::string>() : "";
    const auto k = [&](const char* key) { return Number(frame, key, 0); };
    if (name == "OPENCV_FISHEYE") {
      *lens = {Lens::Model::kFisheye, {k("k1"), k("k2"), k("k3"), k("k4")}};
    } else if (name == "OPENCV" || name == "PINHOLE" || name == "SIMPLE_PINHOLE") {
      if (k("k4") != 0) Fail("\"k4\" belongs to no OPENCV lens of this format");
      *lens = {Lens::Model::kRadialTangential, {k("k1"), k("k2"), k("p1"), k("p2"), k("k3")}};
      if (name != "OPENCV" && !lens->IsPinhole()) Fail(fmt::format("\"camera_model\" {} with distortion", name));
    } else {
      Fail(fmt::format("\"camera_model\" '{}' is not known here; expected OPENCV, OPENCV_FISHEYE or PINHOLE", name));
    }
  }

  const std::filesystem::path& path_;
  json root_;
  std::string where_;
  RigidTransform applied_;
  double applied_scale_ = 1;
};

}  // namespace

DistortedCameras ParseNerfstudio(const std::filesystem::path& path_for_errors, std::string_view bytes) {
  return Reader(path_for_errors, bytes).Read();
}

std::string FormatNerfstudio(const DistortedCameras& cameras, const std::string& ply_file_path) {
  nlohmann::ordered_json root = {{"camera_model", "OPENCV"}, {"frames", nlohmann::ordered_json::array()}};
  if (!ply_file_path.empty()) root["ply_file_path"] = ply_file_path;
  for (const DistortedCamera& source : cameras) {
    const Eigen::Matrix3d& k = source.camera.intrinsics;
    if (!source.lens.IsPinhole()) throw Error("camera {}: only undistorted cameras are written", source.camera.name);
    if (k(0, 1) != 0) throw Error("camera {}: transforms.json cannot hold a K with skew", source.camera.name);
    RigidTransform pose = source.camera.cam_from_world.Inverse();
    pose.rotation.col(1) *= -1;
    pose.rotation.col(2) *= -1;
    nlohmann::ordered_json frame = {{"file_path", source.image.generic_string()}};
    if (!source.mask.empty()) frame["mask_path"] = source.mask.generic_string();
    frame.update({{"w", source.camera.width},
                  {"h", source.camera.height},
                  {"fl_x", k(0, 0)},
                  {"fl_y", k(1, 1)},
                  {"cx", k(0, 2)},
                  {"cy", k(1, 2)}});
    for (const char* key : {"k1", "k2", "p1", "p2"}) frame[key] = 0.0;
    for (int row = 0; row < 3; ++row) {
      frame["transform_matrix"].push_back(
          {pose.rotation(row, 0), pose.rotation(row, 1), pose.rotation(row, 2), pose.translation[row]});
    }
    frame["transform_matrix"].push_back({0.0, 0.0, 0.0, 1.0});
    root["frames"].push_back(std::move(frame));
  }
  return root.dump(2) + '\n';
}

}  // namespace likeness
