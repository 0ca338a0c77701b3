// What a capture on disk is: its parts counted, and what is missing from it in plain words.

#pragma once

#include <string>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

enum class CameraRole { kTraining, kHeldOut, kUnused };  // unused: in neither list of the split
std::string ToString(CameraRole role);                   // "training", "held out", "unused"
CameraRole RoleOf(const Split& split, const std::string& camera);

struct CameraSummary {
  std::string name;
  int width = 0, height = 0;  // px; 0 when no image is there
  double focal_px = 0;        // of x
  double distance_mm = 0;     // to the head's centre in the first frame
  CameraRole role = CameraRole::kTraining;
  int images = 0;  // frames of the capture with an image of this camera
  int masks = 0;   // frames with a head mask
};

struct SegmentSummary {
  std::string name;
  int frames = 0;
  bool held_out = false;
};

struct TextureSummary {
  int size = 0;      // texels a side
  int averages = 0;  // frames with an average texture
};

struct CaptureSummary {
  std::string root;
  std::string layout;
  std::string geometry;  // of the meshes, as GeometryNames() spells it
  std::vector<CameraSummary> cameras;
  std::vector<SegmentSummary> segments;  // in the order of the frames
  int frames = 0;
  int skipped_frames = 0;  // listed, but without mesh or pose
  int vertices = 0;
  int vertices_in_triangles = 0;
  int uvs = 0;
  int triangles = 0;
  double mesh_width_mm = 0, mesh_height_mm = 0;  // of the first frame's vertices in triangles
  std::vector<TextureSummary> textures;          // of what has been unwrapped, by size
  bool has_statistics = false;                   // all four files of means and variances
  std::vector<std::string> missing;              // one sentence each; empty when the capture is complete
};

// Looks at every file name and at the first frame's mesh, but reads no other images or meshes. Throws Error when that
// mesh is damaged.
CaptureSummary Summarize(const Capture& capture);

std::string ToText(const CaptureSummary& summary);  // lines for a person
std::string ToJson(const CaptureSummary& summary);

}  // namespace likeness
