// The figures that the Multiface project prints for its models, so that ours can stand beside them.
//
// They are not held out: in all published splits the test cameras are the training cameras; only segments are new. And
// they judge textures, not images. For every frame of the held-out segments and every training camera:
//   texture  mean over ALL texels and channels of (w (T - T^))^2, 0 ... 255 units; unseen ones (value 0) count as right
//   vertices mean over all coordinates of (M - M^)^2, in variances of the capture
// then the mean over views. That project's script also goes on fitting encoder and colours to the test frames for
// eight passes before it measures; here nothing is fitted, so the same weights give larger figures.

#pragma once

#include <cstdint>
#include <string>

#include "likeness/avatar/frame_decoder.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/evaluate.h"

namespace likeness {

struct MultifaceFigures {
  int64_t views = 0;
  double texture_mse = 0;
  double vertex_mse = 0;
};

// Throws Error where no segment is held out.
MultifaceFigures EvaluateAsMultiface(const TextureSet& textures, const FrameEncoder& encode,
                                     const FrameDecoder& decoder);

std::string ToText(const MultifaceFigures& figures);
std::string ToJson(const MultifaceFigures& figures);

}  // namespace likeness
