// That frames like those before them are drawn without allocating.

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "likeness/base/allocation_count.h"
#include "likeness/render/frame_renderer.h"
#include "likeness/render/rasterizer.h"
#include "likeness/simulate/procedural_head.h"

#ifdef LIKENESS_COUNTS_ALLOCATIONS

namespace likeness {
namespace {

TEST(FrameAllocations, NoneOnceWarm) {
  constexpr int kSide = 256;
  const auto head = MakeProceduralHead();
  const std::array<float, kExpressionCount> rest = {};
  const Vertices vertices = head->Pose(rest).tracked;
  for (const bool anti_alias : {false, true}) {
    FrameRendererOptions options;
    options.anti_alias = anti_alias;
    FrameRenderer renderer(head->tracked_topology(), 64, options);
    const std::vector<uint8_t> texture(4 * 64 * 64, 200);
    std::vector<uint8_t> pictures[2];
    for (auto& picture : pictures) picture.resize(4 * kSide * kSide);
    const auto draw = [&](double x) {
      FrameRenderer::View views[2];
      for (int eye = 0; eye < 2; ++eye) {
        const Camera camera = LookAt({x + 60 * eye, 0, 1000}, {0, 0, 0}, {0, 1, 0}, 900, kSide, kSide);
        views[eye] = {ProjectionOf(camera, {}), kSide, kSide, texture.data(), pictures[eye].data(), 4 * kSide};
      }
      renderer.Draw({vertices.data(), static_cast<size_t>(vertices.size())}, views);
    };
    draw(0);
    const int64_t before = AllocationCount();
    ASSERT_GT(before, 0);
    for (const double x : {0, 50, -300, 700}) draw(x);
    EXPECT_EQ(AllocationCount() - before, 0) << anti_alias;
    EXPECT_GT(pictures[0][4 * (kSide / 2 * kSide + kSide / 2)], 0);
  }
}

}  // namespace
}  // namespace likeness

#endif
