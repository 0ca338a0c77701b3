#include "likeness/capture/writer.h"

#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/split_file.h"
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

}  // namespace

CaptureWriter::CaptureWriter(std::filesystem::path root) : layout_(std::move(root)) {}

void CaptureWriter::WriteCalibration(const std::vector<Camera>& cameras) const {
  std::set<std::string> names;
  for (const Camera& camera : cameras) {
    CheckName(camera.name, "camera");
    if (!names.insert(camera.name).second) throw Error("two cameras have the name '{}'", camera.name);
  }
  WriteFile(layout_.Calibration(), CalibrationText(cameras));
}

void CaptureWriter::WriteFrameList(const std::vector<FrameId>& frames) const {
  for (const FrameId& frame : frames) CheckName(frame);
  WriteFile(layout_.FrameList(), FrameListText(frames));
}

void CaptureWriter::WriteSplit(const Split& split) const {
  for (const std::string& name : split.training_cameras) CheckName(name, "camera");
  for (const std::string& name : split.held_out_cameras) CheckName(name, "camera");
  for (const std::string& name : split.held_out_segments) CheckName(name, "segment");
  WriteFile(layout_.SplitFile(), SplitText(split));
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
  WriteFile(layout_.HeadPose(frame), TransformText(tracked.world_from_head));
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
