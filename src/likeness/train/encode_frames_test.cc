#include "likeness/train/encode_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/avatar/avatar_id.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"
#include "likeness/train/trainer.h"

namespace likeness {
namespace {

// The trainer's own codes of its training frames are what encoding the capture gives; held-out frames are new.
TEST(EncodeFramesTest, GivesTheTrainersCodes) {
  SetQuiet(true);
  const ScratchFolder folder;
  SyntheticCapture synthetic;
  synthetic.Write(folder / "capture");
  TrainOptions options;
  options.capture = folder / "capture";
  options.out = folder / "out";
  options.minutes = 0;
  options.iterations = 4;
  options.batch = 6;
  options.views = 3;
  options.latent = 4;
  options.conditions = {"gaze"};
  const TrainResult trained = Train(options, [] { return false; });
  const auto model = AvatarModel::Load(trained.avatar);
  const Avatar& avatar = model->avatar();
  const auto capture = OpenCapture(folder / "capture");
  const TextureSet textures(*capture, avatar.architecture.texture_size);

  const Performance performance = EncodeFrames(*model, textures, capture->frames(), 0, 30);
  ASSERT_EQ(performance.frame_count(), 8);
  EXPECT_EQ(performance.avatar, AvatarId(avatar));
  EXPECT_EQ(performance.conditions, avatar.architecture.conditions);
  ASSERT_EQ(avatar.codes.size(), 6);
  for (int i = 0; i < 6; ++i) {
    const FrameCode& code = avatar.codes[i];
    EXPECT_EQ(performance.frame_names[i], code.segment + "/" + code.frame);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(performance.Code(i)[k], code.mu[k], 1e-4) << i << " " << k;
    EXPECT_THAT(performance.ConditionValues(i), testing::ElementsAreArray(code.conditions));
  }
  EXPECT_EQ(performance.frame_names[6].substr(0, 5), "held/");
  for (int i = 0; i < 8; ++i) {
    const RigidTransform pose = capture->ReadTracked(capture->frames()[i]).world_from_head;
    EXPECT_EQ(performance.world_from_head[i].rotation, pose.rotation);
    EXPECT_EQ(performance.world_from_head[i].translation, pose.translation);
    EXPECT_NEAR(performance.seconds[i], i / 30.0, 1e-12);
  }
}

}  // namespace
}  // namespace likeness
