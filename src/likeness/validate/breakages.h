// For tests: the ways in which captures are broken, each with the finding that must name it.

#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/capture/writer.h"

namespace likeness {

// A copy of a good capture (files are links to it: replace them, never write into them), and the good one to read from.
struct Patient {
  const Capture& good;
  CaptureWriter files;

  const CaptureLayout& layout() const { return files.layout(); }
  const FrameId& frame(size_t i) const { return good.frames()[i]; }
};

struct Breakage {
  std::string name;
  std::string code;  // the finding that must be among the gravest
  std::function<void(Patient*)> apply;
  std::set<std::string> also;  // codes that may be found besides, as they follow from it
  std::string where;           // must be part of the finding's `where`; "" for anywhere
  bool pictures = false;       // told by pictures: tried on a human head as well
};

// `has_textures`: those of textures and statistics, else all others.
std::vector<Breakage> AllBreakages(bool has_textures);

}  // namespace likeness
