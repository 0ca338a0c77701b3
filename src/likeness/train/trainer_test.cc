#include "likeness/train/trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/model.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

using testing::HasSubstr;

const auto kNever = [] { return false; };

// Asks to stop after so many questions, one a step.
std::function<bool()> After(int steps) {
  return [left = steps]() mutable { return --left <= 0; };
}

class Training : public testing::Test {
 protected:
  Training() {
    SetQuiet(true);
    SyntheticCapture().Write(folder_ / "capture");
    options_.capture = folder_ / "capture";
    options_.out = folder_ / "out";
    options_.iterations = 12;
    options_.minutes = 0;
    options_.batch = 6;
    options_.views = 3;
    options_.latent = 8;
    options_.log_every = 4;
  }

  const ScratchFolder folder_;
  TrainOptions options_;
};

// 240 steps on six frames: the loss falls to a small part of the data's variance (1 a term), and the avatar draws the
// training views and a camera that it never saw.
TEST_F(Training, OverfitsATinyCapture) {
  options_.iterations = 240;
  options_.learning_rate = 5e-3;
  const TrainResult result = Train(options_, kNever);
  EXPECT_TRUE(result.finished);
  EXPECT_EQ(result.iterations, 240);
  EXPECT_EQ(result.samples, 240 * 6);
  EXPECT_EQ(result.skipped, 0);
  EXPECT_LT(result.loss_texture, 0.05);
  EXPECT_LT(result.loss_geometry, 0.05);
  EXPECT_GT(result.loss_kl, 0);

  const auto model = AvatarModel::Load(result.avatar);
  EXPECT_EQ(model->avatar().codes.size(), 6);
  const auto capture = OpenCapture(options_.capture);
  const TextureSet textures(*capture, 16);
  for (const Camera& camera : capture->cameras()) {
    double squares = 0, count = 0;
    for (const FrameId& frame : capture->TrainingFrames()) {
      const TrackedFrame tracked = capture->ReadTracked(frame);
      const std::vector<float> mu = model->Encode(textures.ReadAverage(frame), tracked.vertices_in_head);
      const DecodedFrame decoded = model->Decode(mu, ViewVector(camera, tracked.world_from_head));
      const ImageU8 truth = textures.ReadTexture(frame, camera.name), mask = textures.ReadMask(frame, camera.name);
      for (size_t i = 0; i < truth.values().size(); ++i) {
        if (mask.values()[i / 3] == 0) continue;
        squares += std::pow(decoded.texture.values()[i] - truth.values()[i], 2);
        ++count;
      }
      EXPECT_LT((decoded.vertices_in_head - tracked.vertices_in_head).rowwise().norm().maxCoeff(), 3) << frame.frame;
    }
    // The textures' deviation from their mean is about 20; the held-out camera stands outside of the others.
    EXPECT_LT(std::sqrt(squares / count), capture->split().IsHeldOutCamera(camera.name) ? 12 : 5) << camera.name;
  }
}

TEST_F(Training, CodesInTheFileAreTheModelsOwn) {
  const TrainResult result = Train(options_, kNever);
  const auto model = AvatarModel::Load(result.avatar);
  const auto capture = OpenCapture(options_.capture);
  const TextureSet textures(*capture, 16);
  const FrameCode& code = model->avatar().codes[2];
  EXPECT_EQ(code.segment, "a");
  EXPECT_EQ(code.frame, "000002");
  const FrameId frame{code.segment, code.frame};
  const std::vector<float> mu =
      model->Encode(textures.ReadAverage(frame), capture->ReadTracked(frame).vertices_in_head);
  for (size_t i = 0; i < mu.size(); ++i) EXPECT_NEAR(mu[i], code.mu[i], 1e-5);
}

