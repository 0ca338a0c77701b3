// The list of frames against the folders, and the split against both.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/split_file.h"
#include "likeness/validate/checks.h"

namespace likeness {
namespace {

std::string Name(const FrameId& id) { return id.segment + "/" + id.frame; }

// Frames that have a mesh's binary.
std::vector<FrameId> FramesOnDisk(const Examination& e) {
  std::vector<FrameId> frames;
  for (const std::string& segment : ListFolder(e.root / "tracked_mesh")) {
    for (const std::string& name : ListFolder(e.root / "tracked_mesh" / segment)) {
      if (name.ends_with(".bin") && !name.starts_with('.'))
        frames.push_back({segment, name.substr(0, name.size() - 4)});
    }
  }
  return frames;
}

std::vector<FrameId> ReadList(Examination* e) {
  const auto path = e->layout.FrameList();
  if (!Exists(path)) {
    e->Found("frame-list-missing", Severity::kMustFix, "frame_list.txt", "there is no list of frames",
             "write `<segment> <frame>` a line for every frame of tracked_mesh/");
    return FramesOnDisk(*e);
  }
  try {
    return ParseFrameList(path, ReadFile(path));
  } catch (const Error& error) {
    e->Found("frame-list-unreadable", Severity::kMustFix, "frame_list.txt", error.what(),
             "write `<segment> <frame>` a line");
    return FramesOnDisk(*e);
  }
}

}  // namespace

void CheckFrameList(Examination* e) {
  if (!e->multiface) {
    for (const FrameId& id : e->capture->frames()) {
      ExaminedFrame frame;
      frame.id = id;
      frame.has_mesh = frame.has_pose = true;
      e->frames.push_back(std::move(frame));
    }
    if (const auto& skipped = e->capture->skipped_frames(); !skipped.empty()) {
      e->Found("frame-absent", Severity::kWarning, Name(skipped.front().frame),
               fmt::format("{} listed frames cannot be used; the first: {}", skipped.size(), skipped.front().reason),
               "copy the missing files, or leave the frames out of the list");
    }
    return;
  }
  std::map<std::string, std::set<std::string>> on_disk;
  std::set<FrameId> seen;
  std::vector<std::string> twice, absent;
  size_t listed = 0;
  for (const FrameId& id : ReadList(e)) {
    if (!seen.insert(id).second) {
      twice.push_back(Name(id));
      continue;
    }
    ++listed;
    const auto [files, is_new] = on_disk.try_emplace(id.segment);
    if (is_new) {
      for (std::string& name : ListFolder(e->root / "tracked_mesh" / id.segment)) files->second.insert(std::move(name));
    }
    ExaminedFrame frame;
    frame.id = id;
    frame.has_mesh = files->second.contains(id.frame + ".bin");
    frame.has_pose = files->second.contains(id.frame + "_transform.txt");
    if (!frame.has_mesh || !frame.has_pose) {
      absent.push_back(Name(id) + (frame.has_mesh ? "_transform.txt" : ".bin"));
      continue;
    }
    e->frames.push_back(std::move(frame));
  }
  if (!twice.empty()) {
    e->Found("frame-listed-twice", Severity::kWarning, "frame_list.txt",
             fmt::format("{} frames are listed twice: {}", twice.size(), SomeOf(twice)), "remove the second mention");
  }
  if (!absent.empty()) {
    const bool all = absent.size() == listed;
    Finding& finding =
        e->Found("frame-absent", all ? Severity::kMustFix : Severity::kWarning, "tracked_mesh/" + absent.front(),
                 fmt::format("{} listed frames have no mesh or no head pose: {}", absent.size(), SomeOf(absent)),
                 "copy the missing files, or leave the frames out of frame_list.txt");
    finding.evidence = fmt::format("{} of {} listed frames", absent.size(), listed);
  }
  std::vector<std::string> not_listed;
  for (const FrameId& id : FramesOnDisk(*e)) {
    if (!seen.contains(id)) not_listed.push_back(Name(id));
  }
  if (!not_listed.empty()) {
    e->Found("frame-not-listed", Severity::kWarning, "tracked_mesh/" + not_listed.front() + ".bin",
             fmt::format("{} frames are on disk but not in frame_list.txt: {}", not_listed.size(), SomeOf(not_listed)),
             "add them to frame_list.txt; nothing else reads them");
  }
}

void CheckSplit(Examination* e) {
  const auto path = e->options.capture.split_file.empty() ? e->layout.SplitFile() : e->options.capture.split_file;
  if (!Exists(path)) return;
  SplitNames names;
  try {
    names = ParseSplit(path, ReadFile(path));
  } catch (const Error& error) {
    e->Found("split-unreadable", Severity::kMustFix, e->Relative(path), error.what(),
             R"(write {"full": {"train": [...], "test": [...]}, "segment": [...]}, or remove the file)");
    return;
  }
  std::vector<std::string> known, unknown;
  for (const Camera& camera : e->cameras) known.push_back(camera.name);
  size_t training = 0;
  for (const auto* list : {&names.train, &names.test}) {
    for (const std::string& name : *list) {
      const bool is_known = std::find(known.begin(), known.end(), name) != known.end();
      if (is_known && list == &names.train) ++training;
      if (!is_known && std::find(unknown.begin(), unknown.end(), name) == unknown.end()) unknown.push_back(name);
    }
  }
  if (!unknown.empty() && !known.empty()) {
    const std::string nearest = NearestWord(unknown.front(), known);
    e->Found("split-unknown-camera", training == 0 ? Severity::kMustFix : Severity::kWarning, e->Relative(path),
             fmt::format("the split names {} cameras that the calibration lacks: {}", unknown.size(), SomeOf(unknown)),
             nearest.empty() ? "correct the names, or add the cameras to the calibration"
                             : fmt::format("correct the names ('{}' may be '{}')", unknown.front(), nearest));
  }
  std::vector<std::string> empty;
  for (const std::string& prefix : names.segments) {
    if (std::none_of(e->frames.begin(), e->frames.end(),
                     [&](const auto& f) { return f.id.segment.starts_with(prefix); }))
      empty.push_back(prefix);
  }
  // Published splits serve many captures, which lack a segment now and then.
  if (!empty.empty() && !e->frames.empty()) {
    e->Found("split-unknown-segment", Severity::kNote, e->Relative(path),
             fmt::format("no segment begins with {}", SomeOf(empty)), "correct the names of held-out segments");
  }
}

}  // namespace likeness
