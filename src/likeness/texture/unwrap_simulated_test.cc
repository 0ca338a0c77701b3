// Unwrapping against the truth of a simulated capture: a head whose scene is its tracked mesh, drawn unlit, so that
// every camera's texture must be the head's own.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "likeness/base/testing.h"
#include "likeness/capture/capture.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/simulate.h"
#include "likeness/texture/texture_set.h"
#include "likeness/texture/unwrap.h"
#include "likeness/texture/unwrap_capture.h"

namespace likeness {
namespace {

constexpr int kSize = 128;

// Least and greatest value of the albedo around the surface point of a texel.
struct Range {
  int low = 255, high = 0;
};

Range Around(const ImageU8& albedo, int texel_x, int texel_y, int channel, double reach_texels) {
  const double scale = static_cast<double>(albedo.width()) / kSize;
  const auto first = [&](int texel) {
    return std::max(0, static_cast<int>(std::floor((texel + 0.5 - reach_texels) * scale - 0.5)));
  };
  const auto last = [&](int texel) {
    return std::min(albedo.width() - 1, static_cast<int>(std::ceil((texel + 0.5 + reach_texels) * scale - 0.5)));
  };
  Range range;
  for (int y = first(texel_y); y <= last(texel_y); ++y) {
    for (int x = first(texel_x); x <= last(texel_x); ++x) {
      range.low = std::min<int>(range.low, albedo.at(x, y)[channel]);
      range.high = std::max<int>(range.high, albedo.at(x, y)[channel]);
    }
  }
  return range;
}

// A texel's colour is a mean of four pixels, each a mean of samples within half a pixel of its centre: a mean of albedo
// within 1.5 pixels in each direction of the image. At 60 degrees one pixel spans one texel here, so that is at most
// 1.5 x sqrt(2) texels. The value must lie between the least and the greatest albedo there, but for rounding (1 level
// when the image is stored, 1 when the texture is). Where a fold of the surface passes through those pixels, colour
// comes from elsewhere: a hundredth of the texels may fail.
TEST(UnwrapSimulatedTest, EveryCamerasTextureIsTheHeadsOwnWhereSeen) {
  const ScratchFolder scratch;
  SimulateOptions simulate;
  simulate.out = scratch / "capture";
  simulate.head = "plain";
  simulate.frames = 4;
  simulate.rig.cameras = 5;
  simulate.rig.held_out_cameras = 1;
  simulate.rig.width = 384;
  simulate.rig.height = 576;
  simulate.render.shading = Shading::kAlbedo;
  Simulate(simulate);
  const auto capture = OpenCapture(simulate.out);
  UnwrapOptions unwrap;
  unwrap.size = kSize;
  unwrap.grazing_deg = 60;
  UnwrapCapture(*capture, unwrap);

  const OpenedHead head = OpenHead("plain", "");
  const ImageU8& albedo = head.head->surfaces().at(0).material.albedo;
  const TextureSet textures(*capture, kSize);
  constexpr double kReachTexels = 1.5 * 1.4142;
  for (const FrameId& frame : capture->frames()) {
    for (const Camera& camera : capture->cameras()) {
      SCOPED_TRACE(frame.segment + " " + camera.name);
      const ImageU8 texture = textures.ReadTexture(frame, camera.name);
      const ImageU8 mask = textures.ReadMask(frame, camera.name);
      int seen = 0, wrong = 0, wrong_flipped = 0;
      for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
          if (*mask.at(x, y) == 0) continue;
          ++seen;
          const auto fits = [&](int truth_y) {
            for (int c = 0; c < 3; ++c) {
              const Range range = Around(albedo, x, truth_y, c, kReachTexels);
              const int value = texture.at(x, y)[c];
              if (value < range.low - 2 || value > range.high + 2) return false;
            }
            return true;
          };
          wrong += !fits(y);
          wrong_flipped += !fits(kSize - 1 - y);
        }
      }
      EXPECT_GT(seen, kSize * kSize / 6);
      EXPECT_LE(wrong, seen / 100) << "of " << seen << " seen texels";
      // The bound means something: with its rows flipped, the albedo does not fit.
      EXPECT_GT(wrong_flipped, 5 * (seen / 100)) << "of " << seen << " seen texels";
    }
  }
}

}  // namespace
}  // namespace likeness
