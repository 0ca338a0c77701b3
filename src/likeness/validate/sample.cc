// Which frames and cameras are looked at, and reading them.

#include <algorithm>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/validate/checks.h"

namespace likeness {
namespace {

constexpr size_t kViews = 240;   // images that are decoded unless --all
constexpr size_t kMostRuns = 5;  // three neighbouring frames each, to see whether images are early or late
constexpr size_t kViewsOfAll = 4000;
constexpr int kSurfacePoints = 4000;

bool Usable(const ExaminedFrame& frame) { return frame.has_mesh && frame.has_pose; }

// Distance of a pose from another one, in millimetres at the head's surface.
double PoseDistance(const RigidTransform& a, const RigidTransform& b) {
  return (a.translation - b.translation).norm() + 100 * (a.rotation - b.rotation).norm();
}

// Runs of three neighbours with much motion, then the frames whose poses are unlike all others, then evenly spread
// ones.
std::set<size_t> ChooseFrames(const Examination& e, size_t count) {
  const std::vector<ExaminedFrame>& frames = e.frames;
  std::vector<size_t> usable;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (Usable(frames[i])) usable.push_back(i);
  }
  std::set<size_t> chosen;
  if (usable.size() <= count) return {usable.begin(), usable.end()};
  std::vector<std::pair<double, size_t>> runs;  // motion, middle frame
  for (size_t i = 1; i + 1 < frames.size(); ++i) {
    if (!Usable(frames[i - 1]) || !Usable(frames[i]) || !Usable(frames[i + 1])) continue;
    if (frames[i - 1].id.segment != frames[i].id.segment || frames[i + 1].id.segment != frames[i].id.segment) continue;
    runs.emplace_back(PoseDistance(frames[i - 1].world_from_head, frames[i + 1].world_from_head), i);
  }
  std::sort(runs.rbegin(), runs.rend());
  size_t kept_runs = 0;
  for (const auto& run : runs) {
    const size_t middle = run.second;
    if (kept_runs == kMostRuns || chosen.size() + 3 > count * 2 / 3) break;
    const bool near = std::any_of(chosen.begin(), chosen.end(),
                                  [&](size_t i) { return std::max(i, middle) - std::min(i, middle) < 6; });
    if (near) continue;
    chosen.insert({middle - 1, middle, middle + 1});
    ++kept_runs;
  }
  if (chosen.size() < count) {
    size_t strangest = usable.front();
    double most = -1;
    for (size_t k = 1; k + 1 < usable.size(); ++k) {
      const double lonely =
          std::min(PoseDistance(frames[usable[k]].world_from_head, frames[usable[k - 1]].world_from_head),
                   PoseDistance(frames[usable[k]].world_from_head, frames[usable[k + 1]].world_from_head));
      if (lonely > most) most = lonely, strangest = usable[k];
    }
    chosen.insert(strangest);
  }
  for (const size_t k : EvenlySpread(usable.size(), count)) {
    if (chosen.size() >= count) break;
    chosen.insert(usable[k]);
  }
  return chosen;
}

}  // namespace

void LoadSample(Examination* e) {
  if (e->cameras.empty() || e->topology.triangles.empty()) return;
  const size_t cameras = e->cameras.size();
  const size_t count = std::max<size_t>(3, (e->options.all ? kViewsOfAll : kViews) / cameras);
  const std::set<size_t> chosen = ChooseFrames(*e, count);
  std::vector<size_t> loaded;
  for (const size_t i : chosen) {
    try {
      e->frames[i].vertices = e->ReadVertices(e->frames[i].id);
      loaded.push_back(i);
    } catch (const Error&) {
      e->frames[i].has_mesh = false;  // the check of meshes tells
    }
  }
  if (loaded.empty()) return;
  e->points = SpreadPoints(e->frames[loaded.front()].vertices, e->topology, kSurfacePoints);
  for (const size_t i : loaded) e->frames[i].views.resize(cameras);
  Progress progress("read a sample", static_cast<int64_t>(loaded.size() * cameras), "images");
  ParallelFor(static_cast<int64_t>(loaded.size() * cameras), [&](int64_t k) {
    ExaminedFrame& frame = e->frames[loaded[static_cast<size_t>(k) / cameras]];
    const size_t camera = static_cast<size_t>(k) % cameras;
    if (!e->doubtful.contains({loaded[static_cast<size_t>(k) / cameras], camera})) {
      frame.views[camera] = e->ReadView(frame.id, e->cameras[camera]);
    }
    progress.Advance();
  });
  progress.Finish();
  for (const size_t i : loaded) {
    e->report.views += static_cast<int>(std::count_if(e->frames[i].views.begin(), e->frames[i].views.end(),
                                                      [](const View& view) { return !view.empty(); }));
  }
}

}  // namespace likeness
