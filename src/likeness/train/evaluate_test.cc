#include "likeness/train/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"
#include "likeness/render/rasterizer.h"
#include "likeness/train/comparison.h"
#include "likeness/train/evaluation_part_file.h"
#include "likeness/train/evaluation_parts.h"
#include "likeness/train/evaluation_video.h"
#include "likeness/train/multiface_protocol.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

// A ball of 90 mm with a patterned texture, one vertex that no triangle uses, four frames in two segments, three
// cameras. Its images are drawn from the truth, so a decoder that tells the truth must get no error at all.
class EvaluateTest : public ::testing::Test {
 protected:
  EvaluateTest() : writer_(scratch_ / "capture") {
    MakeBall();
    for (int i = 0; i < 3; ++i) {
      cameras_.push_back(LookAt({500.0 * (i - 1), 100, 900}, {0, 0, 0}, {0, 1, 0}, 300, 70, 80));
      cameras_.back().name = kCameraNames[i];
    }
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    writer_.WriteSplit({{"a", "b"}, {"new"}, {"talk"}});
    writer_.WriteObj(frames_[0], vertices_, topology_);
    for (size_t f = 0; f < frames_.size(); ++f) {
      const TrackedFrame tracked = Tracked(f);
      writer_.WriteTracked(frames_[f], tracked);
      for (const Camera& camera : cameras_) {
        const Rendering image =
            DrawMesh(tracked.vertices_in_head, topology_, Texture(f), camera, tracked.world_from_head, {});
        writer_.WriteImage(frames_[f], camera.name, image.colour);
        // Fully covered pixels only: there an offset of the texture is an offset of the picture.
        ImageU8 mask = image.coverage;
        for (uint8_t& value : mask.values()) value = value == 255 ? 255 : 0;
        writer_.WriteHeadMask(frames_[f], camera.name, mask);
      }
    }
    capture_ = OpenCapture(scratch_ / "capture");
  }

  void MakeBall() {
    constexpr int kColumns = 24, kRows = 12;
    vertices_.resize((kColumns + 1) * (kRows + 1) + 1, 3);
    for (int r = 0; r <= kRows; ++r) {
      for (int c = 0; c <= kColumns; ++c) {
        const double turn = 2 * M_PI * c / kColumns, tilt = M_PI * r / kRows;
        vertices_.row(r * (kColumns + 1) + c) << static_cast<float>(90 * std::sin(tilt) * std::sin(turn)),
            static_cast<float>(90 * std::cos(tilt)), static_cast<float>(90 * std::sin(tilt) * std::cos(turn));
        topology_.uvs.emplace_back(static_cast<float>(c) / kColumns, 1 - static_cast<float>(r) / kRows);
      }
    }
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kColumns; ++c) {
        const int i = r * (kColumns + 1) + c, below = i + kColumns + 1;
        topology_.triangles.emplace_back(i, below, below + 1);
        topology_.triangles.emplace_back(i, below + 1, i + 1);
      }
    }
    topology_.triangle_uvs = topology_.triangles;
    topology_.vertex_count = static_cast<int>(vertices_.rows());
    vertices_.row(vertices_.rows() - 1) << 1e4f, 1e4f, 1e4f;
  }

  TrackedFrame Tracked(size_t frame) const {
    const auto f = static_cast<double>(frame);
    return {vertices_ * static_cast<float>(1 + 0.05 * f),
            {RotationFromYawPitchRoll(0.2 * f, 0.1, -0.1 * f), {f, 2, 3}}};
  }

  static ImageF Texture(size_t frame) {
    ImageF texture(64, 64, 3);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (int c = 0; c < 3; ++c) {
          const double wave = std::sin(0.4 * x + c) * std::cos(0.3 * y + static_cast<double>(frame));
          texture.at(x, y)[c] = static_cast<float>(std::round(120 + 60 * wave));
        }
      }
    }
    return texture;
  }

  // Knows the truth and departs from it as told.
  struct Teller : FrameDecoder {
    const EvaluateTest* test = nullptr;
    std::function<float(size_t frame, const Eigen::Vector3d& view)> texture_offset = [](size_t, const auto&) {
      return 0.0f;
    };
    Eigen::RowVector3f vertex_offset = Eigen::RowVector3f::Zero();

    DecodedFrame Decode(std::span<const float> code, const Eigen::Vector3d& view,
                        const FrameConditions&) const override {
      const auto frame = static_cast<size_t>(code[0]);
      DecodedFrame decoded = {Texture(frame), test->Tracked(frame).vertices_in_head};
      for (float& value : decoded.texture.values()) value += texture_offset(frame, view);
      decoded.vertices_in_head.rowwise() += vertex_offset;
      return decoded;
    }
  };

  Teller MakeTeller() const {
    Teller teller;
    teller.test = this;
    return teller;
  }

  EvaluationResult Run(const FrameDecoder& decoder, const EvaluationOptions& options = {}) const {
    const auto encode = [&](const FrameId& frame, const TrackedFrame&) {
      const auto index = std::find(frames_.begin(), frames_.end(), frame) - frames_.begin();
      return EncodedFrame{{static_cast<float>(index)}};
    };
    return Evaluate(*capture_, encode, decoder, options);
  }

  static constexpr std::array kCameraNames = {"a", "new", "b"};

  ScratchFolder scratch_;
  CaptureWriter writer_;
  std::vector<Camera> cameras_;
  const std::vector<FrameId> frames_ = {{"smile", "01"}, {"smile", "02"}, {"talk_1", "03"}, {"smile", "04"}};
  Vertices vertices_;
  MeshTopology topology_;
  std::unique_ptr<Capture> capture_;
};

