#include "likeness/app/capture_flags.h"

#include <algorithm>

namespace likeness {
namespace {

std::vector<std::string> SplitAtCommas(const std::string& list) {
  std::vector<std::string> words;
  for (size_t begin = 0; begin <= list.size();) {
    const size_t end = std::min(list.find(',', begin), list.size());
    if (end > begin) words.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

}  // namespace

void AddCaptureFlags(Command* command, CaptureOptions* options) {
  command->Option("split", &options->split_file,
                  "JSON with training and test cameras, perhaps held-out segments (default: CAPTURE/split.json, else "
                  "everything trains)");
  command->Option("test-segments", &options->test_segments_file,
                  "JSON with the held-out segments alone, {\"segment\": [prefix, ...]}");
  command->Option("topology", &options->topology_file,
                  "OBJ with faces and texture coordinates (default: the capture's own)");
  command->Choice("distortion", &options->distortion, {"refuse", "ignore", "undistort"},
                  "what to do about lens distortion in Ava-256's and Goliath's calibrations");
}

CaptureSelection SelectionFlags::Selection() const {
  CaptureSelection selection = rest;
  selection.cameras = SplitAtCommas(cameras);
  selection.segments = SplitAtCommas(segments);
  return selection;
}

void AddSelectionFlags(Command* command, SelectionFlags* flags) {
  command->Option("cameras", &flags->cameras, "names, parted by commas; default: all");
  AddFrameFlags(command, flags);
}

void AddFrameFlags(Command* command, SelectionFlags* flags) {
  command->Option("segments", &flags->segments, "names, or beginnings with a * behind, parted by commas; default: all");
  command->Option("frames", &flags->rest.frames, "numbers within each segment, FIRST-LAST; default: all");
  command->Option("every", &flags->rest.every, "of these, every n-th frame of a segment");
  command->Option("count", &flags->rest.count, "of these, so many over all segments, evenly spread (0: all)");
}

}  // namespace likeness
