#include "likeness/train/trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/base/file.h"
#include "likeness/base/folder_lock.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/checkpoint.h"
#include "likeness/train/model.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const auto kNever = [] { return false; };

// Asks to stop after so many questions, one a step.
std::function<bool()> After(int steps) {
  return [left = steps]() mutable { return --left <= 0; };
}

std::filesystem::path Newest(const std::filesystem::path& out) { return Checkpoints(out, 1).Files().at(0); }

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

// The linear model's textures cannot follow the view, the bilinear one's can.
TEST_F(Training, LinearModelsLearnAndDecode) {
  options_.iterations = 400;
  options_.learning_rate = 5e-3;
  options_.loss.geometry = 1;  // the two differ in their textures alone
  double texture_loss[2] = {};
  for (const bool bilinear : {false, true}) {
    options_.model = bilinear ? "bilinear" : "linear";
    options_.out = folder_ / options_.model;
    const TrainResult result = Train(options_, kNever);
    texture_loss[bilinear ? 1 : 0] = result.loss_texture;
    EXPECT_LT(result.loss_geometry, 0.1) << options_.model;
    const auto model = AvatarModel::Load(result.avatar);
    const FrameCode& code = model->avatar().codes[1];
    const DecodedFrame front = model->Decode(code.mu, {0, 0, 1}), side = model->Decode(code.mu, {1, 0, 0});
    EXPECT_EQ(front.texture == side.texture, !bilinear);
    EXPECT_EQ(front.vertices_in_head, side.vertices_in_head);
  }
  EXPECT_LT(texture_loss[1], 0.5 * texture_loss[0]);
}

// Each camera's colours are part of the checkpoint, and move; the file has the network alone.
TEST_F(Training, CameraColoursResumeBitForBit) {
  options_.colours = true;
  options_.colour_rate = 2;
  const TrainResult result = Train(options_, kNever);
  TrainOptions interrupted = options_;
  interrupted.out = folder_ / "interrupted";
  Train(interrupted, After(5));
  Train(interrupted, kNever);
  const Avatar whole = LoadAvatar(result.avatar), pieces = LoadAvatar(interrupted.out / "avatar.safetensors");
  for (const auto& [name, tensor] : whole.weights) EXPECT_EQ(tensor.values, pieces.weights.at(name).values) << name;
  options_.colours = false;
  options_.out = folder_ / "plain";
  EXPECT_NE(Train(options_, kNever).loss_texture, result.loss_texture);
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
  const SafetensorsFile a(Newest(options_.out)), b(Newest(interrupted.out));
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

TEST_F(Training, ACacheFarSmallerThanTheDataGivesTheSameWeights) {
  const TrainResult all = Train(options_, kNever);
  const size_t everything = all.cache_bytes;
  EXPECT_EQ(all.textures_made, 6 * 3 + 6);
  const auto a = SafetensorsFile(Newest(options_.out));
  for (const bool in_file : {false, true}) {
    TrainOptions other = options_;
    other.out = folder_ / (in_file ? "in_file" : "small");
    other.cache_mb = 0.1 * static_cast<double>(everything) / (1 << 20);
    if (in_file) other.cache_dir = folder_ / "cache";
    other.workers = 3;
    const TrainResult result = Train(other, kNever);
    EXPECT_LE(result.cache_bytes, everything / 10);
    EXPECT_GT(result.cache_bytes, everything / 20);
    EXPECT_EQ(result.cache_file_bytes, in_file ? everything - result.cache_bytes : 0);
    if (in_file) {
      EXPECT_EQ(result.textures_made, all.textures_made);
      EXPECT_THAT(ListFolder(other.cache_dir), testing::IsEmpty());
    } else {
      EXPECT_GT(result.textures_made, 2 * all.textures_made);
    }
    const auto b = SafetensorsFile(Newest(other.out));
    EXPECT_EQ(a.names(), b.names());
    for (const std::string& name : a.names()) {
      const auto x = a.Bytes(name), y = b.Bytes(name);
      EXPECT_TRUE(std::equal(x.begin(), x.end(), y.begin(), y.end())) << name;
    }
  }
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

TEST_F(Training, TheLastFewCheckpointsStay) {
  options_.save_minutes = 0;
  options_.keep = 2;
  Train(options_, kNever);
  const std::vector<std::string> names = ListFolder(options_.out / "checkpoints");
  EXPECT_THAT(names, ElementsAre("000000011.safetensors", "000000012.safetensors"));

  // A run that starts afresh replaces them all, but only when it has one of its own.
  options_.resume = false;
  options_.save_minutes = 5;
  options_.size = 64;
  EXPECT_NE(ErrorOf([&] { Train(options_, kNever); }), "");
  EXPECT_EQ(ListFolder(options_.out / "checkpoints").size(), 2u);
  options_.size = 0;
  Train(options_, After(3));
  EXPECT_THAT(ListFolder(options_.out / "checkpoints"), ElementsAre("000000003.safetensors"));
}

TEST_F(Training, DamagedCheckpointsArePassedOver) {
  Train(options_, kNever);
  const std::vector<float> whole = LoadAvatar(options_.out / "avatar.safetensors").codes[0].mu;
  const auto damaged_run = [&](const std::string& name, const std::function<std::string(std::string)>& damage) {
    TrainOptions other = options_;
    other.out = folder_ / name;
    other.save_minutes = 0;
    Train(other, After(7));
    const std::filesystem::path newest = Newest(other.out);
    WriteFile(newest, damage(ReadFile(newest)));
    WriteFile(other.out / "checkpoints" / ".000000009.1.0.partial.safetensors", "half");
    EXPECT_TRUE(Train(other, kNever).finished);
    EXPECT_EQ(LoadAvatar(other.out / "avatar.safetensors").codes[0].mu, whole) << name;
    EXPECT_EQ(ListFolder(other.out / "checkpoints").size(), 3u);
  };
  damaged_run("cut", [](const std::string& good) { return good.substr(0, good.size() - 5); });
  damaged_run("empty", [](const std::string&) { return ""; });
  damaged_run("nan", [](std::string good) { return good.replace(good.size() - 4, 4, "\xff\xff\xff\xff"); });
  damaged_run("other", [&](const std::string&) { return ReadFile(options_.out / "avatar.safetensors"); });

  // Where none is whole, the run does not begin anew behind the user's back.
  for (const auto& path : Checkpoints(options_.out, 1).Files()) WriteFile(path, "");
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), AllOf(HasSubstr("no checkpoint"), HasSubstr("--no-resume")));
}

