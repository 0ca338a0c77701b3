#include "likeness/capture/writer.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

void CheckName(const std::string& name, const char* kind) {
  if (!IsLayoutName(name)) throw Error("'{}' cannot be the name of a {}: use letters, digits, '_' and '-'", name, kind);
}

void CheckName(const FrameId& frame) {
  CheckName(frame.segment, "segment");
  CheckName(frame.frame, "frame");
}

template <typename Matrix>
void AppendRows(std::string* text, const Matrix& matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      fmt::format_to(std::back_inserter(*text), "{}{}", column > 0 ? " " : "", matrix(row, column));
    }
    *text += '\n';
  }
}

// [R | t]
Eigen::Matrix<double, 3, 4> Matrix(const RigidTransform& transform) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << transform.rotation, transform.translation;
  return matrix;
}

}  // namespace

CaptureWriter::CaptureWriter(std::filesystem::path root) : layout_(std::move(root)) {}

void CaptureWriter::WriteCalibration(const std::vector<Camera>& cameras) const {
  std::string text;
  std::set<std::string> names;
  for (const Camera& camera : cameras) {
    CheckName(camera.name, "camera");
    if (!names.insert(camera.name).second) throw Error("two cameras have the name '{}'", camera.name);
    text += camera.name + '\n';
    AppendRows(&text, camera.intrinsics);
    text += "0 0 0 0 0\n";
    AppendRows(&text, Matrix(camera.cam_from_world));
    text += '\n';
  }
  WriteFile(layout_.Calibration(), text);
}

void CaptureWriter::WriteFrameList(const std::vector<FrameId>& frames) const {
  std::string text;
  for (const FrameId& frame : frames) {
    CheckName(frame);
    text += frame.segment + ' ' + frame.frame + '\n';
  }
  WriteFile(layout_.FrameList(), text);
}

void CaptureWriter::WriteSplit(const Split& split) const {
  for (const std::string& name : split.training_cameras) CheckName(name, "camera");
  for (const std::string& name : split.held_out_cameras) CheckName(name, "camera");
  for (const std::string& name : split.held_out_segments) CheckName(name, "segment");
  const auto& test = split.held_out_cameras.empty() ? split.training_cameras : split.held_out_cameras;
  const nlohmann::ordered_json json = {{"full", {{"train", split.training_cameras}, {"test", test}, {"visual", test}}},
                                       {"segment", split.held_out_segments}};
  WriteFile(layout_.SplitFile(), json.dump(2) + '\n');
}

void CaptureWriter::WriteObj(const FrameId& frame, const Vertices& vertices_in_head,
                             const MeshTopology& topology) const {
  CheckName(frame);
  LIKENESS_CHECK(vertices_in_head.rows() == topology.vertex_count);
  likeness::WriteObj(layout_.MeshObj(frame), vertices_in_head, topology);
}

void CaptureWriter::WriteTracked(const FrameId& frame, const TrackedFrame& tracked) const {
  CheckName(frame);
  const Vertices& vertices = tracked.vertices_in_head;
  LIKENESS_CHECK(vertices.allFinite());
  WriteFloats(layout_.MeshBinary(frame), {vertices.data(), static_cast<size_t>(vertices.size())});
  std::string text;
  AppendRows(&text, Matrix(tracked.world_from_head));
  WriteFile(layout_.HeadPose(frame), text);
}

void CaptureWriter::WriteImage(const FrameId& frame, const std::string& camera, const ImageU8& rgb) const {
  CheckName(frame);
  CheckName(camera, "camera");
  LIKENESS_CHECK(rgb.channels() == 3);
  WritePng(layout_.Image(frame, camera), rgb, 1);
}

void CaptureWriter::WriteHeadMask(const FrameId& frame, const std::string& camera, const ImageU8& mask) const {
  CheckName(frame);
  CheckName(camera, "camera");
  LIKENESS_CHECK(mask.channels() == 1);
  WritePng(layout_.HeadMask(frame, camera), mask, 1);
}

void CaptureWriter::WriteValidMask(const std::string& camera, const ImageU8& mask) const {
  CheckName(camera, "camera");
  LIKENESS_CHECK(mask.channels() == 1);
  WritePng(layout_.ValidMask(camera), mask, 1);
}

}  // namespace likeness
