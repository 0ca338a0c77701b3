// The images that an evaluation looks at, and what it learns from each: for evaluate.h and what shares its work out.

#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "likeness/train/evaluate.h"

namespace likeness {

// One image to look at.
struct EvaluationTask {
  EvaluationGroup group = EvaluationGroup::kTraining;
  const FrameId* frame = nullptr;  // the capture's
  const Camera* camera = nullptr;  // the capture's
  bool keep_picture = false;
};

struct ImageMeasurement {
  SquaredError error;
  SquaredError covered;
  SquaredError texture;
  double ssim = 0;
  double vertex_mm = 0;
  int64_t head_pixels = 0;
  int64_t uncovered_pixels = 0;
  bool unmasked = false;
  std::optional<EvaluatedPicture> picture;
};

// In the order of the groups. The same list for the same capture and options. Throws Error when it would be empty.
std::vector<EvaluationTask> ChooseTasks(const Capture& capture, const EvaluationOptions& options);

EvaluationGroup GroupOf(const Split& split, const FrameId& frame, const Camera& camera);

// Indices of tasks of the same frame together, so that each is read and encoded once.
std::vector<std::vector<size_t>> ByFrame(const std::vector<EvaluationTask>& tasks);

// Measures the tasks that `frames` lists, on all cores. Calls done(index of the task, measurement) from several
// threads; begins no other image after it has returned false. Otherwise as Evaluate().
void MeasureTasks(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                  const EvaluationOptions& options, const TextureSet* textures,
                  const std::vector<EvaluationTask>& tasks, const std::vector<std::vector<size_t>>& frames,
                  const std::function<bool(size_t, ImageMeasurement)>& done);

// The figures of all tasks; takes the pictures out of the measurements.
EvaluationResult Summarise(const std::vector<EvaluationTask>& tasks, std::vector<ImageMeasurement>* measurements);

}  // namespace likeness
