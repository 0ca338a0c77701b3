// An avatar to pictures: decoded at run time for each camera's own view, and drawn on the processor.

#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/conditions.h"
#include "likeness/decode/decoder.h"
#include "likeness/geometry/camera.h"
#include "likeness/image/image.h"
#include "likeness/render/frame_renderer.h"

namespace likeness {

class AvatarPainter {
 public:
  // Throws Error naming the file when it is no avatar, or one that the run time does not decode.
  AvatarPainter(std::filesystem::path avatar_file, std::array<uint8_t, 3> background, bool transparent);

  const Avatar& avatar() const { return avatar_; }

  // A picture for each of one or two cameras: RGBA where the background is transparent, otherwise RGB. Opening the
  // decoder anew for another person or other conditions takes a tenth of a second.
  //   code  [latent]
  std::vector<ImageU8> Paint(std::span<const float> code, const FrameConditions& conditions,
                             std::span<const Camera> cameras, const RigidTransform& world_from_head);

 private:
  void Open(const FrameConditions& conditions);

  const std::filesystem::path file_;
  const bool transparent_;
  const Avatar avatar_;
  const std::shared_ptr<Team> team_;
  FrameRenderer renderer_;
  std::unique_ptr<Decoder> decoder_;
  FrameConditions open_;  // what the decoder was opened for
  std::vector<float> vertices_;
  std::vector<uint8_t> textures_[FrameRenderer::kMostViews];
};

}  // namespace likeness
