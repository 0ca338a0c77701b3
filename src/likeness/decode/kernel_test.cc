// Kernels by themselves, where whole networks do not reach.

#include "likeness/decode/kernel.h"

#include <gtest/gtest.h>

#include <vector>

#include "likeness/decode/kernels.h"
#include "likeness/decode/memory.h"

namespace likeness {
namespace {

constexpr int kChannels = 32, kCount = 5, kSize = 2 * kCount - 2;

// Red of every texel is 128 + sum of weight x feature, where features of the channels' first half have one value, those
// of the second half another; of the texels that read no margin.
uint8_t RedOf(const Kernel& kernel, float weight, float first, float second, float range) {
  PackedConvolution layer;
  layer.in_rows = layer.out_rows = 2;
  layer.channels = kChannels;
  layer.depth = 2 * kChannels;
  layer.columns = 16;
  layer.count = kCount;
  layer.colours = true;
  layer.in_range = range;
  Memory memory;
  std::vector<float> weights(static_cast<size_t>(2 * layer.depth) * layer.columns, 0.0f);
  for (size_t k = 0; k < static_cast<size_t>(2 * layer.depth); ++k) {
    for (size_t texel = 0; texel < 4; ++texel) weights[k * 16 + 4 * texel] = weight;
  }
  void* const packed = memory.Allocate(kernel.weight_bytes(layer));
  EXPECT_TRUE(kernel.pack_weights(weights.data(), layer, packed));
  layer.weights = packed;
  std::vector<float> row(static_cast<size_t>(2 * (kCount + kRowSlack)) * 4, 128.0f);
  const float* const rows[2] = {row.data(), row.data()};
  void* const bias = memory.Allocate(kernel.pixel_bias_bytes(layer) + 4096);
  EXPECT_TRUE(kernel.pack_pixel_bias(rows, layer, bias));

  const int texels = kCount + 1 + 2 * kRowSlack;
  std::byte* const features =
      static_cast<std::byte*>(memory.Allocate(static_cast<int64_t>(texels) * kChannels * kernel.element_bytes));
  for (int i = 0; i <= kCount; ++i) {
    std::vector<float> values(kChannels, first);
    std::fill(values.begin() + kChannels / 2, values.end(), second);
    kernel.store(values.data(), kChannels, range, features + i * kChannels * kernel.element_bytes);
  }
  std::vector<uint8_t> pixels[2] = {std::vector<uint8_t>(4 * kSize), std::vector<uint8_t>(4 * kSize)};
  PixelJob job{&layer, {features, features, nullptr}, bias, {pixels[0].data(), pixels[1].data()}, -1, kSize};
  const unsigned mode = kernel.enter();
  kernel.pixels(job, memory.Allocate(kScratchBytes));
  kernel.leave(mode);
  for (int i = 0; i < kSize; ++i) EXPECT_EQ(pixels[0][4 * i], pixels[1][4 * i]);
  return pixels[0][0];
}

// Weights and features as large as they get in every product, far beyond what colours can show.
TEST(Kernels, LargeSumsAreClampedAndDoNotWrapAround) {
  for (const Kernel* kernel : AvailableKernels()) {
    SCOPED_TRACE(kernel->name);
    for (const float weight : {0.01f, 1.0f, 100.0f}) {
      constexpr float kRange = 30;
      const float sum = 128 * weight * kRange;
      const auto shown = [](float colour) { return colour < 0 ? 0 : colour > 255 ? 255 : colour; };
      EXPECT_NEAR(RedOf(*kernel, weight, kRange, kRange, kRange), shown(128 + sum), 0.51);
      EXPECT_NEAR(RedOf(*kernel, weight, -kRange, -kRange, kRange), shown(128 - sum), 0.51);
      // The sum of the first half is taken away by the second.
      EXPECT_NEAR(RedOf(*kernel, weight, kRange, -kRange, kRange), 128, 0.51);
      EXPECT_NEAR(RedOf(*kernel, weight, -kRange, kRange, kRange), 128, 0.51);
    }
  }
}

TEST(Kernels, FixedPointFeaturesBeyondTheirRangeAreClampedToIt) {
  for (const Kernel* kernel : AvailableKernels()) {
    if (!kernel->fixed_point) continue;
    SCOPED_TRACE(kernel->name);
    EXPECT_NEAR(RedOf(*kernel, 0.01f, 50, 50, 30), 128 + 128 * 0.01 * 30, 0.51);
    EXPECT_NEAR(RedOf(*kernel, 0.01f, -50, 0, 30), 128 - 64 * 0.01 * 30, 0.51);
  }
}

}  // namespace
}  // namespace likeness
