// Random numbers that are the same on every machine and for every number of threads.

#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace likeness {

// PCG32 (O'Neill 2014). Streams of one seed are independent: give each frame, pixel row or head its own.
class Random {
 public:
  explicit Random(uint64_t seed, uint64_t stream = 0);

  uint32_t Next();
  double Uniform();                    // [0, 1)
  double Uniform(double a, double b);  // [a, b)
  int64_t Below(int64_t n);            // 0 ... n - 1
  double Normal();                     // mean 0, variance 1

 private:
  uint64_t state_;
  uint64_t increment_;
  double spare_ = 0;
  bool has_spare_ = false;
};

// A well-mixed 64-bit hash of numbers or of a name, to make seeds and streams from.
uint64_t Hash(std::initializer_list<uint64_t> values);
uint64_t Hash(std::string_view text);

}  // namespace likeness