TEST_F(EvaluateTest, TruthHasNoError) {
  const EvaluationResult result = Run(MakeTeller());
  const std::array<int, 4> images = {6, 3, 2, 1};
  for (size_t g = 0; g < 4; ++g) {
    const GroupResult& group = result.groups[g];
    EXPECT_EQ(group.images, images[g]);
    EXPECT_GT(group.error.count, 1000 * images[g]);
    EXPECT_EQ(group.error.sum, 0);
    EXPECT_NEAR(group.ssim, 1, 1e-6);
    EXPECT_NEAR(group.vertex_mm, 0, 1e-6);
    EXPECT_EQ(group.uncovered, 0);
    EXPECT_EQ(group.images_unmasked, 0);
  }
}

TEST_F(EvaluateTest, GroupsAreKeptApart) {
  // Off by 5 for the new camera, by 3 more in the held-out segment.
  Teller teller = MakeTeller();
  teller.texture_offset = [&](size_t frame, const Eigen::Vector3d& view) {
    const bool new_camera = (view - ViewVector(cameras_[1], Tracked(frame).world_from_head)).norm() < 1e-6;
    return (new_camera ? 5.0f : 0.0f) + (frame == 2 ? 3.0f : 0.0f);
  };
  const EvaluationResult result = Run(teller);
  EXPECT_NEAR(result.Of(EvaluationGroup::kTraining).error.Mean(), 0, 1e-9);
  EXPECT_NEAR(result.Of(EvaluationGroup::kHeldOutCameras).error.Mean(), 25, 1e-9);
  EXPECT_NEAR(result.Of(EvaluationGroup::kHeldOutSegments).error.Mean(), 9, 1e-9);
  EXPECT_NEAR(result.Of(EvaluationGroup::kHeldOutBoth).error.Mean(), 64, 1e-9);
  const auto json = nlohmann::json::parse(ToJson(result));
  EXPECT_TRUE(json["training"]["psnr_db"].is_null());
  EXPECT_NEAR(json["held_out_cameras"]["psnr_db"], PsnrDb(25), 1e-9);
  EXPECT_EQ(json["held_out_both"]["images"], 1);
  EXPECT_THAT(ToText(result), HasSubstr("25.00"));
}

