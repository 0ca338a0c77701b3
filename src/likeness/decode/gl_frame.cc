#include "likeness/decode/gl_frame.h"

#include <algorithm>

#include "likeness/decode/frame_checks.h"
#include "likeness/decode/layout.h"

namespace likeness {

namespace {

int RoundUpToFour(int values) { return (values + 3) / 4 * 4; }

void Apply(const DenseLayer& layer, const float* x, float* y) {
  for (int o = 0; o < layer.out; ++o) {
    float sum = layer.bias[o];
    for (int i = 0; i < layer.in; ++i) sum += layer.weight[static_cast<size_t>(o) * layer.in + i] * x[i];
    y[o] = std::max(sum, layer.slope * sum);
  }
}

}  // namespace

GlFrame::GlFrame(const DecoderNetwork& network)
    : latent_(network.architecture.latent),
      bilinear_(network.architecture.model == ModelKind::kBilinear),
      view_(network.view),
      features_(view_.empty() ? 3 : view_.out) {
  int at = RoundUpToFour(latent_);
  const auto take = [&](int pitch) {
    const int begin = at;
    at += kMostViews * pitch;
    return begin;
  };
  view_in_ = RoundUpToFour(bilinear_ ? 3 * latent_ : network.inner_view.in);
  view_at_ = take(view_in_);
  for (const ConvolutionLayer& layer : network.layers) {
    Addition addition{layer.view_add, -1, PaddedChannels(layer.in)};
    if (!layer.view_add.empty()) addition.at = take(addition.pitch);
    additions_.push_back(std::move(addition));
  }
  values_.resize(at, 0.0f);
}

void GlFrame::Write(std::span<const float> code, std::span<const std::array<float, 3>> directions) {
  std::copy(code.begin(), code.end(), values_.begin());
  for (size_t v = 0; v < directions.size(); ++v) {
    const std::array<float, 3>& direction = directions[v];
    float* to = values_.data() + view_at_ + v * view_in_;
    if (bilinear_) {
      for (const float axis : direction) {
        for (const float value : code) *to++ = axis * value;
      }
      continue;
    }
    if (view_.empty()) {
      std::copy(direction.begin(), direction.end(), features_.begin());
    } else {
      Apply(view_, direction.data(), features_.data());
    }
    if (view_in_ > 0) std::copy(features_.begin(), features_.end(), to);
    for (const Addition& addition : additions_) {
      if (addition.at >= 0) Apply(addition.layer, features_.data(), values_.data() + addition.at + v * addition.pitch);
    }
  }
}

}  // namespace likeness
