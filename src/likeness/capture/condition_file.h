// Named conditions of a capture's frames: what is known of a frame besides its face, such as gaze or light.
//
// conditions/NAME.csv in the capture's folder:
//
//   segment,frame,left_x,left_y,left_z
//   EXP_smile,000003,0.01,-0.02,0.99
//
// The columns behind the first two are the condition's values, in the unit of whoever wrote them; their names, a word
// each, are for people. Lines of frames that the capture does not list are allowed, so that a part of a capture can
// keep the file.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

struct ConditionTable {
  std::vector<std::string> columns;              // names of the values, one or more
  std::map<FrameId, std::vector<float>> frames;  // a value for each column, finite

  bool operator==(const ConditionTable&) const = default;
};

// Throws Error naming the line for anything but a header and rows of as many finite numbers, a frame once.
ConditionTable ParseConditionTable(const std::filesystem::path& path_for_errors, std::string_view text);
std::string ConditionTableText(const ConditionTable& table);

// Reads the condition of this name. Throws Error naming the file where it is absent or wrong.
class ConditionFile {
 public:
  ConditionFile(const std::filesystem::path& capture_root, const std::string& name);

  int size() const { return static_cast<int>(table_.columns.size()); }
  const std::filesystem::path& path() const { return path_; }
  // [size]. Throws Error naming the file and the frame where it has no line.
  const std::vector<float>& Of(const FrameId& frame) const;

 private:
  std::filesystem::path path_;
  ConditionTable table_;
};

}  // namespace likeness
