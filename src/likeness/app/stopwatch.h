// Times the steps that benchmarks measure.

#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>
#include <initializer_list>
#include <vector>

namespace likeness {

// Medians over runs of one step: by the clock, and of the processor's time alone, which other programs disturb less.
class Stopwatch {
 public:
  template <typename Call>
  void Measure(const Call& call) {
    const auto wall = std::chrono::steady_clock::now();
    const double cpu = ThreadMilliseconds();
    call();
    cpu_.push_back(ThreadMilliseconds() - cpu);
    wall_.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall).count());
  }

  // The sum of three steps, run by run.
  Stopwatch(std::initializer_list<const Stopwatch*> steps) {
    for (const Stopwatch* step : steps) {
      wall_.resize(step->wall_.size());
      cpu_.resize(step->cpu_.size());
      for (size_t i = 0; i < wall_.size(); ++i) wall_[i] += step->wall_[i], cpu_[i] += step->cpu_[i];
    }
  }
  Stopwatch() = default;

  // Without the first run where there are several: it warms up.
  double wall_ms() const { return Median(wall_); }
  double cpu_ms() const { return Median(cpu_); }
  double last_cpu_ms() const { return cpu_.back(); }

 private:
  static double ThreadMilliseconds() {
    timespec time = {};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
  }
  static double Median(std::vector<double> values) {
    if (values.size() > 1) values.erase(values.begin());
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }

  std::vector<double> wall_, cpu_;
};

}  // namespace likeness
