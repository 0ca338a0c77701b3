// Plain C++, for any processor; everything in float32: what the other kernels are measured by.

#include <stdint.h>

#define LIKENESS_VECTOR_BYTES 16
#define LIKENESS_TILE_ROWS 6
#include "likeness/decode/float_kernel_impl.h"
#include "likeness/decode/half_float_impl.h"

namespace likeness {
namespace {

inline Vector LoadHalf(const Half* from) { return Load(from); }

inline void AddEight(const float* sums, const Half* bias, float* to) {
  for (int i = 0; i < 8; ++i) to[i] = sums[i] + bias[i];
}

bool PackColours(const float* values, int count, void* packed) {
  for (int i = 0; i < count; ++i) static_cast<Half*>(packed)[i] = values[i];
  return true;
}

bool PackBias(const PackedConvolution&, const float* values, int count, void* packed) {
  return PackColours(values, count, packed);
}

bool PackDense(const float* values, int64_t count, void* packed) {
  for (int64_t i = 0; i < count; ++i) static_cast<Half*>(packed)[i] = values[i];
  return true;
}

void Convert(const float* values, int count, PixelFormat format, void* pixels) {
  if (format == PixelFormat::kRgba8) {
    uint8_t* const to = static_cast<uint8_t*>(pixels);
    for (int i = 0; i < 4 * count; ++i) {
      const float v = !(values[i] > 0) ? 0 : values[i] > 255 ? 255 : values[i];
      to[i] = static_cast<uint8_t>(v + 0.5f);
    }
    return;
  }
  uint16_t* const to = static_cast<uint16_t*>(pixels);
  for (int i = 0; i < 4 * count; ++i) to[i] = HalfFloat(values[i] * (1 / 255.0f));
}

bool Available() { return true; }
#if defined(__SSE2__)
// Numbers too small to be normal count as zero: they would cost a hundred times the time.
unsigned Enter() {
  const unsigned mode = __builtin_ia32_stmxcsr();
  __builtin_ia32_ldmxcsr(mode | 0x8040);
  return mode;
}
void Leave(unsigned mode) { __builtin_ia32_ldmxcsr(mode); }
#else
unsigned Enter() { return 0; }
void Leave(unsigned) {}
#endif

}  // namespace

extern const Kernel kKernel_portable;
const Kernel kKernel_portable = {
    .name = "portable",
    .full_precision = true,
    .fixed_point = false,
    .element_bytes = 4,
    .bias_bytes = 4,
    .dense_bytes = 4,
    .available = Available,
    .enter = Enter,
    .leave = Leave,
    .weight_bytes = WeightBytes,
    .pack_weights = PackWeights,
    .pack_bias = PackBias,
    .pixel_bias_bytes = PixelBiasBytes,
    .pack_pixel_bias = PackPixelBias,
    .pack_dense = PackDense,
    .store = StoreFeatures,
    .rows = Rows,
    .pixels = Pixels,
    .block = Block,
    .finish = Finish,
    .dense = Dense,
    .convert = Convert,
};

}  // namespace likeness
