// How well an avatar shows what it has not seen: the held-out protocol.
//
// Every image of a capture falls into one of four groups, by whether its camera and its segment were trained on. For
// each image the frame is encoded (the mean code, no noise; the average texture comes from training cameras alone),
// decoded for the camera's view, drawn with the frame's head pose, and compared with the image over the head's pixels.
// As in Lombardi et al. 2018 (section "Architecture Search"), the error is an image-space MSE over head pixels, in
// units of 0 ... 255. Head pixels that the avatar's mesh does not cover count as drawn black.

#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/frame_decoder.h"
#include "likeness/capture/capture.h"
#include "likeness/image/image.h"
#include "likeness/image/metrics.h"
#include "likeness/texture/texture_set.h"

namespace likeness {

enum class EvaluationGroup { kTraining, kHeldOutCameras, kHeldOutSegments, kHeldOutBoth };
inline constexpr std::array kEvaluationGroups = {EvaluationGroup::kTraining, EvaluationGroup::kHeldOutCameras,
                                                 EvaluationGroup::kHeldOutSegments, EvaluationGroup::kHeldOutBoth};
std::string ToString(EvaluationGroup group);  // "training", "held_out_cameras", "held_out_segments", "held_out_both"

struct EvaluationOptions {
  int max_images = 0;   // of each group, spread over all of them; 0: all
  int pictures = 3;     // kept of each group, spread over those evaluated
  int supersample = 2;  // n x n samples a pixel of the drawing
  uint64_t seed = 1;    // which images, where max_images leaves some out

  void Check() const;  // throws Error
};

struct GroupResult {
  EvaluationGroup group = EvaluationGroup::kTraining;
  int images = 0;
  SquaredError error;       // pooled over all head pixels and channels of the group's images
  SquaredError covered;     // likewise over those that the avatar's mesh covers
  SquaredError texture;     // likewise over the texels that the camera sees, where the capture is unwrapped
  double ssim = 0;          // mean over images of the mean over head pixels
  double vertex_mm = 0;     // mean over images of the mean distance of vertices that belong to triangles
  double uncovered = 0;     // share of head pixels where the avatar's mesh is not
  int images_unmasked = 0;  // images without a head mask: the tracked mesh's outline stood in for it
};

// One image, as it is and as the avatar shows it.
struct EvaluatedPicture {
  EvaluationGroup group = EvaluationGroup::kTraining;
  FrameId frame;
  std::string camera;
  ImageU8 truth;    // RGB
  ImageU8 ours;     // RGB, black where the mesh is not
  ImageU8 mask;     // 255: head pixels, those that count
  ImageU8 texture;  // RGB, as decoded for this camera
  double mse = 0;
  double ssim = 0;
};

struct EvaluationResult {
  std::array<GroupResult, 4> groups;  // in the order of kEvaluationGroups
  std::vector<EvaluatedPicture> pictures;

  const GroupResult& Of(EvaluationGroup group) const { return groups[static_cast<size_t>(group)]; }
};

// Throws Error when the avatar says that it was trained on a camera or segment that the capture's split holds out: the
// figures would be a lie.
//   identity  the avatar's person whom the capture shows
void CheckHeldOut(const Avatar& avatar, const Capture& capture, int identity = 0);

// What a frame is decoded from.
struct EncodedFrame {
  std::vector<float> code;
  FrameConditions conditions = {};
};

// Called from several threads at once.
using FrameEncoder = std::function<EncodedFrame(const FrameId& frame, const TrackedFrame& tracked)>;

// Throws Error where the decoder's mesh is not the capture's, or a file is damaged. Shows progress.
//   textures  of the decoder's size, for the error of textures; none leaves it out
EvaluationResult Evaluate(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                          const EvaluationOptions& options, const TextureSet* textures = nullptr);

std::string ToText(const EvaluationResult& result);  // a table for a person
// One object a group: "mse", "mse_covered", "psnr_db", "ssim", "texture_mse", "vertex_mm", "images", "uncovered",
// "images_unmasked"; the first six are null where the group has no images, psnr_db also where the error is 0.
std::string ToJson(const EvaluationResult& result);
std::string ToCsv(const EvaluationResult& result);  // the same, a row a group

}  // namespace likeness
