#include "likeness/train/loader.h"

#include <chrono>

#include "likeness/base/random.h"

namespace likeness {

Loader::Loader(const Dataset& dataset, SampleOrder order, int batch, int views, int64_t first, int64_t stride,
               int workers)
    : dataset_(dataset),
      order_(std::move(order)),
      batch_(batch),
      views_(views),
      first_(first),
      stride_(stride),
      ahead_(workers + 1) {
  for (int i = 0; i < workers; ++i) workers_.emplace_back([this] { Work(); });
}

Loader::~Loader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void Loader::Work() {
  try {
    while (true) {
      int64_t mine = 0;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return stop_ || claimed_ < taken_ + ahead_; });
        if (stop_) return;
        mine = claimed_++;
      }
      const int64_t number = first_ + mine * stride_;
      Dataset::Fetched batch =
          dataset_.Fetch(order_.Samples(number, batch_), views_, Hash({order_.seed(), static_cast<uint64_t>(number)}));
      {
        const std::lock_guard lock(mutex_);
        ready_.emplace(mine, std::move(batch));
      }
      changed_.notify_all();
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    error_ = std::current_exception();
    changed_.notify_all();
  }
}

Batch Loader::Next() {
  const auto begin = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return error_ || ready_.count(taken_) != 0; });
  waited_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (error_) std::rethrow_exception(error_);
  const Dataset::Fetched fetched = std::move(ready_.extract(taken_++).mapped());
  lock.unlock();
  changed_.notify_all();
  return dataset_.Standardise(fetched);
}

}  // namespace likeness
