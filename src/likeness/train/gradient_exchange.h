// The mean of all processes' gradients, exchanged while the backward pass still works on others.

#pragma once

#include <torch/types.h>

#include <functional>
#include <memory>
#include <vector>

#include "likeness/train/network.h"
#include "likeness/train/peers.h"

namespace likeness {

// Parameters are put into buckets of some megabytes from the last layer to the first, as the backward pass reaches
// them. When the last gradient of a bucket is there, its exchange begins. Buckets are exchanged in the same order
// everywhere. (Li et al. 2020, "PyTorch Distributed: Experiences on Accelerating Data Parallel Training", section 3.2.)
class GradientExchange {
 public:
  // Both are borrowed.
  //   parameters  require gradients, in the order of the forward pass
  GradientExchange(const Peers& peers, const std::vector<Parameter>& parameters, int64_t bucket_bytes = 8 << 20);
  ~GradientExchange();
  GradientExchange(const GradientExchange&) = delete;
  GradientExchange& operator=(const GradientExchange&) = delete;

  // Call after the backward pass: all gradients are the means then, as parts of the buckets' memory.
  void Finish();

  size_t bucket_count() const { return buckets_.size(); }

 private:
  struct Member {
    torch::Tensor parameter;
    torch::Tensor mean;  // its part of the bucket, laid out as the parameter
    bool arrived = false;
  };
  struct Bucket {
    torch::Tensor gradients;  // of all its parameters, one after the other
    std::vector<Member> members;
    size_t missing = 0;  // gradients that the backward pass still owes
    std::function<void()> wait;
  };
  struct Hook;
  void Arrive(size_t bucket, size_t member);
  void Begin(Bucket& bucket) const;

  const Peers& peers_;
  std::vector<Bucket> buckets_;
  std::vector<Hook> hooks_;
  size_t begun_ = 0;  // buckets whose exchange has begun
};

}  // namespace likeness