// Running statistics are part of the checkpoint, and follow the mean weights at the end.
TEST_F(Training, BatchNormalisationResumesAndIsFoldedIntoTheFile) {
  options_.normalisation = "batch";
  options_.conditioning = "fc8-all";
  options_.iterations = 120;
  options_.learning_rate = 5e-3;
  const TrainResult result = Train(options_, kNever);
  EXPECT_LT(result.loss_texture, 0.3);
  TrainOptions interrupted = options_;
  interrupted.out = folder_ / "interrupted";
  Train(interrupted, After(50));
  Train(interrupted, kNever);
  const Avatar whole = LoadAvatar(result.avatar), pieces = LoadAvatar(interrupted.out / "avatar.safetensors");
  for (const auto& [name, tensor] : whole.weights) EXPECT_EQ(tensor.values, pieces.weights.at(name).values) << name;

  // The file's network, which knows no statistics, predicts the training textures about as well as training's batches.
  const AvatarModel model(whole);
  const auto capture = OpenCapture(options_.capture);
  const TextureSet textures(*capture, 16);
  double squares = 0, count = 0;
  for (const FrameId& frame : capture->TrainingFrames()) {
    const TrackedFrame tracked = capture->ReadTracked(frame);
    const std::vector<float> mu = model.Encode(textures.ReadAverage(frame), tracked.vertices_in_head);
    for (const Camera& camera : capture->TrainingCameras()) {
      const DecodedFrame decoded = model.Decode(mu, ViewVector(camera, tracked.world_from_head));
      const ImageU8 truth = textures.ReadTexture(frame, camera.name), mask = textures.ReadMask(frame, camera.name);
      for (size_t i = 0; i < truth.values().size(); ++i) {
        if (mask.values()[i / 3] != 0) squares += std::pow(decoded.texture.values()[i] - truth.values()[i], 2);
        ++count;
      }
    }
  }
  EXPECT_LT(squares / count / whole.texture_variance, 1.5 * result.loss_texture + 0.02);
}

TEST_F(Training, ResumedEqualsUninterruptedBitForBit) {
  Train(options_, kNever);
  TrainOptions interrupted = options_;
  interrupted.out = folder_ / "interrupted";
  EXPECT_FALSE(Train(interrupted, After(5)).finished);
  EXPECT_FALSE(std::filesystem::exists(interrupted.out / "avatar.safetensors"));
  EXPECT_EQ(Train(interrupted, After(1)).iterations, 6);
  EXPECT_TRUE(Train(interrupted, kNever).finished);

  const Avatar whole = LoadAvatar(options_.out / "avatar.safetensors");
  const Avatar pieces = LoadAvatar(interrupted.out / "avatar.safetensors");
  for (const auto& [name, tensor] : whole.weights) EXPECT_EQ(tensor.values, pieces.weights.at(name).values) << name;
  const SafetensorsFile a(options_.out / "checkpoint.safetensors"), b(interrupted.out / "checkpoint.safetensors");
  for (const std::string& name : a.names()) {
    const auto x = a.Bytes(name), y = b.Bytes(name);
    EXPECT_TRUE(std::equal(x.begin(), x.end(), y.begin(), y.end())) << name;
  }
  // The log has each row once.
  const auto rows = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  EXPECT_EQ(rows(ReadFile(options_.out / "log.csv")), 1 + 3);
  EXPECT_EQ(rows(ReadFile(interrupted.out / "log.csv")), 1 + 3);
}

TEST_F(Training, SeedsAndThreadsOfTheLoaderDecideAsTheyShould) {
  Train(options_, kNever);
  const std::vector<float> first = LoadAvatar(options_.out / "avatar.safetensors").codes[0].mu;
  const auto codes = [&](uint64_t seed, int workers, int cache_mb) {
    TrainOptions other = options_;
    other.out = folder_ / fmt::format("{}-{}-{}", seed, workers, cache_mb);
    other.seed = seed;
    other.workers = workers;
    other.cache_mb = cache_mb;
    Train(other, kNever);
    return LoadAvatar(other.out / "avatar.safetensors").codes[0].mu;
  };
  EXPECT_EQ(codes(0, 3, 100), first);
  EXPECT_EQ(codes(0, 1, 0), first);
  EXPECT_NE(codes(1, 1, 100), first);
}

TEST_F(Training, ASecondRunOfAFinishedOneDoesNothing) {
  const TrainResult first = Train(options_, kNever);
  const auto written = std::filesystem::last_write_time(first.avatar);
  const TrainResult second = Train(options_, kNever);
  EXPECT_TRUE(second.finished);
  EXPECT_EQ(second.iterations, 12);
  EXPECT_NEAR(second.loss, first.loss, 1e-5 * first.loss);  // read back from log.csv, which has six digits
  EXPECT_EQ(std::filesystem::last_write_time(second.avatar), written);
}

