#include "likeness/train/loss.h"

#include "likeness/train/ops/masked_loss.h"

namespace likeness {

torch::Tensor KlDivergence(const torch::Tensor& mu, const torch::Tensor& log_sigma) {
  const torch::Tensor log_variance = 2 * log_sigma;
  return 0.5 * (log_variance.exp() + mu.square() - 1 - log_variance);
}

Loss ComputeLoss(const LossWeights& weights, const Batch& batch, const Network::Encoding& encoding,
                 const Network::Decoding& decoding, const ImageLoss* image_loss) {
  const int64_t views = decoding.vertices.size(0) / batch.vertices.size(0);
  const torch::Tensor vertices = batch.vertices.repeat_interleave(views, 0);
  Loss loss;
  loss.texture = MaskedSquaredError(decoding.texture, batch.texture, batch.seen);
  loss.geometry = (decoding.vertices - vertices).square().mean();
  loss.kl = KlDivergence(encoding.mu, encoding.log_sigma).mean();
  loss.total = weights.texture * loss.texture + weights.geometry * loss.geometry + weights.kl * loss.kl;
  if (image_loss != nullptr) {
    loss.image = (*image_loss)(batch, decoding);
    loss.total = loss.total + weights.image * loss.image;
  }
  return loss;
}

}  // namespace likeness