// The capture as it would be unwrapped: every camera sees the left half of the texture.
class UnwrappedEvaluateTest : public EvaluateTest {
 protected:
  UnwrappedEvaluateTest() {
    for (size_t f = 0; f < frames_.size(); ++f) {
      for (const char* camera : kCameraNames) {
        ImageU8 texture = ToU8(Texture(f)), mask(64, 64, 1);
        for (int y = 0; y < 64; ++y) {
          std::fill_n(mask.at(0, y), 32, uint8_t{255});
          std::fill_n(texture.at(32, y), 3 * 32, uint8_t{0});
        }
        WritePng(writer_.layout().Texture(frames_[f], camera, 64), texture);
        WritePng(writer_.layout().TextureMask(frames_[f], camera, 64), mask);
      }
    }
    const CaptureLayout statistics(writer_.layout().TextureFolder(64));
    WritePng(statistics.TextureMean(), ImageU8(64, 64, 3, 120));
    WriteFile(statistics.TextureVariance(), "100\n");
    WriteFloats(statistics.VertexMean(), std::vector<float>(static_cast<size_t>(vertices_.size()), 0.0f));
    WriteFile(statistics.VertexVariance(), "50\n");
  }
};

TEST_F(UnwrappedEvaluateTest, TextureErrorIsOverSeenTexels) {
  Teller teller = MakeTeller();
  teller.texture_offset = [](size_t, const auto&) { return 6.0f; };
  const TextureSet textures(*capture_, 64);
  const auto encode = [&](const FrameId& frame, const TrackedFrame&) {
    const auto index = std::find(frames_.begin(), frames_.end(), frame) - frames_.begin();
    return EncodedFrame{{static_cast<float>(index)}};
  };
  const EvaluationResult result = Evaluate(*capture_, encode, teller, {}, &textures);
  for (const GroupResult& group : result.groups) {
    EXPECT_EQ(group.texture.count, int64_t{group.images} * 64 * 32 * 3);
    EXPECT_NEAR(group.texture.Mean(), 36, 1e-9);
  }
  const std::string csv = ToCsv(result);
  EXPECT_THAT(csv, testing::StartsWith("group,mse,mse_covered,psnr_db,ssim,texture_mse,vertex_mm,images,uncovered,"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
}

TEST_F(UnwrappedEvaluateTest, MultifaceProtocol) {
  Teller teller = MakeTeller();
  teller.texture_offset = [](size_t, const auto&) { return 6.0f; };
  teller.vertex_offset = {3, -4, 0};
  const TextureSet textures(*capture_, 64);
  // A channel that is 0 counts as unseen there, whatever the mask says.
  const auto path = writer_.layout().Texture(frames_[2], "a", 64);
  ImageU8 texture = ReadImage(path);
  texture.at(3, 3)[1] = 0;
  WritePng(path, texture);
  const auto encode = [](const FrameId& frame, const TrackedFrame&) {
    EXPECT_EQ(frame.segment, "talk_1");
    return EncodedFrame{{2}};
  };
  const MultifaceFigures figures = EvaluateAsMultiface(textures, encode, teller);
  EXPECT_EQ(figures.views, 2);  // one frame, two training cameras
  EXPECT_NEAR(figures.texture_mse, 36.0 * (64 * 32 * 3 - 0.5) / (64 * 64 * 3), 1e-6);
  EXPECT_NEAR(figures.vertex_mse, 25.0 / 3 / 50, 1e-5);
}

TEST_F(EvaluateTest, VertexErrorIsInMillimetresOfUsedVertices) {
  Teller teller = MakeTeller();
  teller.vertex_offset = {3, -4, 0};
  for (const GroupResult& group : Run(teller).groups) EXPECT_NEAR(group.vertex_mm, 5, 1e-4);
}

TEST_F(EvaluateTest, UncoveredHeadPixelsCountAsBlack) {
  Teller teller = MakeTeller();
  teller.vertex_offset = {0, 5000, 0};  // out of every picture
  EvaluationOptions options;
  options.pictures = 100;
  const EvaluationResult result = Run(teller, options);
  for (const GroupResult& group : result.groups) EXPECT_EQ(group.uncovered, 1);
  for (const EvaluatedPicture& picture : result.pictures) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < picture.mask.values().size(); ++i) {
      if (picture.mask.values()[i] == 0) continue;
      for (int c = 0; c < 3; ++c) sum += std::pow(picture.truth.values()[3 * i + c], 2);
      count += 3;
    }
    EXPECT_NEAR(picture.mse, sum / count, 1e-6);
  }
}

