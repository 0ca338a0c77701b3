#include "likeness/train/gradient_exchange.h"

#include <torch/csrc/autograd/function.h>
#include <torch/csrc/autograd/utils/lambda_post_hook.h>
#include <torch/csrc/autograd/variable.h>

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {

// Tells when a parameter's gradient is complete, for as long as it exists.
struct GradientExchange::Hook {
  c10::intrusive_ptr<torch::autograd::Node> accumulator;
  uintptr_t key = 0;
};

GradientExchange::GradientExchange(const Peers& peers, const std::vector<Parameter>& parameters, int64_t bucket_bytes)
    : peers_(peers) {
  if (peers.count() == 1) return;
  std::vector<std::vector<torch::Tensor>> groups;
  int64_t bytes = bucket_bytes;
  for (auto it = parameters.rbegin(); it != parameters.rend(); ++it) {
    if (bytes >= bucket_bytes) {
      groups.emplace_back();
      bytes = 0;
    }
    groups.back().push_back(it->value);
    bytes += static_cast<int64_t>(it->value.nbytes());
  }
  for (const std::vector<torch::Tensor>& group : groups) {
    int64_t count = 0;
    for (const torch::Tensor& value : group) count += value.numel();
    Bucket bucket;
    bucket.gradients = torch::zeros({count}, group.front().options().requires_grad(false));
    bucket.missing = group.size();
    int64_t begin = 0;
    for (const torch::Tensor& value : group) {
      LIKENESS_CHECK(value.requires_grad() && value.is_non_overlapping_and_dense());
      const size_t index = buckets_.size(), member = bucket.members.size();
      bucket.members.push_back({value, bucket.gradients.as_strided(value.sizes(), value.strides(), begin), false});
      begin += value.numel();
      const auto accumulator = torch::autograd::impl::grad_accumulator(value);
      const uintptr_t key = accumulator->add_post_hook(std::make_unique<torch::autograd::utils::LambdaPostHook>(
          [this, index, member](const torch::autograd::variable_list& outputs, const torch::autograd::variable_list&) {
            Arrive(index, member);
            return outputs;
          }));
      hooks_.push_back(Hook{accumulator, key});
    }
    buckets_.push_back(std::move(bucket));
  }
}

GradientExchange::~GradientExchange() {
  for (const Hook& hook : hooks_) hook.accumulator->del_post_hook(hook.key);
}

void GradientExchange::Arrive(size_t bucket, size_t member) {
  const torch::NoGradGuard no_grad;
  Member& arrived = buckets_[bucket].members[member];
  arrived.mean.copy_(arrived.parameter.grad());
  arrived.arrived = true;
  --buckets_[bucket].missing;
  while (begun_ < buckets_.size() && buckets_[begun_].missing == 0) Begin(buckets_[begun_++]);
}

void GradientExchange::Begin(Bucket& bucket) const {
  // Parameters that the loss does not use never come.
  for (Member& member : bucket.members) {
    if (!member.arrived) member.mean.zero_();
  }
  bucket.wait = peers_.BeginSum(bucket.gradients);
}

void GradientExchange::Finish() {
  const torch::NoGradGuard no_grad;
  while (begun_ < buckets_.size()) Begin(buckets_[begun_++]);
  for (Bucket& bucket : buckets_) {
    bucket.wait();
    bucket.gradients /= peers_.count();
    bucket.missing = bucket.members.size();
    for (Member& member : bucket.members) {
      member.parameter.mutable_grad() = member.mean;
      member.arrived = false;
    }
  }
  begun_ = 0;
}

}  // namespace likeness
