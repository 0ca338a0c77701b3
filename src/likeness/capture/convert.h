// Copies a capture, or a part of it, from any layout that is read to the one that is written (Multiface's).

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/capture/selection.h"

namespace likeness {

struct ConvertOptions {
  std::filesystem::path out;
  CaptureSelection selection;
  int width = 0;     // px of the new images; their height follows; 0: as they are
  double scale = 1;  // of the images, (0, 1]; at most one of width and scale
  bool masks = true;
  bool textures = true;  // carry textures and statistics that the selection leaves true
  bool link = false;     // hard links where a file need not change; a program that edits one in place edits both

  void Check() const;  // throws Error
};

struct ConvertReport {
  int cameras = 0;
  int segments = 0;
  int frames = 0;
  int64_t images_linked = 0;            // hard links to the source's PNG
  int64_t images_copied = 0;            // byte for byte
  int64_t images_encoded = 0;           // decoded, perhaps resized, and written as PNG
  int64_t images_kept = 0;              // from an earlier run
  int64_t images_absent = 0;            // that the source does not have
  int64_t masks = 0;                    // written now
  int64_t textures = 0;                 // files of textures and statistics carried now
  std::vector<std::string> unreadable;  // one message each; these files, and frames without a mesh, are left out
  std::vector<std::string> dropped;     // what the source has and the copy has not, and why; a sentence each
};

// Reads only what is selected. Images are resized by area, masks too (head where half of a pixel is), and K scaled to
// the new size; a source's PNG that need not change is copied byte for byte or linked. The split is reduced to the
// cameras that are left. Textures of a view are carried unless images change their size, averages unless a camera is
// left out, statistics unless anything is.
//
// Uses all threads and holds one image a thread. Goes on where an earlier run with the same source and options stopped;
// on Ctrl-C it ends after the files it is at, by an Error that says how to go on. Also throws Error when `out` holds a
// capture that was made otherwise (convert.json there says from what), or lies in the source or around it.
ConvertReport ConvertCapture(const Capture& source, const ConvertOptions& options);

// The camera at its new size; cameras without any image keep K, times the scale.
Camera ConvertedCamera(const Camera& camera, const ConvertOptions& options);

}  // namespace likeness
