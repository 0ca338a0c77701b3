// Batches, whose textures are read ahead on worker threads, handed out in order.

#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "likeness/train/dataset.h"
#include "likeness/train/sample_order.h"

namespace likeness {

class Loader {
 public:
  // Begins at once with batch `first` of the order, and goes on with every `stride`-th. `dataset` is borrowed.
  Loader(const Dataset& dataset, SampleOrder order, int batch, int views, int64_t first, int64_t stride, int workers);
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  // The next batch, standardised on the calling thread and LibTorch's; throws what a worker threw.
  Batch Next();

  // Seconds that Next() has waited for workers.
  double waited_s() const { return waited_s_; }

 private:
  void Work();

  const Dataset& dataset_;
  const SampleOrder order_;
  const int batch_;
  const int views_;
  const int64_t first_;
  const int64_t stride_;
  const int64_t ahead_;  // batches in memory at most
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<int64_t, Dataset::Fetched> ready_;
  int64_t taken_ = 0;    // the next batch to hand out, counted from first_
  int64_t claimed_ = 0;  // the next batch that a worker begins
  std::exception_ptr error_;
  bool stop_ = false;
  double waited_s_ = 0;
  std::vector<std::thread> workers_;
};

}  // namespace likeness