TEST_F(Training, OtherOptionsDoNotContinueACheckpoint) {
  Train(options_, After(3), "of the run\n");
  TrainOptions other = options_;
  other.batch = 3;
  other.loss.kl = 0.5;
  const std::string error = ErrorOf([&] { Train(other, kNever, "refused\n"); });
  EXPECT_EQ(ReadFile(options_.out / "train.toml"), "of the run\n");
  EXPECT_THAT(error, HasSubstr("batch = 6 there, batch = 3 now"));
  EXPECT_THAT(error, HasSubstr("loss.kl"));
  EXPECT_THAT(error, HasSubstr("--no-resume"));
  other.resume = false;
  EXPECT_TRUE(Train(other, kNever).finished);
}

TEST_F(Training, DamagedCheckpointsAreRefused) {
  Train(options_, After(3));
  const std::filesystem::path path = options_.out / "checkpoint.safetensors";
  const std::string good = ReadFile(path);
  WriteFile(path, good.substr(0, good.size() - 5));
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("checkpoint.safetensors"));
  WriteFile(path, "");
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("too short"));
  std::string nan = good;
  nan.replace(nan.size() - 4, 4, "\xff\xff\xff\xff");
  WriteFile(path, nan);
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("not a finite"));
  std::filesystem::copy_file(options_.capture / "KRT", path, std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("checkpoint.safetensors"));
}

TEST_F(Training, ValuesThatAreNotFiniteEndTheRunInTheEnd) {
  options_.learning_rate = 1;
  options_.clip = 0;
  options_.loss.texture = 1e9;
  options_.loss.kl = 1e9;  // exp(log sigma) overflows soon
  options_.iterations = 2000;
  options_.schedule = "constant";
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("not finite in 50 steps"));
}

TEST_F(Training, SaysWhatIsMissing) {
  TrainOptions other = options_;
  other.size = 64;
  EXPECT_THAT(ErrorOf([&] { Train(other, kNever); }), HasSubstr("16"));
  other = options_;
  other.model = "bilinear";
  EXPECT_THAT(ErrorOf([&] { Train(other, kNever); }), HasSubstr("not available yet"));
  other = options_;
  other.device = "cuda:77";
  EXPECT_NE(ErrorOf([&] { Train(other, kNever); }), "");
  other = options_;
  other.capture = folder_ / "nothing";
  EXPECT_THAT(ErrorOf([&] { Train(other, kNever); }), HasSubstr("nothing"));
  std::filesystem::remove(CaptureLayout(options_.capture).Texture({"a", "000001"}, "average", 16));
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("average"));
}

TEST(TrainOptions, CheckNamesTheOption) {
  const auto error = [](auto change) {
    TrainOptions options;
    change(options);
    return ErrorOf([&] { options.Check(); });
  };
  EXPECT_EQ(error([](TrainOptions&) {}), "");
  EXPECT_THAT(error([](TrainOptions& o) { o.preset = "papper"; }), HasSubstr("demo, paper"));
  EXPECT_THAT(error([](TrainOptions& o) { o.schedule = "linear"; }), HasSubstr("--schedule"));
  EXPECT_THAT(error([](TrainOptions& o) { o.iterations = -1; }), HasSubstr("--iterations"));
  EXPECT_THAT(error([](TrainOptions& o) { o.minutes = 0; }), HasSubstr("never end"));
  EXPECT_THAT(error([](TrainOptions& o) { o.views = 5; }), HasSubstr("no multiple"));
  EXPECT_THAT(error([](TrainOptions& o) { o.batch = 0; }), HasSubstr("--batch"));
  EXPECT_THAT(error([](TrainOptions& o) { o.learning_rate = std::nan(""); }), HasSubstr("--learning-rate"));
  EXPECT_THAT(error([](TrainOptions& o) { o.loss.kl = -1; }), HasSubstr("--loss.kl"));
  EXPECT_THAT(error([](TrainOptions& o) { o.cache_mb = -1; }), HasSubstr("--cache-mb"));
}

}  // namespace
}  // namespace likeness
