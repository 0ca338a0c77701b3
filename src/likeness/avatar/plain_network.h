// The network once more, slow and plain, in double precision and without LibTorch: what tests compare with.

#pragma once

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"

namespace likeness {

struct PlainNetwork {
  Architecture architecture;
  std::map<std::string, Tensor> weights;  // folded

  using Values = std::vector<double>;

  // One layer for one sample, values channel by channel and row by row.
  //   size  side of the input; 1 for a linear layer
  Values Apply(const std::string& name, const Values& x, int size) const {
    const LayerInfo info = Find(name);
    const std::vector<float>& w = weights.at(name + ".weight").values;
    const std::vector<float>& b = weights.at(name + ".bias").values;
    const int out_size = info.out_size;
    Values y(static_cast<size_t>(info.out) * out_size * out_size, 0.0);
    for (size_t i = 0; i < y.size(); ++i) y[i] = info.untied_bias ? b[i] : b[i / (out_size * out_size)];
    if (info.kind == LayerKind::kLinear) {
      for (int o = 0; o < info.out; ++o) {
        for (int i = 0; i < info.in; ++i) y[o] += w[static_cast<size_t>(o) * info.in + i] * x[i];
      }
      return y;
    }
    if (info.kind == LayerKind::kUpsampledConvolution || info.kind == LayerKind::kSameConvolution) {
      const int shrink = out_size / size;  // an output's texel lies in this texel of the input
      for (int o = 0; o < info.out; ++o) {
        for (int i = 0; i < info.in; ++i) {
          for (int at = 0; at < out_size * out_size * 9; ++at) {
            const int oy = at / 9 / out_size, ox = at / 9 % out_size, ky = at % 9 / 3, kx = at % 3;
            const int iy = oy + ky - 1, ix = ox + kx - 1;
            if (iy < 0 || ix < 0 || iy >= out_size || ix >= out_size) continue;
            y[(o * out_size + oy) * out_size + ox] +=
                w[(o * info.in + i) * 9 + ky * 3 + kx] * x[(i * size + iy / shrink) * size + ix / shrink];
          }
        }
      }
      return y;
    }
    // A convolution takes large to small: large = 2 * small - 1 + tap. A transposed one goes the other way.
    const bool transposed = info.kind == LayerKind::kTransposedConvolution;
    const int small = transposed ? size : out_size, large = 2 * small;
    for (int o = 0; o < info.out; ++o) {
      for (int i = 0; i < info.in; ++i) {
        for (int sy = 0; sy < small; ++sy) {
          for (int sx = 0; sx < small; ++sx) {
            for (int ky = 0; ky < 4; ++ky) {
              for (int kx = 0; kx < 4; ++kx) {
                const int ly = 2 * sy - 1 + ky, lx = 2 * sx - 1 + kx;
                if (ly < 0 || lx < 0 || ly >= large || lx >= large) continue;
                if (transposed) {
                  y[(o * large + ly) * large + lx] +=
                      w[((i * info.out + o) * 4 + ky) * 4 + kx] * x[(i * small + sy) * small + sx];
                } else {
                  y[(o * small + sy) * small + sx] +=
                      w[((o * info.in + i) * 4 + ky) * 4 + kx] * x[(i * large + ly) * large + lx];
                }
              }
            }
          }
        }
      }
    }
    return y;
  }

  static Values Activate(Values x) {
    for (double& v : x) v = v < 0 ? 0.2 * v : v;
    return x;
  }

  static Values Concatenate(Values a, const Values& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  static Values Sum(Values a, const Values& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
    return a;
  }

  bool Has(const std::string& name) const { return weights.count(name + ".weight") != 0; }

  // Red, green, blue of every texel of an image that has them channel by channel, or back.
  Values Interleaved(const Values& x, bool back) const {
    Values y(x.size());
    const size_t texels = x.size() / 3;
    for (size_t i = 0; i < texels; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        (back ? y[c * texels + i] : y[3 * i + c]) = back ? x[3 * i + c] : x[c * texels + i];
      }
    }
    return y;
  }

