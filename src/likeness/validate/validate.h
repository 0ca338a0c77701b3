// Finds what breaks captures, by evidence: meshes against the images' foreground, the surface's colours as one camera
// sees them against another's, files against what lists them. Says what, where, how sure, and what to do.
//
// What one check finds is corrected in memory (never on disk) before the next one looks, so that one mistake gives one
// finding. docs/validate.md explains every code.

#pragma once

#include <filesystem>

#include "likeness/capture/capture.h"
#include "likeness/validate/finding.h"

namespace likeness {

struct ValidateOptions {
  bool all = false;               // every image and mesh; otherwise a sample that takes seconds
  std::filesystem::path overlay;  // folder for pictures of the evidence; empty: none are drawn
  CaptureOptions capture;

  void Check() const {}
};

// Works on folders that OpenCapture refuses, too: then the files are looked at for the cause. Throws Error where the
// folder is absent or holds nothing of a capture.
ValidationReport ValidateCapture(const std::filesystem::path& root, const ValidateOptions& options = {});

}  // namespace likeness