TEST_F(EvaluateTest, TheTrackedOutlineStandsInForAMask) {
  std::filesystem::remove_all(scratch_ / "capture" / "masks" / "smile");
  Teller teller = MakeTeller();
  teller.vertex_offset = {0, 5000, 0};
  const EvaluationResult result = Run(teller);
  EXPECT_EQ(result.Of(EvaluationGroup::kTraining).images_unmasked, 6);
  EXPECT_EQ(result.Of(EvaluationGroup::kHeldOutSegments).images_unmasked, 0);
  // Although the avatar is out of the picture, the head's pixels count.
  EXPECT_GT(result.Of(EvaluationGroup::kTraining).error.count, 6 * 1000);
  EXPECT_EQ(result.Of(EvaluationGroup::kTraining).uncovered, 1);
  EXPECT_THAT(ToText(result), HasSubstr("outline"));
}

TEST_F(EvaluateTest, ImagesThatAreAbsentAreLeftOut) {
  std::filesystem::remove(writer_.layout().Image(frames_[0], "a"));
  std::filesystem::remove(writer_.layout().Image(frames_[2], "new"));
  const EvaluationResult result = Run(MakeTeller());
  EXPECT_EQ(result.Of(EvaluationGroup::kTraining).images, 5);
  EXPECT_EQ(result.Of(EvaluationGroup::kHeldOutBoth).images, 0);
  EXPECT_TRUE(nlohmann::json::parse(ToJson(result))["held_out_both"]["mse"].is_null());
}

TEST_F(EvaluateTest, FewerImagesAndPicturesWhenAsked) {
  EvaluationOptions options;
  options.max_images = 2;
  options.pictures = 1;
  const EvaluationResult once = Run(MakeTeller(), options), twice = Run(MakeTeller(), options);
  EXPECT_EQ(once.Of(EvaluationGroup::kTraining).images, 2);
  EXPECT_EQ(once.Of(EvaluationGroup::kHeldOutBoth).images, 1);
  ASSERT_EQ(once.pictures.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(once.pictures[i].group, kEvaluationGroups[i]);
    EXPECT_EQ(once.pictures[i].frame, twice.pictures[i].frame);
    EXPECT_EQ(once.pictures[i].camera, twice.pictures[i].camera);
    EXPECT_EQ(once.pictures[i].truth, once.pictures[i].ours);
    EXPECT_EQ(once.pictures[i].texture.width(), 64);
  }
  // As many cameras as there are come into the pictures.
  options = {};
  options.pictures = 2;
  const EvaluationResult pairs = Run(MakeTeller(), options);
  ASSERT_EQ(pairs.pictures.size(), 7u);
  EXPECT_NE(pairs.pictures[0].camera, pairs.pictures[1].camera);
  EXPECT_NE(pairs.pictures[0].frame, pairs.pictures[1].frame);
  options.max_images = -1;
  EXPECT_THAT(ErrorOf([&] { Run(MakeTeller(), options); }), HasSubstr("max-images"));
}

TEST_F(EvaluateTest, WhatWasTrainedOnIsNotHeldOut) {
  Avatar avatar;
  avatar.codes = {{"smile", "01", {}}};
  avatar.training["cameras"] = "a b";
  CheckHeldOut(avatar, *capture_);
  avatar.training["cameras"] = "a b new";
  EXPECT_THAT(ErrorOf([&] { CheckHeldOut(avatar, *capture_); }), HasSubstr("trained on camera new"));
  avatar.training.clear();
  avatar.codes.push_back({"talk_1", "03", {}});
  EXPECT_THAT(ErrorOf([&] { CheckHeldOut(avatar, *capture_); }), HasSubstr("trained on segment talk_1"));
}

