#include "likeness/train/preview.h"

#include <algorithm>

namespace likeness {

ImageU8 Preview(const Network& network, const Dataset& dataset, torch::Device device) {
  const torch::NoGradGuard no_grad;
  const int size = dataset.size(), total = static_cast<int>(dataset.samples().size());
  constexpr int kSamples = 3;
  const int rows = std::min(kSamples, total);
  ImageU8 picture(3 * size, rows * size, 3, 128);
  for (int row = 0; row < rows; ++row) {
    const int sample = static_cast<int>((row + 0.5) * total / rows);
    const Batch batch = dataset.Read({sample}, 1);
    const torch::Tensor condition = network.Condition(batch.identity.to(device), batch.named.to(device));
    const torch::Tensor mu = network.Encode(batch.average.to(device), batch.vertices.to(device), condition).mu;
    const torch::Tensor prediction =
        network.Decode(mu, batch.view.to(device), condition).texture.cpu().permute({0, 2, 3, 1}).contiguous();
    const torch::Tensor target = batch.texture.permute({0, 2, 3, 1}).contiguous();
    const Statistics& statistics = dataset.statistics(dataset.IdentityOf(dataset.samples()[sample].frame));
    const ImageF predicted = RestoreTexture(statistics, prediction.const_data_ptr<float>());
    const ImageF truth = RestoreTexture(statistics, target.const_data_ptr<float>());
    const float* seen = batch.seen.const_data_ptr<float>();
    const auto byte = [](float value) { return static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); };
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const bool valid = seen[y * size + x] != 0;
        for (int c = 0; c < 3; ++c) {
          const float is = predicted.at(x, y)[c], should = truth.at(x, y)[c];
          picture.at(size + x, row * size + y)[c] = byte(is);
          if (!valid) continue;
          picture.at(x, row * size + y)[c] = byte(should);
          picture.at(2 * size + x, row * size + y)[c] = byte(128 + 5 * (is - should));
        }
      }
    }
  }
  return picture;
}

}  // namespace likeness
