#include "likeness/train/people.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/capture/condition_file.h"
#include "likeness/capture/layout.h"
#include "likeness/train/dataset.h"
#include "likeness/train/frame_encoders.h"
#include "likeness/train/synthetic_capture.h"
#include "likeness/train/trainer.h"

namespace likeness {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class PeopleTest : public testing::Test {
 protected:
  PeopleTest() {
    SetQuiet(true);
    Write("anna", 0);
    Write("ben", 1);
    options_.capture = folder_ / "anna";
    options_.also = {(folder_ / "ben/").string()};
    options_.out = folder_ / "out";
    options_.minutes = 0;
    options_.iterations = 12;
    options_.batch = 12;
    options_.views = 3;
    options_.latent = 4;
    options_.learning_rate = 5e-3;
  }

  void Write(const std::string& name, int person, int grid = 4) const {
    SyntheticCapture capture;
    capture.person = person;
    capture.grid = grid;
    capture.Write(folder_ / name);
  }

  std::string TrainingError() const {
    return ErrorOf([&] { Train(options_, [] { return false; }); });
  }

  const ScratchFolder folder_;
  TrainOptions options_;
};

TEST_F(PeopleTest, AreCalledAsTheirFoldersAndShareATopology) {
  const People people(options_);
  EXPECT_THAT(people.names(), ElementsAre("anna", "ben"));
  EXPECT_EQ(people.names(), options_.PeopleNames());
  EXPECT_EQ(people.size(), 16);

  Write("other/anna", 1);
  options_.also = {(folder_ / "other/anna").string()};
  EXPECT_THAT(TrainingError(), AllOf(HasSubstr("other/anna"), HasSubstr("another capture called 'anna'")));
  Write("coarse", 1, 3);
  options_.also = {(folder_ / "coarse").string()};
  EXPECT_THAT(TrainingError(), AllOf(HasSubstr("coarse"), HasSubstr("9 vertices, not 16")));
  options_.also = {(folder_ / "nobody").string()};
  EXPECT_THAT(TrainingError(), HasSubstr("nobody"));
}

// Means are a person's own, deviations everybody's; frames, cameras and conditions follow one another.
TEST_F(PeopleTest, DataOfTwoAreStandardisedAboutTheirOwnMeans) {
  const People people(options_);
  const Dataset dataset(people.textures(), {.conditions = {"gaze"}, .cache_bytes = 1 << 20});
  EXPECT_EQ(dataset.frames().size(), 12u);
  EXPECT_EQ(dataset.cameras(), 6);
  EXPECT_EQ(dataset.samples().size(), 36u);
  EXPECT_EQ(dataset.IdentityOf(5), 0);
  EXPECT_EQ(dataset.IdentityOf(6), 1);
  const TextureStatistics one = people.textures()[0]->ReadStatistics(), two = people.textures()[1]->ReadStatistics();
  EXPECT_GT(two.vertex_variance, 1.5 * one.vertex_variance);
  const double deviation = std::sqrt((one.vertex_variance + two.vertex_variance) / 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(dataset.statistics(i).vertex_deviation, deviation, 1e-5);
    EXPECT_NEAR(dataset.statistics(i).texture_deviation, std::sqrt((one.variance + two.variance) / 2), 1e-4);
    EXPECT_EQ(dataset.statistics(i).texture_mean, (i == 0 ? one : two).mean);
  }

  const Batch batch = dataset.Read({dataset.samples_of_frame()[2][0], dataset.samples_of_frame()[9][1]}, 1);
  EXPECT_EQ(batch.identity[0].item<int64_t>(), 0);
  EXPECT_EQ(batch.identity[1].item<int64_t>(), 1);
  EXPECT_EQ(batch.camera[1].item<int64_t>(), 3 + 1);
  const TrackedFrame tracked = people.captures()[1]->ReadTracked(dataset.frames()[9]);
  EXPECT_NEAR(batch.vertices[1][14].item<float>(), (tracked.vertices_in_head(4, 2) - two.vertex_mean[14]) / deviation,
              1e-4);

  // Over twelve frames, the mean and the deviation of both values together are 0 and 1.
  double sum[2] = {}, squares = 0;
  const Batch all = dataset.ReadFrames(0, 12);
  for (int64_t f = 0; f < 12; ++f) {
    for (int v = 0; v < 2; ++v) {
      sum[v] += all.named[f][v].item<double>();
      squares += std::pow(all.named[f][v].item<double>(), 2);
    }
  }
  EXPECT_NEAR(sum[0], 0, 1e-4);
  EXPECT_NEAR(sum[1], 0, 1e-4);
  EXPECT_NEAR(squares / 24, 1, 1e-4);
  EXPECT_NEAR(dataset.ConditionsOf(9)[1], 3 * std::cos(6.0), 1e-5);
}

TEST_F(PeopleTest, AConditionMustBeThereForEverybodyAndEveryFrame) {
  options_.conditions = {"light"};
  EXPECT_THAT(TrainingError(), HasSubstr("anna/conditions/light.csv"));
  options_.conditions = {"gaze"};
  const std::filesystem::path file = CaptureLayout(folder_ / "ben").Condition("gaze");
  const std::string good = ReadFile(file);
  WriteFile(file, good.substr(0, good.find("a,000003")));
  EXPECT_THAT(TrainingError(), AllOf(HasSubstr("ben/conditions/gaze.csv"), HasSubstr("a 000003")));
  WriteFile(file, "segment,frame,x\na,000000,1\n");
  EXPECT_THAT(TrainingError(), AllOf(HasSubstr("ben/conditions/gaze.csv"), HasSubstr("1 values")));
  options_.conditions = {"../gaze"};
  EXPECT_THAT(TrainingError(), HasSubstr("--condition"));
}

// Mean distance of the vertices of a person's frames, drawn by codes of another's (or the same person's), from the
// truth of `truth`.
double VertexError(const AvatarModel& model, const People& people, int from, int shown, int truth) {
  const FrameEncoder encode = PerformedFrames(model, *people.textures()[from], from, shown);
  double sum = 0, count = 0;
  for (const FrameId& frame : people.captures()[from]->TrainingFrames()) {
    const EncodedFrame encoded = encode(frame, {});
    const DecodedFrame decoded = model.Decode(encoded.code, {0, 0, 1}, encoded.conditions);
    const Vertices expected = people.captures()[truth]->ReadTracked(frame).vertices_in_head;
    sum += (decoded.vertices_in_head - expected).rowwise().norm().mean();
    ++count;
  }
  return sum / count;
}

// Each decodes as itself, and as the other with the same code: people here give the same performance, so what the other
// looks like in a frame is known. Codes of different people need not agree on their own: that they nearly do is what
// the condition is for.
TEST_F(PeopleTest, TheSameCodeDecodesAsEachPerson) {
  options_.conditions = {"gaze"};
  options_.iterations = 300;
  for (const char* identity : {"one-hot", "learned"}) {
    options_.identity = identity;
    options_.out = folder_ / identity;
    const auto model = AvatarModel::Load(Train(options_, [] { return false; }).avatar);
    const Avatar& avatar = model->avatar();
    ASSERT_EQ(avatar.identities.size(), 2u);
    EXPECT_EQ(avatar.identities[1].name, "ben");
    ASSERT_EQ(avatar.codes.size(), 12u);
    EXPECT_EQ(avatar.codes[7].identity, 1);
    EXPECT_EQ(avatar.codes[7].frame, "000001");
    EXPECT_EQ(avatar.codes[7].conditions.size(), 2u);
    EXPECT_EQ(avatar.training.at("cameras.ben"), "c0 c1 c2");

    // The file's codes are what the model encodes.
    const People people(options_);
    const FrameId frame = {avatar.codes[7].segment, avatar.codes[7].frame};
    const EncodedFrame own =
        OwnFrames(*model, *people.textures()[1], 1)(frame, people.captures()[1]->ReadTracked(frame));
    EXPECT_EQ(own.conditions.values, avatar.codes[7].conditions);
    for (size_t i = 0; i < own.code.size(); ++i) EXPECT_NEAR(own.code[i], avatar.codes[7].mu[i], 1e-4);

    for (int from = 0; from < 2; ++from) {
      const double itself = VertexError(*model, people, from, from, from);
      const double other = VertexError(*model, people, from, 1 - from, 1 - from);
      const double unmoved = VertexError(*model, people, from, 1 - from, from);
      RecordProperty(fmt::format("{} {}", identity, from), fmt::format("{} {} {}", itself, other, unmoved));
      // The people at rest are some 15 mm apart; the expression moves vertices by 4 and 7 mm.
      EXPECT_LT(itself, 1) << identity;
      EXPECT_LT(other, 0.2 * unmoved) << identity << ": " << itself << ", " << other << ", " << unmoved;
      EXPECT_LT(other, 2.5) << identity;
    }
  }
}

TEST_F(PeopleTest, LearnedVectorsResumeBitForBit) {
  options_.identity = "learned";
  options_.identity_size = 3;
  const TrainResult result = Train(options_, [] { return false; });
  TrainOptions interrupted = options_;
  interrupted.out = folder_ / "interrupted";
  Train(interrupted, [left = 5]() mutable { return --left <= 0; });
  Train(interrupted, [] { return false; });
  const Avatar whole = LoadAvatar(result.avatar), pieces = LoadAvatar(interrupted.out / "avatar.safetensors");
  ASSERT_EQ(whole.weights.count("identity.vectors"), 1u);
  for (const auto& [name, tensor] : whole.weights) EXPECT_EQ(tensor.values, pieces.weights.at(name).values) << name;

  // Other people, or in another order, make another run.
  interrupted.capture = folder_ / "ben";
  interrupted.also = {(folder_ / "anna").string()};
  EXPECT_THAT(ErrorOf([&] { Train(interrupted, [] { return false; }); }), HasSubstr("people = anna ben there"));
}

// Without being told, the decoder knows people by their means alone.
TEST_F(PeopleTest, IdentityNoneAndLinearModelsTrain) {
  options_.identity = "none";
  EXPECT_EQ(ConditionChannels(LoadAvatar(Train(options_, [] { return false; }).avatar).architecture), 0);
  options_.identity = "auto";
  for (const char* model : {"linear", "bilinear"}) {
    options_.model = model;
    options_.out = folder_ / model;
    EXPECT_EQ(ConditionChannels(LoadAvatar(Train(options_, [] { return false; }).avatar).architecture), 2) << model;
  }
}

}  // namespace
}  // namespace likeness
