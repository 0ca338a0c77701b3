// One camera's view of a segment as a video: ground truth beside ours, frame by frame.

#pragma once

#include <filesystem>
#include <string>

#include "likeness/train/evaluate.h"

namespace likeness {

struct EvaluationVideoOptions {
  std::filesystem::path path;  // its ending chooses the format, such as .mp4
  std::string camera;          // empty: the first held-out one, otherwise the first
  std::string segment;         // empty: that of the first held-out frame, otherwise of the first
  double frames_per_s = 30;
  int supersample = 2;  // n x n samples a pixel of the drawing

  void Check() const;  // throws Error
};

struct EvaluationVideo {
  std::string camera;
  std::string segment;
  GroupResult figures;  // over the video's frames
};

// Draws the frames of the segment that have an image, in the capture's order, a few at a time. Needs the program ffmpeg
// (image/video_writer.h). Throws Error for names that the capture lacks, naming the nearest known one, and on Ctrl-C;
// nothing is left then.
EvaluationVideo WriteEvaluationVideo(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                                     const EvaluationVideoOptions& options);

}  // namespace likeness
