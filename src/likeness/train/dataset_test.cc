#include "likeness/train/dataset.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

TEST(Dataset, BatchesHoldTheStandardisedFiles) {
  const ScratchFolder folder;
  SyntheticCapture().Write(folder / "capture");
  const auto capture = OpenCapture(folder / "capture");
  const TextureSet textures(*capture, 16);
  const Dataset dataset({&textures}, {.cache_bytes = 1 << 20});
  EXPECT_EQ(dataset.frames().size(), 6);  // the held-out segment and camera stay out
  EXPECT_EQ(dataset.samples().size(), 6 * 3);
  for (const Dataset::Sample& sample : dataset.samples()) EXPECT_NE(sample.camera, "c3");

  const std::vector<int> chosen = {dataset.samples_of_frame()[4][0], dataset.samples_of_frame()[4][2],
                                   dataset.samples_of_frame()[1][1], dataset.samples_of_frame()[1][2]};
  const Batch batch = dataset.Read(chosen, 2);
  const TextureStatistics statistics = textures.ReadStatistics();
  const double deviation = std::sqrt(statistics.variance);
  EXPECT_EQ(batch.average.size(0), 2);
  int unseen = 0;
  for (int n = 0; n < 4; ++n) {
    const Dataset::Sample& sample = dataset.samples()[chosen[n]];
    const FrameId& frame = dataset.frames()[sample.frame];
    const ImageU8 texture = textures.ReadTexture(frame, sample.camera), mask = textures.ReadMask(frame, sample.camera);
    const ImageU8 average = textures.ReadAverage(frame);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        const bool seen = mask.at(x, y)[0] != 0;
        unseen += seen ? 0 : 1;
        EXPECT_EQ(batch.seen[n][0][y][x].item<float>(), seen ? 1 : 0);
        for (int c = 0; c < 3; ++c) {
          const double mean = statistics.mean.at(x, y)[c];
          EXPECT_NEAR(batch.texture[n][c][y][x].item<float>(), seen ? (texture.at(x, y)[c] - mean) / deviation : 0,
                      1e-5);
          const double expected = average.at(x, y)[0] != 0 ? (average.at(x, y)[c] - mean) / deviation : 0;
          EXPECT_NEAR(batch.average[n / 2][c][y][x].item<float>(), expected, 1e-5);
        }
      }
    }
    const TrackedFrame tracked = capture->ReadTracked(frame);
    const Eigen::Vector3d view = ViewVector(capture->FindCamera(sample.camera), tracked.world_from_head);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(batch.view[n][k].item<float>(), view[k], 1e-6);
    EXPECT_NEAR(batch.vertices[n / 2][5].item<float>(),
                (tracked.vertices_in_head(1, 2) - statistics.vertex_mean[5]) / std::sqrt(statistics.vertex_variance),
                1e-4);
  }
  EXPECT_GT(unseen, 0);
}

TEST(Dataset, ACaptureWithoutTrainingTexturesIsAnError) {
  const ScratchFolder folder;
  SyntheticCapture synthetic;
  synthetic.Write(folder / "capture");
  for (int c = 0; c < 3; ++c) {
    std::filesystem::remove_all(folder / "capture" / "unwrapped_uv_16" / "a" / fmt::format("c{}", c));
  }
  const auto capture = OpenCapture(folder / "capture");
  const TextureSet textures(*capture, 16);
  EXPECT_THAT(ErrorOf([&] { Dataset({&textures}, {}); }), testing::HasSubstr("no textures to train on"));
}

}  // namespace
}  // namespace likeness
