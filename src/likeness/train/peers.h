// Processes that train one avatar together: each takes its own part of every step's textures, and all take the same
// step with the mean of their gradients.

#pragma once

#include <torch/types.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "likeness/base/launcher.h"

namespace likeness {

// The connections between them, by LibTorch's c10d: Gloo between processors, NCCL between GPUs. Their traffic is
// neither encrypted nor authenticated, as with PyTorch: use a network that you trust. Every process makes the same
// calls in the same order. A call throws Error when another process has ended, and at the latest after the timeout.
class Peers {
 public:
  // One process alone: every call returns at once.
  Peers();
  // Waits for all others.
  Peers(const Launcher& launcher, torch::Device device, double timeout_s);
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  int rank() const { return rank_; }
  int count() const { return count_; }
  bool IsFirst() const { return rank_ == 0; }

  // Copies the first process's values to all.
  void Broadcast(const std::vector<torch::Tensor>& tensors) const;

  // Begins to replace a tensor on the device by the sum over all processes. It is done when the returned function has
  // been called.
  std::function<void()> BeginSum(const torch::Tensor& tensor) const;

  // Replaces every value by the sum over all.
  void Sum(std::span<double> values) const;

 private:
  struct Group;
  int rank_ = 0;
  int count_ = 1;
  torch::Device device_ = torch::kCPU;
  std::unique_ptr<Group> group_;
};

}  // namespace likeness
