#include "likeness/train/sample_order.h"

#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/random.h"

namespace likeness {
namespace {

template <typename T>
void Shuffle(std::vector<T>& values, Random& random) {
  for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.Below(static_cast<int64_t>(i))]);
}

}  // namespace

SampleOrder::SampleOrder(std::vector<std::vector<int>> samples_of_frame, int views, uint64_t seed)
    : samples_of_frame_(std::move(samples_of_frame)), views_(views), seed_(seed) {
  for (const std::vector<int>& samples : samples_of_frame_) {
    groups_per_epoch_ += (static_cast<int64_t>(samples.size()) + views - 1) / views;
  }
  LIKENESS_CHECK(groups_per_epoch_ > 0);
}

std::vector<std::vector<int>> SampleOrder::Epoch(int64_t epoch) const {
  Random random(Hash({seed_, static_cast<uint64_t>(epoch)}));
  std::vector<std::vector<int>> groups;
  for (std::vector<int> samples : samples_of_frame_) {
    Shuffle(samples, random);
    for (size_t begin = 0; begin < samples.size(); begin += views_) {
      std::vector<int>& group = groups.emplace_back();
      for (int i = 0; i < views_; ++i) group.push_back(samples[(begin + i) % samples.size()]);
    }
  }
  Shuffle(groups, random);
  return groups;
}

std::vector<int> SampleOrder::Samples(int64_t iteration, int batch) const {
  const int64_t count = batch / views_;
  std::vector<int> samples;
  int64_t shuffled = -1;
  std::vector<std::vector<int>> groups;
  for (int64_t position = iteration * count; position < (iteration + 1) * count; ++position) {
    if (position / groups_per_epoch_ != shuffled) {
      shuffled = position / groups_per_epoch_;
      groups = Epoch(shuffled);
    }
    const std::vector<int>& group = groups[position % groups_per_epoch_];
    samples.insert(samples.end(), group.begin(), group.end());
  }
  return samples;
}

}  // namespace likeness
