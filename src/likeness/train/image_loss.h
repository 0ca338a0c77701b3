// The image term of the loss (Lombardi et al. 2018, "Image-based vs. Texture/Geometry-based Loss"):
//
//   lambda_I |m (I - I^)|^2,   I^ the decoded texture on the decoded mesh as the camera sees it (render/render_image.h)
//
// Images are compared as they are, in image space; the difference is divided by the textures' deviation, so that a unit
// of this term is a unit of the texture term. The value is the mean over the batch's head pixels and their channels:
// times the deviation squared, the error that `likeness evaluate` prints. Head pixels that the mesh does not cover do
// not count, as nothing could be learnt from them: an outline has no gradient. With silhouettes it has one: then every
// pixel of head or mesh counts, and whatever is no head is black.

#pragma once

#include <torch/types.h>

#include <vector>

#include "likeness/train/dataset.h"
#include "likeness/train/network.h"
#include "likeness/train/render/render_image.h"

namespace likeness {

class ImageLoss {
 public:
  //   people       whose faces a batch may show
  //   silhouettes  outlines have a gradient (render/silhouettes.h)
  ImageLoss(const MeshTopology& topology, const std::vector<Statistics>& people, torch::TensorOptions options,
            bool silhouettes = false);

  // A scalar, 0 where no pixel counts.
  //   batch     with crops
  //   decoding  of its N textures, in the cameras' colours; vertices may be of the F frames instead
  torch::Tensor operator()(const Batch& batch, const Network::Decoding& decoding) const;

 private:
  torch::Tensor OfPeople(const torch::Tensor& values, const torch::Tensor& identity) const;

  RenderTopology topology_;
  RenderOptions render_;
  torch::Tensor texture_mean_;  // [people, 3, S, S], divided by the textures' deviation
  torch::Tensor vertex_mean_;   // [people, V, 3] mm
  double vertex_deviation_ = 1;
};

}  // namespace likeness
