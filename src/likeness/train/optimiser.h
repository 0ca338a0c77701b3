// Adam, with clipped gradients and a running mean of the weights.

#pragma once

#include <torch/types.h>

#include <string>
#include <vector>

#include "likeness/train/network.h"

namespace likeness {

class Optimiser {
 public:
  // `parameters` share memory with the network and take gradients from now on. `statistics`, which no gradient moves,
  // are part of the state alone.
  explicit Optimiser(std::vector<Parameter> parameters, std::vector<Parameter> statistics = {}, double beta2 = 0.999);

  // The norm of all gradients together.
  double GradientNorm() const;

  // One step of Adam (Kingma & Ba 2015; beta 0.9 and 0.999, epsilon 1e-8) with the parameters' gradients.
  //   clip  gradients whose norm `gradient_norm` is above are scaled down to it; 0 never
  void Step(double learning_rate, double gradient_norm, double clip);

  // Moves the mean weights towards the present ones: mean += (1 - decay) (weights - mean).
  void Average(double decay);
  // Exchanges the network's weights with the mean ones.
  void SwapAverage();

  void ZeroGradients();

  // All that a checkpoint needs besides what the network says: "weights/NAME", "adam_m/NAME", "adam_v/NAME",
  // "average/NAME", "adam_step" and "statistics/NAME"; they share memory with this.
  std::vector<Parameter> State() const;

 private:
  // Zeros where the loss did not depend on a weight.
  std::vector<torch::Tensor> Gradients() const;

  std::vector<std::string> names_;
  std::vector<torch::Tensor> weights_;
  std::vector<torch::Tensor> first_moments_;
  std::vector<torch::Tensor> second_moments_;
  std::vector<torch::Tensor> averages_;
  std::vector<torch::Tensor> steps_;  // one scalar, shared by all
  double beta2_;
  std::vector<Parameter> statistics_;
};

}  // namespace likeness
