// Published checkpoints of the Multiface project as our network.
//
// Their keys and shapes are those of an "enc", "dec" and "cc" module, all with the prefix "module." or none. What is
// converted: weights are folded (weight * gain / |weight|, one norm for the whole tensor); a transposed convolution's
// two biases become one; and rows are turned round, as their first row of texels is v = 0 and ours v = 1: kernels,
// biases for every texel, and the rows of the inner feature map in the two FC layers beside it.

#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "likeness/avatar/avatar.h"

namespace likeness {

struct MultifaceNetwork {
  Architecture architecture;
  std::map<std::string, Tensor> weights;  // by the registry's names
  int cameras = 0;                        // that have colours of their own in training; the network is the first one's
};

// Sizes and the options "non" (a bias for every channel alone), "res" (residual convolutions) and "bilinear" (repeated
// texels in place of transposed convolutions) show in the tensors' shapes.
//   path        for error messages only
//   checkpoint  as ReadTorchArchive gives it
// Throws Error, naming tensor and shape, for a checkpoint of another network, or one with missing or surplus tensors.
MultifaceNetwork ImportMultiface(const std::filesystem::path& path, const std::map<std::string, Tensor>& checkpoint);

}  // namespace likeness
