#include "likeness/train/image_loss.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/testing.h"
#include "likeness/train/ops/gradient_check.h"
#include "likeness/train/people.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

// Two people, whose crops a batch mixes.
class ImageLossTest : public testing::Test {
 protected:
  ImageLossTest() {
    SyntheticCapture synthetic;
    synthetic.picture = 24;
    synthetic.grid = 6;
    synthetic.Write(folder_ / "anna");
    synthetic.person = 1;
    synthetic.Write(folder_ / "ben");
    TrainOptions options;
    options.capture = folder_ / "anna";
    options.also = {(folder_ / "ben").string()};
    people_.emplace(options);
    dataset_.emplace(people_->textures(), DatasetOptions{.images = true, .crop = 15, .cache_bytes = 1 << 20});
    samples_ = {dataset_->samples_of_frame()[3][0], dataset_->samples_of_frame()[3][2],
                dataset_->samples_of_frame()[8][1], dataset_->samples_of_frame()[8][0]};
    fetched_ = dataset_->Fetch(samples_, 2, 5);
    batch_ = dataset_->Standardise(fetched_);
    torch::manual_seed(3);
    decoding_ = {torch::randn({4, 3, 16, 16}, torch::kFloat64), 0.3 * torch::randn({4, 3 * 36}, torch::kFloat64)};
  }

  // In double precision, as finite differences want it.
  torch::Tensor Loss(const Network::Decoding& decoding) const {
    const ImageLoss loss(people_->topology(), dataset_->AllStatistics(), torch::kFloat64);
    Batch batch = batch_;
    batch.crops.colour = batch.crops.colour.to(torch::kFloat64);
    batch.crops.head = batch.crops.head.to(torch::kFloat64);
    return loss(batch, decoding);
  }

  const ScratchFolder folder_;
  std::optional<People> people_;
  std::optional<Dataset> dataset_;
  std::vector<int> samples_;
  Dataset::Fetched fetched_;
  Batch batch_;
  Network::Decoding decoding_;
};

// Pixel by pixel with the plain renderer, on the whole image.
TEST_F(ImageLossTest, IsTheErrorOfTheDrawnPictureOverHeadPixels) {
  double squares = 0;
  int64_t count = 0, uncovered = 0;
  for (int n = 0; n < 4; ++n) {
    const Dataset::Sample& sample = dataset_->samples()[samples_[n]];
    const int identity = dataset_->IdentityOf(sample.frame);
    EXPECT_EQ(identity, n / 2);
    const Capture& capture = *people_->captures()[identity];
    const FrameId& frame = dataset_->frames()[sample.frame];
    const Camera& camera = capture.FindCamera(sample.camera);
    const Statistics& own = dataset_->statistics(identity);
    const torch::Tensor texels = decoding_.texture[n].permute({1, 2, 0}).to(torch::kFloat32).contiguous();
    const torch::Tensor coordinates = decoding_.vertices[n].to(torch::kFloat32).contiguous();
    const ImageF texture = RestoreTexture(own, texels.const_data_ptr<float>());
    const Vertices vertices = RestoreVertices(own, coordinates.const_data_ptr<float>());
    const FragmentImage fragments =
        Rasterize(vertices, capture.topology().triangles, camera, capture.ReadTracked(frame).world_from_head);
    const ImageU8 truth = capture.ReadCameraImage(frame, camera), head = *capture.ReadHeadMask(frame, camera);
    const ImageCrop& crop = fetched_.crops[n];
    for (int y = crop.y0; y < crop.y0 + 15; ++y) {
      for (int x = crop.x0; x < crop.x0 + 15; ++x) {
        const Fragment& fragment = fragments.at(x, y);
        if (*head.at(x, y) == 0) continue;
        if (fragment.triangle < 0) {
          ++uncovered;
          continue;
        }
        const Eigen::Vector3i& corners = capture.topology().triangle_uvs[fragment.triangle];
        const std::vector<Eigen::Vector2f>& uvs = capture.topology().uvs;
        const Eigen::Vector3f colour =
            SampleTexture(texture, (1 - fragment.b1 - fragment.b2) * uvs[corners[0]] + fragment.b1 * uvs[corners[1]] +
                                       fragment.b2 * uvs[corners[2]]);
        for (int c = 0; c < 3; ++c) squares += std::pow(colour[c] - truth.at(x, y)[c], 2);
        count += 3;
      }
    }
  }
  EXPECT_GT(count, 1000);
  EXPECT_GT(uncovered, 0) << "the case is met";
  const double deviation = dataset_->statistics().texture_deviation;
  const double expected = squares / static_cast<double>(count) / (deviation * deviation);
  EXPECT_NEAR(Loss(decoding_).item<double>(), expected, 1e-4 * expected);
}

TEST_F(ImageLossTest, GradientsReachTextureAndVertices) {
  decoding_.texture.requires_grad_();
  decoding_.vertices.requires_grad_();
  CheckGradients(
      {decoding_.texture, decoding_.vertices}, [&] { return Loss(decoding_); }, /*every=*/5);
}

// Vertices of frames that share a code are drawn for each of the frame's cameras.
TEST_F(ImageLossTest, VerticesMayBeOfFrames) {
  const torch::Tensor of_frames = decoding_.vertices.slice(0, 0, 2);
  EXPECT_EQ(Loss({decoding_.texture, of_frames}).item<double>(),
            Loss({decoding_.texture, of_frames.repeat_interleave(2, 0)}).item<double>());
}

TEST_F(ImageLossTest, WithoutAHeadPixelIsZero) {
  batch_.crops.head = torch::zeros_like(batch_.crops.head);
  EXPECT_EQ(Loss(decoding_).item<double>(), 0);
}

TEST_F(ImageLossTest, ACaptureWithoutImagesIsAnError) {
  SyntheticCapture().Write(folder_ / "blind");
  const auto capture = OpenCapture(folder_ / "blind");
  const TextureSet textures(*capture, 16);
  EXPECT_THAT(ErrorOf([&] { Dataset({&textures}, {.images = true}); }),
              testing::AllOf(testing::HasSubstr("blind"), testing::HasSubstr("has no images")));
}

}  // namespace
}  // namespace likeness