TEST_F(EvaluateTest, AnAvatarOfAnotherMeshIsRefused) {
  struct Stranger : FrameDecoder {
    DecodedFrame Decode(std::span<const float>, const Eigen::Vector3d&, const FrameConditions&) const override {
      return {ImageF(4, 4, 3), Vertices::Zero(5, 3)};
    }
  };
  EXPECT_THAT(ErrorOf([&] { Run(Stranger()); }), HasSubstr("5 vertices"));
}

class PartsTest : public EvaluateTest {
 protected:
  PartsTest() {
    teller_.test = this;
    teller_.texture_offset = [](size_t frame, const Eigen::Vector3d& view) {
      return static_cast<float>(3.1 * static_cast<double>(frame) + view[0]);
    };
    teller_.vertex_offset = {0.3f, 1, 0};
    options_.pictures = 2;
  }
  SharedEvaluation Share(const Shard& shard, const std::string& avatar = "avatar") const {
    const auto encode = [&](const FrameId& frame, const TrackedFrame&) {
      ++encoded_;
      const auto index = std::find(frames_.begin(), frames_.end(), frame) - frames_.begin();
      return EncodedFrame{{static_cast<float>(index)}};
    };
    return EvaluateTogether(*capture_, encode, teller_, options_, nullptr, scratch_ / "parts", avatar, shard);
  }
  void ExpectWhole(const std::optional<EvaluationResult>& result) const {
    const EvaluationResult whole = Run(teller_, options_);
    ASSERT_TRUE(result.has_value());
    EXPECT_EQ(ToJson(*result), ToJson(whole));
    for (size_t g = 0; g < 4; ++g) {
      EXPECT_EQ(result->groups[g].error.sum, whole.groups[g].error.sum);
      EXPECT_EQ(result->groups[g].vertex_mm, whole.groups[g].vertex_mm);
      EXPECT_EQ(result->groups[g].ssim, whole.groups[g].ssim);
    }
    ASSERT_EQ(result->pictures.size(), whole.pictures.size());
    for (size_t i = 0; i < whole.pictures.size(); ++i) {
      EXPECT_EQ(result->pictures[i].camera, whole.pictures[i].camera);
      EXPECT_EQ(result->pictures[i].ours, whole.pictures[i].ours);
      EXPECT_EQ(result->pictures[i].mask, whole.pictures[i].mask);
      EXPECT_EQ(result->pictures[i].texture, whole.pictures[i].texture);
      EXPECT_EQ(result->pictures[i].mse, whole.pictures[i].mse);
    }
  }

  Teller teller_;
  EvaluationOptions options_;
  mutable std::atomic<int> encoded_ = 0;
};

TEST_F(PartsTest, AddUpToTheWholeBitForBit) {
  for (const int count : {1, 2, 4, 7}) {
    SCOPED_TRACE(count);
    for (int index = 2; index <= count; ++index) {
      const SharedEvaluation part = Share({index, count});
      EXPECT_FALSE(part.result.has_value());
      EXPECT_EQ(part.images, 12);
      EXPECT_GT(part.images_missing, 0);
    }
    ExpectWhole(Share({1, count}).result);
    encoded_ = 0;
    ExpectWhole(Share({count, count}).result);
    EXPECT_EQ(encoded_, 0) << "all was measured";
    std::filesystem::remove_all(scratch_ / "parts");
  }
}

TEST_F(PartsTest, OnlyWhatIsMissingIsMeasuredAndNothingElseIsMixedIn) {
  Share({1, 3});
  Share({3, 3});
  encoded_ = 0;
  ExpectWhole(Share({}).result);  // the second one's frame
  EXPECT_EQ(encoded_, 1);
  encoded_ = 0;
  EXPECT_FALSE(Share({1, 2}, "another avatar").result.has_value());
  options_.supersample = 1;
  EXPECT_FALSE(Share({1, 2}).result.has_value());
  EXPECT_EQ(encoded_, 4);
}

