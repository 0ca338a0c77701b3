#include "likeness/capture/selection.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/contact_sheet.h"

namespace likeness {
namespace {

std::optional<int64_t> Number(std::string_view text) {
  int64_t number = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || code != std::errc() || end != text.data() + text.size() || number < 0) return std::nullopt;
  return number;
}

struct Range {
  int64_t first = 0, last = 0;
};

Range ParseRange(const std::string& text) {
  const size_t dash = text.find('-');
  const auto first = Number(std::string_view(text).substr(0, dash));
  const auto last = dash == std::string::npos ? first : Number(std::string_view(text).substr(dash + 1));
  if (!first || !last || *first > *last) {
    throw Error("frames are given as FIRST-LAST or as one number, such as 120-480; not '{}'", text);
  }
  return {*first, *last};
}

// "EXP_*" takes every name that begins with EXP_.
bool Matches(const std::string& pattern, const std::string& name) {
  if (pattern.ends_with('*')) return name.starts_with(std::string_view(pattern).substr(0, pattern.size() - 1));
  return name == pattern;
}

// Whether a frame's segment is wanted.
class Segments {
 public:
  Segments(const Capture& capture, const std::vector<std::string>& patterns) {
    std::set<std::string> names;
    for (const FrameId& frame : capture.frames()) names.insert(frame.segment);
    for (const std::string& pattern : patterns) {
      const auto take = [&](const std::string& name) { return Matches(pattern, name); };
      if (std::none_of(names.begin(), names.end(), take)) Fail(capture, pattern, {names.begin(), names.end()});
      std::copy_if(names.begin(), names.end(), std::inserter(wanted_, wanted_.end()), take);
    }
    if (patterns.empty()) wanted_ = std::move(names);
  }

  bool Has(const std::string& name) const { return wanted_.contains(name); }

 private:
  [[noreturn]] static void Fail(const Capture& capture, const std::string& pattern,
                                const std::vector<std::string>& names) {
    std::string nearest = NearestWord(pattern, names);
    if (std::any_of(names.begin(), names.end(), [&](const std::string& n) { return n.starts_with(pattern); })) {
      nearest = pattern + '*';
    }
    throw Error("{}: there is no segment '{}'{}", capture.root().string(), pattern,
                nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest));
  }

  std::set<std::string> wanted_;
};

}  // namespace

void CaptureSelection::Check() const {
  if (every < 1) throw Error("every n-th frame: n must be 1 or more, not {}", every);
  if (count < 0) throw Error("a count of frames must be 0 (all) or more, not {}", count);
  if (!frames.empty()) ParseRange(frames);
}

std::vector<Camera> SelectCameras(const Capture& capture, const CaptureSelection& selection) {
  if (selection.cameras.empty()) return capture.cameras();
  std::set<std::string> wanted;
  for (const std::string& name : selection.cameras) wanted.insert(capture.FindCamera(name).name);
  std::vector<Camera> cameras;
  for (const Camera& camera : capture.cameras()) {
    if (wanted.contains(camera.name)) cameras.push_back(camera);
  }
  return cameras;
}

std::vector<FrameId> SelectFrames(const Capture& capture, const CaptureSelection& selection) {
  selection.Check();
  const Segments segments(capture, selection.segments);
  std::optional<Range> range;
  if (!selection.frames.empty()) range = ParseRange(selection.frames);
  std::map<std::string, int64_t> seen;  // frames of a segment within the range
  std::vector<FrameId> frames;
  for (const FrameId& frame : capture.frames()) {
    if (!segments.Has(frame.segment)) continue;
    if (range) {
      const std::optional<int64_t> number = Number(frame.frame);
      if (!number || *number < range->first || *number > range->last) continue;
    }
    if (seen[frame.segment]++ % selection.every == 0) frames.push_back(frame);
  }
  if (selection.count > 0) {
    std::vector<FrameId> spread;
    for (const size_t i : EvenlySpread(frames.size(), static_cast<size_t>(selection.count)))
      spread.push_back(frames[i]);
    frames = std::move(spread);
  }
  if (frames.empty()) {
    throw Error("{}: no frame of the chosen segments has a number in {}", capture.root().string(), selection.frames);
  }
  return frames;
}

Split ReduceSplit(const Split& split, const std::vector<Camera>& cameras) {
  Split reduced;
  reduced.held_out_segments = split.held_out_segments;
  for (const Camera& camera : cameras) {
    const auto& training = split.training_cameras;
    if (std::find(training.begin(), training.end(), camera.name) != training.end()) {
      reduced.training_cameras.push_back(camera.name);
    }
    if (split.IsHeldOutCamera(camera.name)) reduced.held_out_cameras.push_back(camera.name);
  }
  if (!reduced.training_cameras.empty()) return reduced;
  reduced.held_out_cameras.clear();
  for (const Camera& camera : cameras) reduced.training_cameras.push_back(camera.name);
  return reduced;
}

}  // namespace likeness
