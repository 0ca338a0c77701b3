#include "likeness/train/step.h"

#include <ATen/CPUGeneratorImpl.h>

#include <cmath>

#include "likeness/train/loss.h"

namespace likeness {

StepValues TrainStep(const Network& network, Optimiser& optimiser, const Batch& batch, const LossWeights& weights,
                     uint64_t noise_seed, double learning_rate, double clip) {
  const int64_t views = batch.texture.size(0) / batch.average.size(0);
  const Network::Encoding encoding = network.Encode(batch.average, batch.vertices);
  const torch::Tensor mu = encoding.mu.repeat_interleave(views, 0);
  const torch::Tensor sigma = encoding.log_sigma.exp().repeat_interleave(views, 0);
  const torch::Tensor noise =
      torch::randn(mu.sizes(), at::detail::createCPUGenerator(noise_seed), torch::kFloat32).to(mu.options());
  Network::Decoding decoding = network.Decode(mu + sigma * noise, batch.view);
  decoding.texture = network.InCameraColours(decoding.texture, batch.camera);
  const Loss loss = ComputeLoss(weights, batch, encoding, decoding);

  optimiser.ZeroGradients();
  loss.total.backward();

  StepValues values;
  values.total = loss.total.item<double>();
  values.texture = loss.texture.item<double>();
  values.geometry = loss.geometry.item<double>();
  values.kl = loss.kl.item<double>();
  values.gradient_norm = optimiser.GradientNorm();
  values.skipped = !std::isfinite(values.total) || !std::isfinite(values.gradient_norm);
  if (!values.skipped) optimiser.Step(learning_rate, values.gradient_norm, clip);
  return values;
}

}  // namespace likeness
