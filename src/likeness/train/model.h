// A trained avatar at work, on LibTorch: encodes frames, decodes codes. Evaluation and rendering use it.

#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/frame_decoder.h"

namespace likeness {

class AvatarModel : public FrameDecoder {
 public:
  //   device  "cpu", or "cuda" where LibTorch finds a GPU
  // Throws Error naming the file when it is no avatar, or the device when it is not there.
  static std::unique_ptr<AvatarModel> Load(const std::filesystem::path& avatar_file, const std::string& device = "cpu");
  explicit AvatarModel(Avatar avatar, const std::string& device = "cpu");
  ~AvatarModel() override;

  const Avatar& avatar() const;

  // The mean code mu [latent] of a frame; no noise is added.
  //   average_texture   RGB of the avatar's texture size, row 0 is v = 1: mean over the cameras that see a texel
  //   seen              255 where at least one camera sees the texel; elsewhere the avatar's mean texture is used.
  //                     Empty: a texel of (0, 0, 0) was not seen, as in published captures
  //   conditions        whose frame it is, and its named conditions
  // Throws Error when sizes do not fit.
  std::vector<float> Encode(const ImageU8& average_texture, const Vertices& vertices_in_head, const ImageU8& seen = {},
                            const FrameConditions& conditions = {}) const;

  // Safe from several threads at once.
  using FrameDecoder::Decode;
  DecodedFrame Decode(std::span<const float> code, const Eigen::Vector3d& view_in_head,
                      const FrameConditions& conditions) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace likeness
