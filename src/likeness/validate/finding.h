// What validation has to say: one finding for each thing that is wrong, with its evidence and its remedy.

#pragma once

#include <functional>
#include <string>
#include <vector>

#include "likeness/image/image.h"

namespace likeness {

enum class Severity {
  kMustFix,  // what is made from the capture as it stands will be wrong, or cannot be made
  kWarning,  // parts are lost or doubtful; the rest is right
  kNote,     // worth knowing
};
std::string ToString(Severity severity);  // "must fix", "warning", "note"

struct Finding {
  std::string code;  // kebab-case; stable, for programs; docs/validate.md explains each
  Severity severity = Severity::kMustFix;
  std::string where;              // file, camera, segment or frame
  std::string what;               // one sentence
  std::string evidence;           // the numbers behind it
  double confidence = 1;          // 0 ... 1: 1 where a file says so, less where pictures were weighed
  std::string advice;             // what to do, or which flag or command corrects it
  std::string picture;            // where it was drawn; empty when it was not
  std::function<ImageU8()> draw;  // none where there is nothing to see
};

struct ValidationReport {
  std::string root;
  std::string layout;             // "" when the folder has none that is known
  std::vector<Finding> findings;  // the gravest first
  int cameras = 0, frames = 0;    // of the capture
  int views = 0;                  // camera images that were looked at
  double overlap = 0;    // mean intersection over union of mesh and foreground, with what was corrected; 0 unknown
  double agreement = 0;  // mean correlation of the surface's detail between cameras; 0 when unknown

  bool MustFix() const;
  const Finding* Find(const std::string& code) const;  // null when there is none
};

std::string ToText(const ValidationReport& report);  // lines for a person
std::string ToJson(const ValidationReport& report);

}  // namespace likeness
