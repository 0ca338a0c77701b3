#include "likeness/train/evaluation_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/text.h"
#include "likeness/image/video_writer.h"
#include "likeness/train/comparison.h"
#include "likeness/train/evaluation_tasks.h"

namespace likeness {
namespace {

std::string FindSegment(const Capture& capture, const std::string& name) {
  if (name.empty()) {
    const std::vector<FrameId> held_out = capture.HeldOutFrames();
    return (held_out.empty() ? capture.frames() : held_out).front().segment;
  }
  std::vector<std::string> known;
  for (const FrameId& frame : capture.frames()) {
    if (frame.segment == name) return name;
    if (known.empty() || known.back() != frame.segment) known.push_back(frame.segment);
  }
  const std::string nearest = NearestWord(name, known);
  throw Error("{} has no segment '{}'{}; likeness inspect lists them", capture.root().string(), name,
              nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
}

const Camera& ChooseCamera(const Capture& capture, const std::string& name) {
  if (!name.empty()) return capture.FindCamera(name);
  const std::vector<std::string>& held_out = capture.split().held_out_cameras;
  return held_out.empty() ? capture.cameras().front() : capture.FindCamera(held_out.front());
}

}  // namespace

void EvaluationVideoOptions::Check() const {
  if (!(frames_per_s >= 0.1 && frames_per_s <= 1000)) {
    throw Error("a video shows 0.1 to 1000 frames a second, not {}", frames_per_s);
  }
  EvaluationOptions drawing;
  drawing.supersample = supersample;
  drawing.Check();
}

EvaluationVideo WriteEvaluationVideo(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                                     const EvaluationVideoOptions& options) {
  options.Check();
  if (capture.frames().empty()) throw Error("{} has no frames", capture.root().string());
  const Camera& camera = ChooseCamera(capture, options.camera);
  EvaluationVideo video = {camera.name, FindSegment(capture, options.segment), {}};
  std::vector<EvaluationTask> tasks;
  for (const FrameId& frame : capture.frames()) {
    if (frame.segment != video.segment || !capture.HasCameraImage(frame, camera)) continue;
    tasks.push_back({GroupOf(capture.split(), frame, camera), &frame, &camera, true});
  }
  if (tasks.empty()) {
    throw Error("{}: camera {} has no image of segment {}", capture.root().string(), camera.name, video.segment);
  }
  EvaluationOptions drawing;
  drawing.supersample = options.supersample;
  const std::vector<std::vector<size_t>> frames = ByFrame(tasks);
  std::vector<ImageMeasurement> measurements(tasks.size());
  std::optional<Framing> framing;
  VideoWriter writer(options.path, options.frames_per_s);
  const InterruptScope interrupt;
  Progress progress("video", static_cast<int64_t>(tasks.size()), "frames");
  const auto chunk = static_cast<size_t>(2 * ThreadCount());
  for (size_t begin = 0; begin < frames.size(); begin += chunk) {
    const size_t end = std::min(begin + chunk, frames.size());
    MeasureTasks(
        capture, encode, decoder, drawing, nullptr, tasks,
        {frames.begin() + static_cast<std::ptrdiff_t>(begin), frames.begin() + static_cast<std::ptrdiff_t>(end)},
        [&](size_t i, ImageMeasurement measurement) {
          measurements[i] = std::move(measurement);
          return !interrupt.Requested();
        });
    if (interrupt.Requested()) throw Error("interrupted; {} was not written", options.path.string());
    for (size_t i = begin; i < end; ++i) {
      EvaluatedPicture& picture = *measurements[i].picture;
      if (!framing) framing = WholeFraming(picture.mask);
      writer.Write(ComparisonPanel(picture, *framing));
      measurements[i].picture.reset();
      progress.Advance();
    }
  }
  progress.Finish();
  writer.Finish();
  video.figures = Summarise(tasks, &measurements).Of(tasks.front().group);
  return video;
}

}  // namespace likeness
