#include "likeness/train/evaluation_tasks.h"

#include <algorithm>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/random.h"

namespace likeness {
namespace {

// One of every `size / count` in a row, at random: spread evenly, and in step with no pattern of the capture's.
std::vector<size_t> Stratified(size_t size, size_t count, uint64_t seed) {
  std::vector<size_t> chosen;
  if (count == 0 || count >= size) {
    for (size_t i = 0; i < size; ++i) chosen.push_back(i);
    return chosen;
  }
  Random random(seed);
  for (size_t i = 0; i < count; ++i) {
    const size_t begin = i * size / count, end = (i + 1) * size / count;
    chosen.push_back(begin + static_cast<size_t>(random.Below(static_cast<int64_t>(end - begin))));
  }
  return chosen;
}

// Marks tasks evenly over the list, each time one of a camera that has been shown least.
void KeepPictures(size_t count, std::vector<EvaluationTask>* tasks) {
  count = std::min(count, tasks->size());
  std::map<const Camera*, int> shown;
  for (size_t i = 0; i < count; ++i) {
    const auto begin = tasks->begin() + static_cast<std::ptrdiff_t>(i * tasks->size() / count);
    const auto end = tasks->begin() + static_cast<std::ptrdiff_t>((i + 1) * tasks->size() / count);
    const auto chosen = std::min_element(begin, end, [&](const EvaluationTask& a, const EvaluationTask& b) {
      return shown[a.camera] < shown[b.camera];
    });
    chosen->keep_picture = true;
    ++shown[chosen->camera];
  }
}

}  // namespace

std::vector<EvaluationTask> ChooseTasks(const Capture& capture, const EvaluationOptions& options) {
  std::vector<EvaluationTask> tasks;
  for (const EvaluationGroup group : kEvaluationGroups) {
    const bool new_camera = group == EvaluationGroup::kHeldOutCameras || group == EvaluationGroup::kHeldOutBoth;
    const bool new_segment = group == EvaluationGroup::kHeldOutSegments || group == EvaluationGroup::kHeldOutBoth;
    const Split& split = capture.split();
    std::vector<EvaluationTask> all;
    for (const FrameId& frame : capture.frames()) {
      if (split.IsHeldOutSegment(frame.segment) != new_segment) continue;
      for (const std::string& name : new_camera ? split.held_out_cameras : split.training_cameras) {
        const Camera& camera = capture.FindCamera(name);
        if (capture.HasCameraImage(frame, camera)) all.push_back({group, &frame, &camera});
      }
    }
    std::vector<EvaluationTask> chosen;
    for (const size_t i : Stratified(all.size(), static_cast<size_t>(options.max_images), options.seed)) {
      chosen.push_back(all[i]);
    }
    KeepPictures(static_cast<size_t>(options.pictures), &chosen);
    tasks.insert(tasks.end(), chosen.begin(), chosen.end());
  }
  if (tasks.empty()) throw Error("{}: no frame has an image to compare with", capture.root().string());
  return tasks;
}

EvaluationGroup GroupOf(const Split& split, const FrameId& frame, const Camera& camera) {
  const bool new_camera = split.IsHeldOutCamera(camera.name);
  if (split.IsHeldOutSegment(frame.segment)) {
    return new_camera ? EvaluationGroup::kHeldOutBoth : EvaluationGroup::kHeldOutSegments;
  }
  return new_camera ? EvaluationGroup::kHeldOutCameras : EvaluationGroup::kTraining;
}

// Tasks of the same frame together, so that each is read and encoded once.
std::vector<std::vector<size_t>> ByFrame(const std::vector<EvaluationTask>& tasks) {
  std::vector<size_t> order(tasks.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return tasks[a].frame < tasks[b].frame; });
  std::vector<std::vector<size_t>> frames;
  for (const size_t i : order) {
    if (frames.empty() || tasks[frames.back().front()].frame != tasks[i].frame) frames.emplace_back();
    frames.back().push_back(i);
  }
  return frames;
}

}  // namespace likeness
