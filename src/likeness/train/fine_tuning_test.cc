#include "likeness/train/fine_tuning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/train/evaluate.h"
#include "likeness/train/frame_encoders.h"
#include "likeness/train/model.h"
#include "likeness/train/synthetic_capture.h"
#include "likeness/train/trainer.h"

namespace likeness {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const auto kNever = [] { return false; };

class FineTuning : public testing::Test {
 protected:
  FineTuning() {
    SetQuiet(true);
    synthetic_.picture = 32;
    synthetic_.Write(folder_ / "capture");
    options_.capture = folder_ / "capture";
    options_.iterations = 40;
    options_.minutes = 0;
    options_.batch = 6;
    options_.views = 3;
    options_.latent = 8;
    options_.learning_rate = 5e-3;
    options_.crop = 20;
  }

  std::filesystem::path TrainInto(const char* name) {
    options_.out = folder_ / name;
    return Train(options_, kNever).avatar;
  }
  // Of the camera's pictures of the training frames, 0 ... 255 units squared.
  double ImageError(const std::filesystem::path& avatar, EvaluationGroup group) const {
    const auto capture = OpenCapture(options_.capture);
    const TextureSet textures(*capture, 16);
    const auto model = AvatarModel::Load(avatar);
    EvaluationOptions options;
    options.supersample = 1;
    return Evaluate(*capture, OwnFrames(*model, textures, 0), *model, options).Of(group).error.Mean();
  }

  const ScratchFolder folder_;
  SyntheticCapture synthetic_;
  TrainOptions options_;
};

// Hardly a step: every normalisation gives the avatar back.
TEST_F(FineTuning, BeginsWithTheAvatar) {
  for (const char* normalisation : {"none", "weight", "weight-tensor"}) {
    SCOPED_TRACE(normalisation);
    options_.iterations = 3;
    options_.learning_rate = 5e-3;
    options_.from.clear();
    options_.normalisation = normalisation;
    options_.untied_bias = "decoder+channel";
    const std::filesystem::path first = TrainInto(normalisation);
    options_.from = first;
    options_.iterations = 1;
    options_.learning_rate = 1e-9;
    options_.seed = 77;
    const Avatar before = LoadAvatar(first), after = LoadAvatar(TrainInto("again"));
    for (const auto& [name, tensor] : before.weights) {
      const std::vector<float>& values = after.weights.at(name).values;
      for (size_t i = 0; i < values.size(); ++i) {
        ASSERT_NEAR(values[i], tensor.values[i], 1e-5 * (1 + std::abs(tensor.values[i]))) << name;
      }
    }
    std::filesystem::remove_all(folder_ / "again");
  }
}

// Meshes that were tracked 6 mm beside the face, 2 pixels: textures and meshes alone stay there, whatever the pictures
// show. The image loss moves the mesh, and a camera that it never saw gains as well.
TEST_F(FineTuning, TheImageLossMendsTrackedMeshes) {
  synthetic_.tracking_error_mm = 6;
  synthetic_.Write(folder_ / "capture");
  options_.iterations = 150;
  const std::filesystem::path first = TrainInto("first");
  options_.from = first;
  options_.loss.geometry = 0.01;
  const std::filesystem::path without = TrainInto("without");
  options_.loss.image = 1;
  const std::filesystem::path with = TrainInto("with");
  for (const EvaluationGroup group : {EvaluationGroup::kTraining, EvaluationGroup::kHeldOutCameras}) {
    EXPECT_LT(ImageError(with, group), 0.5 * ImageError(without, group)) << ToString(group);
  }
}

TEST_F(FineTuning, CropsResumeBitForBit) {
  options_.loss.image = 0.5;
  options_.iterations = 12;
  const Avatar whole = LoadAvatar(TrainInto("whole"));
  options_.out = folder_ / "pieces";
  int left = 5;
  EXPECT_FALSE(Train(options_, [&] { return --left <= 0; }).finished);
  const TrainResult result = Train(options_, kNever);
  EXPECT_GT(result.loss_image, 0);
  const Avatar pieces = LoadAvatar(result.avatar);
  for (const auto& [name, tensor] : whole.weights) EXPECT_EQ(tensor.values, pieces.weights.at(name).values) << name;
}

// Another capture is seen with the avatar's statistics, which its weights expect.
TEST_F(FineTuning, KeepsTheAvatarsStatistics) {
  options_.iterations = 2;
  options_.conditions = {"gaze"};
  options_.from = TrainInto("first");
  synthetic_.person = 1;
  synthetic_.Write(folder_ / "other");
  options_.capture = folder_ / "other";
  const Avatar before = LoadAvatar(options_.from), after = LoadAvatar(TrainInto("second"));
  EXPECT_EQ(after.identities[0].vertex_mean, before.identities[0].vertex_mean);
  EXPECT_EQ(after.identities[0].texture_mean, before.identities[0].texture_mean);
  EXPECT_EQ(after.texture_variance, before.texture_variance);
  EXPECT_EQ(after.condition_mean, before.condition_mean);
}

TEST_F(FineTuning, AnotherNetworkIsRefusedAndAdoptionMendsIt) {
  options_.iterations = 2;
  options_.conditioning = "raw-all";
  const std::filesystem::path first = TrainInto("first");
  TrainOptions other = options_;
  other.from = first;
  other.out = folder_ / "second";
  other.latent = 12;
  const auto error = [&] { return ErrorOf([&] { Train(other, kNever); }); };
  EXPECT_THAT(error(), AllOf(HasSubstr("first/avatar.safetensors"), HasSubstr("its latent is 8, here it is 12")));
  AdoptNetwork(LoadAvatar(first), &other);
  EXPECT_EQ(other.latent, 8);
  EXPECT_EQ(other.conditioning, "raw-all");
  EXPECT_TRUE(Train(other, kNever).finished);

  other.out = folder_ / "third";
  other.normalisation = "batch";
  EXPECT_THAT(error(), HasSubstr("--normalisation batch"));
  AdoptNetwork(LoadAvatar(first), &other);
  synthetic_.grid = 3;
  synthetic_.Write(folder_ / "coarse");
  other.capture = folder_ / "coarse";
  EXPECT_THAT(error(), HasSubstr("its vertex_count is 16, here it is 9"));
  other.from = folder_ / "nothing.safetensors";
  EXPECT_THAT(error(), HasSubstr("nothing.safetensors"));
}

}  // namespace
}  // namespace likeness
