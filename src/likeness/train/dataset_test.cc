#include "likeness/train/dataset.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

TEST(SampleOrder, AnEpochShowsEverySampleAndGroupsShareAFrame) {
  const std::vector<std::vector<int>> frames = {{0, 1, 2, 3, 4}, {5, 6, 7, 8}, {9}, {}};
  for (const int views : {1, 2, 4}) {
    const SampleOrder order(frames, views, 7);
    std::map<int, int> seen;
    const int batch = 2 * views;
    // Groups per epoch are 10, 6 and 4: whole batches of two groups.
    ASSERT_EQ(order.groups_per_epoch() % 2, 0);
    for (int64_t i = 0; i < order.groups_per_epoch() / 2; ++i) {
      const std::vector<int> samples = order.Samples(i, batch);
      ASSERT_EQ(samples.size(), static_cast<size_t>(batch));
      for (int k = 0; k < batch; ++k) {
        ++seen[samples[k]];
        const auto& mates = *std::find_if(frames.begin(), frames.end(), [&](const std::vector<int>& f) {
          return std::count(f.begin(), f.end(), samples[k - k % views]) > 0;
        });
        EXPECT_EQ(std::count(mates.begin(), mates.end(), samples[k]), 1);
      }
    }
    EXPECT_EQ(seen.size(), 10) << "views " << views;
    if (views == 1) {
      for (const auto& [sample, count] : seen) EXPECT_EQ(count, 1) << sample;
    }
  }
}

TEST(SampleOrder, IsAFunctionOfSeedAndIteration) {
  const std::vector<std::vector<int>> frames(20, {0, 1, 2});
  const SampleOrder a(frames, 1, 7), b(frames, 1, 7), c(frames, 1, 8);
  EXPECT_EQ(a.Samples(5, 4), b.Samples(5, 4));
  EXPECT_NE(a.Samples(0, 60), c.Samples(0, 60));
  EXPECT_NE(a.Samples(0, 60), a.Samples(1, 60)) << "the second epoch has an order of its own";
  // A batch over the seam of two epochs.
  std::vector<int> joined = a.Samples(0, 40);
  const std::vector<int> rest = a.Samples(1, 40);
  joined.insert(joined.end(), rest.begin(), rest.begin() + 20);
  EXPECT_EQ(joined, a.Samples(0, 60));
}

TEST(Dataset, BatchesHoldTheStandardisedFiles) {
  const ScratchFolder folder;
  SyntheticCapture().Write(folder / "capture");
  const auto capture = OpenCapture(folder / "capture");
  const TextureSet textures(*capture, 16);
  const Dataset dataset(textures, 1 << 20);
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
  EXPECT_THAT(ErrorOf([&] { Dataset(textures, 0); }), testing::HasSubstr("no textures to train on"));
}

}  // namespace
}  // namespace likeness
