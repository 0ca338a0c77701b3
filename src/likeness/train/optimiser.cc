#include "likeness/train/optimiser.h"

#include <ATen/ops/_foreach_lerp.h>
#include <ATen/ops/_foreach_norm.h>
#include <ATen/ops/_fused_adam.h>

#include <cmath>

namespace likeness {

Optimiser::Optimiser(std::vector<Parameter> parameters, std::vector<Parameter> statistics, double beta2)
    : beta2_(beta2), statistics_(std::move(statistics)) {
  const torch::NoGradGuard no_grad;
  for (Parameter& parameter : parameters) {
    names_.push_back(parameter.name);
    weights_.push_back(parameter.value);
    first_moments_.push_back(torch::zeros_like(parameter.value));
    second_moments_.push_back(torch::zeros_like(parameter.value));
    averages_.push_back(parameter.value.clone());
    parameter.value.requires_grad_();
    parameter.value.mutable_grad() = torch::zeros_like(parameter.value);
  }
  steps_.assign(weights_.size(),
                torch::zeros({}, weights_.front().options().dtype(torch::kFloat32).requires_grad(false)));
}

std::vector<torch::Tensor> Optimiser::Gradients() const {
  std::vector<torch::Tensor> gradients;
  for (const torch::Tensor& weight : weights_) {
    gradients.push_back(weight.grad().defined() ? weight.grad() : torch::zeros_like(weight));
  }
  return gradients;
}

double Optimiser::GradientNorm() const {
  const torch::NoGradGuard no_grad;
  const std::vector<torch::Tensor> gradients = Gradients();
  return torch::stack(at::_foreach_norm(gradients)).norm().item<double>();
}

void Optimiser::Step(double learning_rate, double gradient_norm, double clip) {
  const torch::NoGradGuard no_grad;
  const std::vector<torch::Tensor> gradients = Gradients();
  // The fused kernel divides gradients by this on the way.
  std::optional<torch::Tensor> divisor;
  if (clip > 0 && gradient_norm > clip) {
    divisor = torch::full({}, gradient_norm / clip, steps_.front().options());
  }
  steps_.front() += 1;
  at::_fused_adam_(weights_, gradients, first_moments_, second_moments_, {}, steps_, learning_rate, /*beta1=*/0.9,
                   beta2_, /*weight_decay=*/0, /*eps=*/1e-8, /*amsgrad=*/false, /*maximize=*/false, divisor);
}

void Optimiser::Average(double decay) {
  const torch::NoGradGuard no_grad;
  at::_foreach_lerp_(averages_, weights_, 1 - decay);
}

void Optimiser::SwapAverage() {
  const torch::NoGradGuard no_grad;
  for (size_t i = 0; i < weights_.size(); ++i) {
    const torch::Tensor saved = weights_[i].clone();
    weights_[i].copy_(averages_[i]);
    averages_[i].copy_(saved);
  }
}

void Optimiser::ZeroGradients() {
  // Not zeroed: the backward pass then hands its own tensors over instead of adding to these.
  for (torch::Tensor& weight : weights_) weight.mutable_grad().reset();
}

std::vector<Parameter> Optimiser::State() const {
  std::vector<Parameter> state;
  for (size_t i = 0; i < names_.size(); ++i) {
    state.push_back({"weights/" + names_[i], weights_[i]});
    state.push_back({"adam_m/" + names_[i], first_moments_[i]});
    state.push_back({"adam_v/" + names_[i], second_moments_[i]});
    state.push_back({"average/" + names_[i], averages_[i]});
  }
  state.push_back({"adam_step", steps_.front()});
  for (const Parameter& statistic : statistics_) state.push_back({"statistics/" + statistic.name, statistic.value});
  return state;
}

}  // namespace likeness