TEST_F(PartsTest, DamagedOnesAreNamed) {
  Share({1, 2});
  const std::filesystem::path folder = scratch_ / "parts" / ListFolder(scratch_ / "parts")[0];
  const std::string text = ReadFile(folder / "1-of-2.json");
  EXPECT_EQ(PartText(ParsePart("p", text, 12)), text);
  EXPECT_THAT(ErrorOf([&] { ParsePart("p", text, 3); }), HasSubstr("3 images"));
  for (const char* bad : {"", "[]", "{}", R"({"images_in_all": 12, "images": [1]})",
                          R"({"images_in_all": -1, "images": []})", R"({"images_in_all": 12, "images": 7})"}) {
    EXPECT_THAT(ErrorOf([&] { ParsePart("p", bad, 12); }), testing::StartsWith("p: ")) << bad;
  }
  const auto with = [&](const char* from, const char* to) {
    std::string changed = text;
    changed.replace(changed.find(from), std::string(from).size(), to);
    return ErrorOf([&] { ParsePart("p", changed, 12); });
  };
  EXPECT_THAT(with(R"("image":0)", R"("image":12)"), HasSubstr("numbers that this evaluation cannot have"));
  EXPECT_THAT(with(R"("head_pixels":)", R"("head_pixels":-)"), HasSubstr("cannot have"));
  EXPECT_THAT(with(R"("ssim":)", R"("ssim":"x","s":)"), HasSubstr("remove it"));
  WriteFile(folder / "1-of-2.json", "{}");
  EXPECT_THAT(ErrorOf([&] { Share({2, 2}); }), HasSubstr("1-of-2.json"));
}

// ffmpeg is a script that keeps the bytes.
TEST_F(EvaluateTest, VideoHasEveryFrameInOrder) {
  const std::string path = std::getenv("PATH");
  WriteFile(scratch_ / "bin" / "ffmpeg", "#!/bin/sh\nfor last; do :; done\ncat > \"${last#file:}\"\n");
  std::filesystem::permissions(scratch_ / "bin" / "ffmpeg", std::filesystem::perms::owner_all);
  setenv("PATH", ((scratch_ / "bin").string() + ":" + path).c_str(), 1);
  const auto encode = [&](const FrameId& frame, const TrackedFrame&) {
    return EncodedFrame{{static_cast<float>(std::find(frames_.begin(), frames_.end(), frame) - frames_.begin())}};
  };
  Teller teller = MakeTeller();
  teller.texture_offset = [](size_t, const auto&) { return 6.0f; };
  EvaluationVideoOptions options;
  options.path = scratch_ / "a.mp4";
  options.segment = "smile";
  const EvaluationVideo video = WriteEvaluationVideo(*capture_, encode, teller, options);
  EXPECT_EQ(video.camera, "new");
  EXPECT_EQ(video.figures.images, 3);
  EXPECT_NEAR(video.figures.error.Mean(), 36, 1e-9);
  EvaluationOptions all;
  all.pictures = 100;
  std::string expected;
  std::optional<Framing> framing;
  for (const EvaluatedPicture& picture : Run(teller, all).pictures) {
    if (picture.camera != "new" || picture.frame.segment != "smile") continue;
    if (!framing) framing = WholeFraming(picture.mask);
    const ImageU8 panel = ComparisonPanel(picture, *framing);
    const int width = panel.width() / 2 * 2;
    for (int y = 0; y < panel.height() / 2 * 2; ++y) {
      expected.append(reinterpret_cast<const char*>(panel.row(y)), static_cast<size_t>(3 * width));
    }
  }
  EXPECT_TRUE(ReadFile(options.path) == expected);
  options.segment = "smle";
  EXPECT_THAT(ErrorOf([&] { WriteEvaluationVideo(*capture_, encode, teller, options); }),
              HasSubstr("did you mean 'smile'"));
  options.segment = "";
  EXPECT_EQ(WriteEvaluationVideo(*capture_, encode, teller, options).segment, "talk_1");
  options.camera = "nw";
  EXPECT_THAT(ErrorOf([&] { WriteEvaluationVideo(*capture_, encode, teller, options); }), HasSubstr("new"));
  setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace likeness
