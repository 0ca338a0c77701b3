// Writes a capture in the Multiface layout, so that published tools read it unchanged.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"

namespace likeness {

// Each method writes whole files beside their final names and renames them, so that an interrupted run leaves no half
// file. Files of different frames and cameras may be written from many threads at once. Throws Error where the disk
// refuses or a name cannot stand in the layout (blanks, slashes, "average", "."); a wrong shape is a LIKENESS_CHECK.
class CaptureWriter {
 public:
  explicit CaptureWriter(std::filesystem::path root);

  const CaptureLayout& layout() const { return layout_; }

  // KRT, nine lines a camera: name; K; five zeros of distortion; [R | t] world to camera, mm; an empty line. Numbers
  // are written with the digits that a double needs to come back unchanged. The order is the camera index.
  void WriteCalibration(const std::vector<Camera>& cameras) const;

  // frame_list.txt, `<segment> <frame>` a line.
  void WriteFrameList(const std::vector<FrameId>& frames) const;

  // split.json: {"full": {"train": [...], "test": [...], "visual": [...]}, "segment": [held-out prefixes]}, which
  // serves published tools as camera split and as list of test segments. As in published splits, test equals train when
  // no camera is held out.
  void WriteSplit(const Split& split) const;

  // tracked_mesh/<segment>/<frame>.obj: faces and texture coordinates; readers take positions from the binary.
  void WriteObj(const FrameId& frame, const Vertices& vertices_in_head, const MeshTopology& topology) const;

  // tracked_mesh/<segment>/<frame>.bin and <frame>_transform.txt.
  void WriteTracked(const FrameId& frame, const TrackedFrame& tracked) const;

  void WriteImage(const FrameId& frame, const std::string& camera, const ImageU8& rgb) const;
  void WriteHeadMask(const FrameId& frame, const std::string& camera, const ImageU8& mask) const;  // grey, 255 = head
  void WriteValidMask(const std::string& camera, const ImageU8& mask) const;  // grey, 255 = valid, in all frames

 private:
  CaptureLayout layout_;
};

}  // namespace likeness