  // The condition vector: who it is, then the named conditions.
  Values Condition(int identity, const Values& named) const {
    Values c(IdentityChannels(architecture), 0.0);
    if (architecture.identity == IdentityConditioning::kOneHot) c[identity] = 1;
    if (architecture.identity == IdentityConditioning::kLearned) {
      const Tensor& vectors = weights.at("identity.vectors");
      for (size_t i = 0; i < c.size(); ++i) c[i] = vectors.values[identity * c.size() + i];
    }
    return Concatenate(c, named);
  }

  // mu, then log sigma.
  Values Encode(Values texture, const Values& vertices, const Values& condition = {}) const {
    if (architecture.model != ModelKind::kDeep) {
      const std::vector<float>& log_sigma = weights.at("encoder.log_sigma.bias").values;
      return Concatenate(Sum(Apply("encoder.texture_fc", Interleaved(texture, false), 1),
                             Apply("encoder.mesh_fc", Concatenate(vertices, condition), 1)),
                         Values(log_sigma.begin(), log_sigma.end()));
    }
    int size = architecture.texture_size;
    for (size_t i = 0; size > InnerSize(architecture); ++i, size /= 2) {
      texture = Activate(Apply("encoder.texture_conv." + std::to_string(i), texture, size));
      const std::string residual = "encoder.texture_res." + std::to_string(i);
      if (Has(residual)) texture = Activate(Sum(Apply(residual, texture, size / 2), texture));
    }
    Values both =
        Concatenate(Activate(Apply("encoder.texture_fc", texture, 1)), Activate(Apply("encoder.mesh_fc", vertices, 1)));
    both = Concatenate(both, condition);
    if (!Has("encoder.code_fc")) {
      return Concatenate(Apply("encoder.mu_fc", both, 1), Apply("encoder.log_sigma_fc", both, 1));
    }
    Values code = Apply("encoder.code_fc", both, 1);
    for (size_t i = 0; i < code.size(); ++i) code[i] *= i < code.size() / 2 ? 0.1 : 0.01;
    return code;
  }

  Values DecodeVertices(const Values& code, const Values& condition = {}) const {
    const Values state = Concatenate(code, condition);
    if (architecture.model != ModelKind::kDeep) return Apply("decoder.mesh_fc", state, 1);
    return Apply("decoder.mesh_fc", Activate(Apply("decoder.code_fc", state, 1)), 1);
  }

  Values DecodeTexture(const Values& code, Values view, const Values& condition = {}) const {
    const Values state = Concatenate(code, condition);
    if (architecture.model == ModelKind::kLinear) return Interleaved(Apply("decoder.texture_fc", state, 1), true);
    if (architecture.model == ModelKind::kBilinear) {
      Values products;
      for (const double v : view) {
        for (const double z : state) products.push_back(v * z);
      }
      return Interleaved(Apply("decoder.texture_fc", products, 1), true);
    }
    if (Has("decoder.view_fc")) view = Activate(Apply("decoder.view_fc", view, 1));
    Values joined = Activate(Apply("decoder.code_fc", state, 1));
    if (!Has("decoder.view_add.0")) joined = Concatenate(view, joined);
    Values texture = Activate(Apply("decoder.texture_fc", joined, 1));
    int size = InnerSize(architecture);
    for (size_t i = 0; size < architecture.texture_size; ++i, size *= 2) {
      const std::string number = std::to_string(i);
      if (Has("decoder.view_add." + number)) {
        const Values added = Apply("decoder.view_add." + number, view, 1);
        for (size_t k = 0; k < texture.size(); ++k) texture[k] += added[k / (size * size)];
      }
      const bool last = 2 * size == architecture.texture_size;
      texture = Apply("decoder.texture_conv." + number, texture, size);
      if (!last) texture = Activate(texture);
      if (!Has("decoder.texture_res." + number)) continue;
      texture = Sum(Apply("decoder.texture_res." + number, texture, 2 * size), texture);
      if (!last) texture = Activate(texture);
    }
    return texture;
  }

 private:
  LayerInfo Find(const std::string& name) const {
    for (const LayerInfo& info : Layers(architecture)) {
      if (info.name == name) return info;
    }
    return {};
  }
};

}  // namespace likeness
