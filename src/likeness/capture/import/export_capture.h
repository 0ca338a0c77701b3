// One frame of a capture for other tools: nerfstudio and COLMAP.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

struct ExportOptions {
  std::filesystem::path out;
  std::string format = "nerfstudio";  // or "colmap"
  std::string frame;                  // "SEGMENT/FRAME"; "": the first that the capture has
  std::string unit = "mm";            // of what is written: m, cm, mm or inch
  bool text = false;                  // COLMAP's model as text, not binary
  bool link = false;                  // images are symbolic links, not copies

  void Check() const;  // throws Error
};

struct ExportResult {
  FrameId frame;
  std::filesystem::path written;  // transforms.json, or the model's folder
  int cameras = 0;
  int masks = 0;
  int points = 0;
  std::vector<std::string> without_image;  // cameras that were left out
};

// The world stays the capture's. Writes
//   nerfstudio  transforms.json, images/CAMERA.png, masks/CAMERA.png, points.ply
//   colmap      sparse/0/{cameras,images,points3D}.{bin,txt}, images/CAMERA.png, masks/CAMERA.png.png
// Masks are white where a pixel shows the head and is valid, which is both tools' convention (black is not used).
// Points are the tracked mesh's vertices, each with its colour in the camera that sees it most from the front (without
// regard to what lies between).
ExportResult ExportCapture(const Capture& capture, const ExportOptions& options);

}  // namespace likeness
