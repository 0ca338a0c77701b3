// Which samples make a batch.

#pragma once

#include <cstdint>
#include <vector>

namespace likeness {

// The order in which training sees the samples: a function of seed and position alone, so that a run can be taken up
// anywhere. An epoch shuffles every frame's samples, cuts them into groups of `views` (the last one takes some again)
// and shuffles the groups.
class SampleOrder {
 public:
  SampleOrder(std::vector<std::vector<int>> samples_of_frame, int views, uint64_t seed);

  uint64_t seed() const { return seed_; }

  // The samples of batch `iteration`; `batch` is a multiple of views.
  std::vector<int> Samples(int64_t iteration, int batch) const;

  int64_t groups_per_epoch() const { return groups_per_epoch_; }

 private:
  std::vector<std::vector<int>> Epoch(int64_t epoch) const;

  std::vector<std::vector<int>> samples_of_frame_;
  int views_;
  uint64_t seed_;
  int64_t groups_per_epoch_ = 0;
};

}  // namespace likeness
