// What training minimises (Lombardi et al. 2018, section 4, the loss l(phi)).

#pragma once

#include <torch/types.h>

#include "likeness/train/dataset.h"
#include "likeness/train/image_loss.h"
#include "likeness/train/network.h"
#include "likeness/train/options.h"

namespace likeness {

// The paper sums; here each term is a mean over its elements, so that the weights mean the same at every texture size:
//   texture   |w (T - T^)|^2 over all N x 3 x S x S texels and channels, those that are not seen counting as 0
//   geometry  |M - M^|^2 over all N x 3 V coordinates
//   kl        KL(N(mu, sigma) || N(0, 1)) over all F x latent values
//   image     |m (I - I^)|^2 over head pixels and channels, as image_loss.h has it
// Textures and vertices are standardised.
struct Loss {
  torch::Tensor texture, geometry, kl;  // scalars
  torch::Tensor image;                  // undefined without an image loss
  torch::Tensor total;                  // weighted sum
};

//   encoding    of the batch's F frames
//   decoding    of its N textures; vertices may be of the F frames instead, when they share a code
//   image_loss  null: without this term
Loss ComputeLoss(const LossWeights& weights, const Batch& batch, const Network::Encoding& encoding,
                 const Network::Decoding& decoding, const ImageLoss* image_loss = nullptr);

// KL(N(mu, sigma) || N(0, 1)) = (sigma^2 + mu^2 - 1 - log sigma^2) / 2 for every value.
torch::Tensor KlDivergence(const torch::Tensor& mu, const torch::Tensor& log_sigma);

}  // namespace likeness
