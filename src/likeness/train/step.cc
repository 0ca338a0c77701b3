#include "likeness/train/step.h"

#include <ATen/CPUGeneratorImpl.h>

#include <array>
#include <cmath>

#include "likeness/train/loss.h"

namespace likeness {

StepValues TrainStep(const Network& network, Optimiser& optimiser, const Peers& peers, GradientExchange& exchange,
                     const Batch& batch, const LossWeights& weights, const ImageLoss* image_loss, uint64_t noise_seed,
                     double learning_rate, double clip) {
  const int64_t views = batch.texture.size(0) / batch.average.size(0);
  const torch::Tensor condition = network.Condition(batch.identity, batch.named);
  const Network::Encoding encoding = network.Encode(batch.average, batch.vertices, condition);
  const torch::Tensor mu = encoding.mu.repeat_interleave(views, 0);
  const torch::Tensor sigma = encoding.log_sigma.exp().repeat_interleave(views, 0);
  // Every process draws the noise of all, so that it does not matter how many there are.
  const int64_t samples = mu.size(0);
  const torch::Tensor noise =
      torch::randn({peers.count() * samples, mu.size(1)}, at::detail::createCPUGenerator(noise_seed), torch::kFloat32)
          .narrow(0, peers.rank() * samples, samples)
          .to(mu.options());
  const torch::Tensor condition_of_view = condition.defined() ? condition.repeat_interleave(views, 0) : condition;
  Network::Decoding decoding = network.Decode(mu + sigma * noise, batch.view, condition_of_view);
  decoding.texture = network.InCameraColours(decoding.texture, batch.camera);
  const Loss loss = ComputeLoss(weights, batch, encoding, decoding, image_loss);

  optimiser.ZeroGradients();
  loss.total.backward();
  exchange.Finish();

  std::array terms = {loss.total.item<double>(), loss.texture.item<double>(), loss.geometry.item<double>(),
                      loss.kl.item<double>(), loss.image.defined() ? loss.image.item<double>() : 0};
  peers.Sum(terms);
  for (double& term : terms) term /= peers.count();
  StepValues values;
  values.total = terms[0];
  values.texture = terms[1];
  values.geometry = terms[2];
  values.kl = terms[3];
  values.image = terms[4];
  values.gradient_norm = optimiser.GradientNorm();
  values.skipped = !std::isfinite(values.total) || !std::isfinite(values.gradient_norm);
  if (!values.skipped) optimiser.Step(learning_rate, values.gradient_norm, clip);
  return values;
}

}  // namespace likeness