// Half a row in the log, as a killed process leaves it, is dropped.
TEST_F(Training, AHalfWrittenLogIsMended) {
  Train(options_, After(8));
  const std::string log = ReadFile(options_.out / "log.csv");
  WriteFile(options_.out / "log.csv", log + "8,0.1,0.2,0.3,0.4,0.5,0.6,0.7e-");
  EXPECT_TRUE(Train(options_, kNever).finished);
  EXPECT_THAT(ReadFile(options_.out / "log.csv"), AllOf(StartsWith(log), Not(HasSubstr("e-\n"))));
}

TEST_F(Training, AFullDiskLosesNothingFinished) {
  options_.save_minutes = 0;
  Train(options_, After(6));
  const std::vector<std::string> before = ListFolder(options_.out / "checkpoints");
  // Files cannot grow beyond a limit, which stands in for the disk's end.
  rlimit unlimited;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &unlimited), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit full = unlimited;
  full.rlim_cur = std::filesystem::file_size(Newest(options_.out)) / 2;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const std::string error = ErrorOf([&] { Train(options_, kNever); });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &unlimited), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(error, AllOf(HasSubstr("000000007.safetensors"), HasSubstr("File too large")));
  EXPECT_EQ(ListFolder(options_.out / "checkpoints"), before);
  EXPECT_TRUE(Train(options_, kNever).finished);
}

TEST_F(Training, TwoRunsDoNotShareAFolder) {
  const FolderLock lock(options_.out);
  EXPECT_THAT(ErrorOf([&] { Train(options_, kNever); }), HasSubstr("another process"));
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
  other.geometry = "billboard";
  EXPECT_THAT(ErrorOf([&] { Train(other, kNever); }), HasSubstr("likeness proxy"));
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
