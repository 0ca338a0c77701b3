// The compiler's vector types, and dense layers, for the kernels; included once by each, which defines
// LIKENESS_VECTOR_BYTES, and LIKENESS_HALF where biases and dense weights are in half precision (F16C).

#pragma once

#include "likeness/decode/kernel.h"
#ifdef LIKENESS_HALF
#include "likeness/decode/half_impl.h"
#else
namespace likeness {
namespace {
using Half = float;
inline float FromHalf(Half value) { return value; }
}  // namespace
}  // namespace likeness
#endif

namespace likeness {
namespace {

constexpr int kLanes = LIKENESS_VECTOR_BYTES / 4;
typedef float Vector __attribute__((vector_size(LIKENESS_VECTOR_BYTES), aligned(4), may_alias));
typedef int32_t IntVector __attribute__((vector_size(LIKENESS_VECTOR_BYTES), aligned(4), may_alias));

inline Vector Load(const float* from) { return *reinterpret_cast<const Vector*>(from); }
inline void Store(float* to, Vector v) { *reinterpret_cast<Vector*>(to) = v; }
inline Vector Max(Vector a, Vector b) { return a > b ? a : b; }

inline Vector LoadHalf(const Half* from);

template <int kCount>
inline void DenseVectors(const DenseJob& job, int block, int vector) {
  constexpr int kParts = kDenseBlock / kLanes;
  constexpr int kChains = kCount * kParts >= 8 ? 1 : 8 / (kCount * kParts);  // sums that do not wait for each other
  Vector sums[kChains][kCount][kParts] = {};
  const Half* weights = static_cast<const Half*>(job.weights) + static_cast<int64_t>(block) * job.in * kDenseBlock;
  const float* const x = job.x + vector * job.x_pitch;
  int i = 0;
  for (; i + kChains <= job.in; i += kChains) {
#pragma GCC unroll 8
    for (int c = 0; c < kChains; ++c, weights += kDenseBlock) {
#pragma GCC unroll 4
      for (int p = 0; p < kParts; ++p) {
        const Vector w = LoadHalf(weights + p * kLanes);
#pragma GCC unroll 4
        for (int v = 0; v < kCount; ++v) sums[c][v][p] += x[v * job.x_pitch + i + c] * w;
      }
    }
  }
  for (; i < job.in; ++i, weights += kDenseBlock) {
    for (int p = 0; p < kParts; ++p) {
      const Vector w = LoadHalf(weights + p * kLanes);
      for (int v = 0; v < kCount; ++v) sums[0][v][p] += x[v * job.x_pitch + i] * w;
    }
  }
  for (int v = 0; v < kCount; ++v) {
    for (int p = 0; p < kParts; ++p) {
      Vector y = sums[0][v][p];
      for (int c = 1; c < kChains; ++c) y += sums[c][v][p];
      const int o = block * kDenseBlock + p * kLanes;
      if (job.init != nullptr) y += Load(job.init + o);
      Store(job.y + (vector + v) * job.y_pitch + o - job.first * kDenseBlock, Max(y, job.slope * y));
    }
  }
}

void Dense(const DenseJob& job) {
  for (int block = job.first; block < job.last; ++block) {
    int vector = 0;
    for (; vector + 4 <= job.vectors; vector += 4) DenseVectors<4>(job, block, vector);
    for (; vector < job.vectors; ++vector) DenseVectors<1>(job, block, vector);
  }
}

}  // namespace
}  // namespace likeness
