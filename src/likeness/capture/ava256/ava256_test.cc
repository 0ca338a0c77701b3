// Captures written as Ava-256 and Goliath publish them, against what they were written from.

#include "likeness/capture/ava256/ava256.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/capture/ava256/packed_folder.h"
#include "likeness/capture/ava256/tables.h"
#include "likeness/capture/ava256/test_folder.h"
#include "likeness/capture/writer.h"
#include "likeness/image/metrics.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Two cameras, three frames, a mesh of two triangles; pictures have the shape of the published ones.
class Ava256Test : public ::testing::Test {
 protected:
  Ava256Test() : writer_(scratch_ / "multiface"), root_(scratch_ / "20230101--0800--TST001") {
    SetQuiet(true);
    std::vector<Camera> cameras;
    for (int i = 0; i < 2; ++i) {
      cameras.push_back(LookAt({300.0 * i - 290.1, 77.7, 1000.0 + i}, {0, 0, 0}, {0, 1, 0}, 130.0 + i, 42, 64));
      cameras.back().intrinsics(0, 2) += 2.5;
      cameras.back().intrinsics(1, 1) *= 1.01;
      cameras.back().name = i == 0 ? "400940" : "401031";
    }
    MeshTopology topology;
    topology.vertex_count = 5;
    topology.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    topology.triangles = {{0, 1, 2}, {0, 2, 4}};
    topology.triangle_uvs = {{0, 1, 2}, {0, 2, 3}};
    writer_.WriteCalibration(cameras);
    writer_.WriteFrameList(frames_);
    Random random(1);
    for (size_t i = 0; i < frames_.size(); ++i) {
      TrackedFrame tracked;
      tracked.vertices_in_head = Vertices::Random(5, 3) * 90;
      tracked.world_from_head = {RotationFromYawPitchRoll(0.1 * static_cast<double>(i), 0.2, 0.3), {1.0 / 3, -2, 17}};
      writer_.WriteTracked(frames_[i], tracked);
      if (i == 0) writer_.WriteObj(frames_[i], tracked.vertices_in_head, topology);
      for (const Camera& camera : cameras) {
        ImageU8 image(42, 64, 3), mask(42, 64, 1);
        const int shift = static_cast<int>(random.Below(50));
        for (int y = 0; y < 64; ++y) {
          for (int x = 0; x < 42; ++x) {
            for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<uint8_t>(shift + 2 * x + (c + 1) * y / 2);
            *mask.at(x, y) = x > 10 && y < 40 ? 255 : 0;
          }
        }
        writer_.WriteImage(frames_[i], camera.name, image);
        writer_.WriteHeadMask(frames_[i], camera.name, mask);
      }
    }
    source_ = OpenCapture(scratch_ / "multiface");
  }

  fs::path WriteFolder(const TestFolderOptions& options = {}) const {
    fs::remove_all(root_);
    const TestFolder folder(root_, options);
    folder.Write(*source_);
    return folder.data();
  }

  void ExpectSame(const Capture& read, double least_psnr_db) const {
    ASSERT_EQ(read.cameras().size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      const Camera &a = read.cameras()[i], &b = source_->cameras()[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.width, b.width);
      EXPECT_EQ(a.height, b.height);
      EXPECT_LT((a.intrinsics - b.intrinsics).cwiseAbs().maxCoeff(), 1e-9) << a.intrinsics;
      EXPECT_EQ(a.cam_from_world.rotation, b.cam_from_world.rotation);
      EXPECT_EQ(a.cam_from_world.translation, b.cam_from_world.translation);
    }
    EXPECT_EQ(read.topology().triangles, source_->topology().triangles);
    EXPECT_EQ(read.topology().uvs, source_->topology().uvs);
    ASSERT_EQ(read.frames().size(), frames_.size());
    for (size_t f = 0; f < frames_.size(); ++f) {
      const FrameId &a = read.frames()[f], &b = frames_[f];
      EXPECT_EQ(a.frame, b.frame);
      const TrackedFrame tracked = read.ReadTracked(a), written = source_->ReadTracked(b);
      EXPECT_EQ(tracked.vertices_in_head, written.vertices_in_head);
      EXPECT_EQ(tracked.world_from_head.rotation, written.world_from_head.rotation);
      EXPECT_EQ(tracked.world_from_head.translation, written.world_from_head.translation);
      for (const Camera& camera : read.cameras()) {
        ASSERT_TRUE(read.HasCameraImage(a, camera) && read.HasHeadMask(a, camera));
        const ImageU8 image = read.ReadCameraImage(a, camera), truth = source_->ReadCameraImage(b, camera);
        const double mse = MaskedSquaredError(image, truth, ImageU8(42, 64, 1, 255)).Mean();
        EXPECT_GE(PsnrDb(mse), least_psnr_db);
        EXPECT_EQ(read.ReadHeadMask(a, camera), source_->ReadHeadMask(b, camera));
      }
    }
  }

  std::string OpenError(const CaptureOptions& options = {}) const {
    return ErrorOf([&] { OpenCapture(root_, options); });
  }

  ScratchFolder scratch_;
  CaptureWriter writer_;
  const fs::path root_;
  const std::vector<FrameId> frames_ = {{"EXP_jaw", "000012"}, {"EXP_jaw", "000019"}, {"SEN_one", "021924"}};
  std::unique_ptr<Capture> source_;
};

constexpr double kExact = std::numeric_limits<double>::infinity();

TEST_F(Ava256Test, EqualsWhatItWasWrittenFrom) {
  WriteFolder();
  const auto capture = OpenCapture(root_);
  EXPECT_EQ(capture->layout_name(), "Ava-256");
  EXPECT_EQ(capture->frames(), frames_);
  EXPECT_THAT(capture->skipped_frames(), IsEmpty());
  ExpectSame(*capture, kExact);
  EXPECT_EQ(capture->split().training_cameras.size(), 2u);
  ExpectSame(*OpenCapture(root_ / "decoder"), kExact);
}

TEST_F(Ava256Test, EveryFormOfTheFilesReadsAlike) {
  TestFolderOptions options;
  options.quantizer = 12;
  options.ply = PlyEncoding::kAscii;
  WriteFolder(options);
  ExpectSame(*OpenCapture(root_), 38);  // AVIF with loss
  options.avif = false;
  options.ply = PlyEncoding::kBigEndian;
  WriteFolder(options);
  ExpectSame(*OpenCapture(root_), kExact);
  options.packed = false;
  const fs::path data = WriteFolder(options);
  ExpectSame(*OpenCapture(root_), kExact);
  EXPECT_EQ(OpenCapture(root_)->ImageFile(frames_[0], source_->cameras()[0]), data / "image/cam400940/000012.png");
  // Other ways to unpack: into the folder around, or one folder deeper.
  for (const FrameId& frame : frames_) {
    fs::rename(data / "head_pose/head_pose" / (frame.frame + ".txt"), data / "head_pose" / (frame.frame + ".txt"));
  }
  fs::rename(data / "image/cam400940", data / "moved");
  fs::create_directories(data / "image/cam400940");
  fs::rename(data / "moved", data / "image/cam400940/cam400940");
  ExpectSame(*OpenCapture(root_), kExact);
}

TEST_F(Ava256Test, GoliathsPixelCentresAndSplit) {
  TestFolderOptions options;
  options.goliath = true;
  WriteFolder(options);
  const auto capture = OpenCapture(root_);
  EXPECT_EQ(capture->layout_name(), "Goliath");
  ExpectSame(*capture, kExact);
  EXPECT_THAT(capture->frames(), ElementsAre(frames_[0], frames_[1], FrameId{"test_SEN_one", "021924"}));
  EXPECT_THAT(capture->HeldOutFrames(), ElementsAre(FrameId{"test_SEN_one", "021924"}));
  fs::remove(root_ / "frame_segments_list.csv");
  EXPECT_EQ(OpenCapture(root_)->frames()[0].segment, "all");
}

TEST_F(Ava256Test, TheSizeOfTheCalibrationIsFoundByEvidence) {
  for (const int multiple : {1, 2, 8}) {
    TestFolderOptions options;
    options.sensor_width = 42 * multiple;
    options.sensor_height = 64 * multiple;
    WriteFolder(options);
    ::testing::internal::CaptureStderr();
    ExpectSame(*OpenCapture(root_), kExact);
    EXPECT_THAT(::testing::internal::GetCapturedStderr(),
                HasSubstr(fmt::format("it is for {} times the pictures' 42 x 64", multiple)));
  }
  TestFolderOptions options;
  options.sensor_width = 42 * 3;
  options.sensor_height = 64 * 20;
  WriteFolder(options);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("camera_calibration.json"), HasSubstr("pictures of 42 x 64")));
}

TEST_F(Ava256Test, MissingFilesAreSkippedWithReasons) {
  const fs::path data = WriteFolder();
  WriteFile(data / "frame_list.csv",
            ",seg_id,frame_id\n0,EXP_jaw,000012\n1,EXP_jaw,12\n2,EXP_jaw,19.0\n3,SEN_one,000777\n4,SEN_one,021924\n");
  NamedBytes poses = {{"000012.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n"}, {"021924.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n"}};
  WriteZip(data / "head_pose/head_pose.zip", poses);
  WriteZip(data / "image/cam401031.zip", {{"cam401031/000012.avif", EncodeAvif(ImageU8(42, 64, 3, 90))}});
  const auto capture = OpenCapture(root_);
  EXPECT_THAT(capture->frames(), ElementsAre(frames_[0], frames_[2]));
  std::string reasons;
  for (const SkippedFrame& skipped : capture->skipped_frames()) reasons += skipped.reason + "\n";
  EXPECT_EQ(reasons,
            "is listed twice\n"
            "head_pose/head_pose.zip/000019.txt is absent\n"
            "kinematic_tracking/registration_vertices.zip/000777.ply is absent\n");
  EXPECT_FALSE(capture->HasCameraImage(frames_[2], capture->FindCamera("401031")));
  EXPECT_THAT(ErrorOf([&] { capture->ReadCameraImage(frames_[2], capture->FindCamera("401031")); }),
              HasSubstr("cam401031.zip/021924.avif: no such file"));
}

TEST_F(Ava256Test, UnpublishedCamerasAreLeftOutUnlessThereAreNoPicturesAtAll) {
  const fs::path data = WriteFolder();
  fs::remove(data / "image/cam400940.zip");
  EXPECT_EQ(OpenCapture(root_)->cameras().size(), 1u);
  fs::remove_all(data / "image");
  fs::remove_all(data / "segmentation_parts");
  const auto capture = OpenCapture(root_);
  ASSERT_EQ(capture->cameras().size(), 2u);
  EXPECT_EQ(capture->cameras()[0].width, 0);
  EXPECT_FALSE(capture->HasCameraImage(frames_[0], capture->cameras()[0]));
  EXPECT_EQ(capture->ReadHeadMask(frames_[0], capture->cameras()[0]), std::nullopt);
}

TEST_F(Ava256Test, DistortionIsRefusedIgnoredOrUndone) {
  TestFolderOptions options;
  options.distortion = {-0.4, 0.04, -0.003, 0.003};
  WriteFolder(options);
  EXPECT_THAT(OpenError(),
              AllOf(HasSubstr("2 of 2 cameras have lens distortion"), HasSubstr("--distortion undistort")));
  CaptureOptions open;
  open.distortion = "ignore";
  ExpectSame(*OpenCapture(root_, open), kExact);
  EXPECT_EQ(OpenCapture(root_, open)->ReadValidMask(source_->cameras()[0]), std::nullopt);
  open.distortion = "undistort";
  const auto capture = OpenCapture(root_, open);
  const Camera& camera = capture->cameras()[1];
  const ImageU8 undone = capture->ReadCameraImage(frames_[0], camera);
  const ImageU8 truth = source_->ReadCameraImage(frames_[0], source_->cameras()[1]);
  // The picture is smooth: what the pinhole shows at a pixel stands in the source where the lens has moved it to.
  const Lens lens = {Lens::Model::kRadialTangential, {-0.4, 0.04, -0.003, 0.003}};
  const Eigen::Matrix3d& k = camera.intrinsics;
  const std::optional<ImageU8> valid = capture->ReadValidMask(camera);
  int compared = 0;
  for (int y = 0; y < 64; y += 3) {
    for (int x = 0; x < 42; x += 3) {
      if (valid && *valid->at(x, y) == 0) continue;
      const Eigen::Vector2d ideal((x + 0.5 - k(0, 2)) / k(0, 0), (y + 0.5 - k(1, 2)) / k(1, 1));
      const Eigen::Vector2d seen = lens.Distort(ideal);
      const double source_x = k(0, 0) * seen.x() + k(0, 2) - 0.5, source_y = k(1, 1) * seen.y() + k(1, 2) - 0.5;
      if (source_x < 0 || source_y < 0 || source_x > 41 || source_y > 63) continue;
      // The test's pictures are linear in x and y but for rounding: see the fixture.
      const double expected = truth.at(0, 0)[1] + 2 * source_x + source_y;
      EXPECT_NEAR(undone.at(x, y)[1], expected, 1.01) << x << ' ' << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 200);
  EXPECT_NE(undone, truth);
  EXPECT_EQ(capture->ImageFile(frames_[0], camera), std::nullopt);
}

TEST_F(Ava256Test, TopologyIsSoughtAndNamed) {
  TestFolderOptions options;
  options.topology = scratch_ / "elsewhere.obj";
  const fs::path data = WriteFolder(options);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("--topology"), HasSubstr("face_topology.obj")));
  CaptureOptions named;
  named.topology_file = options.topology;
  ExpectSame(*OpenCapture(root_, named), kExact);
  fs::copy(options.topology, root_.parent_path() / "face_topology.obj");  // one for all people
  ExpectSame(*OpenCapture(root_), kExact);
  WriteFile(data / "face_topology.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("is for 3 vertices"), HasSubstr("has 5"), HasSubstr("--topology")));
}

TEST_F(Ava256Test, TexturesAndStatisticsOfThePublisher) {
  const TestFolder folder(root_, {});
  folder.Write(*source_);
  EXPECT_EQ(OpenCapture(root_)->ReadAverageTexture(frames_[0]), std::nullopt);
  EXPECT_FALSE(OpenCapture(root_)->ReadPublishedStatistics());
  folder.WriteTextures(*source_, 20);
  const auto capture = OpenCapture(root_);
  EXPECT_EQ(capture->ReadAverageTexture(frames_[2]), ImageU8(20, 20, 3, 30));
  const auto statistics = capture->ReadPublishedStatistics();
  ASSERT_TRUE(statistics);
  EXPECT_EQ(statistics->texture_mean, ImageU8(20, 20, 3, 77));
  EXPECT_EQ(statistics->texture_variance, 123.5);
  EXPECT_EQ(statistics->vertex_mean, std::vector<float>(15, 2.5f));
  EXPECT_EQ(statistics->vertex_variance, 4.25);
}

TEST_F(Ava256Test, WrongFilesAreNamed) {
  const fs::path data = WriteFolder();
  const auto error_of_frame = [&](int frame) {
    const auto capture = OpenCapture(root_);
    return ErrorOf([&] { capture->ReadTracked(frames_[static_cast<size_t>(frame)]); });
  };
  const NamedBytes meshes = {{"000012.ply", EncodePly(Vertices::Zero(5, 3), {})},
                             {"000019.ply", EncodePly(Vertices::Zero(4, 3), {})},
                             {"021924.ply", "ply"}};
  WriteZip(data / "kinematic_tracking/registration_vertices.zip", meshes);
  EXPECT_THAT(error_of_frame(1), HasSubstr("registration_vertices.zip/000019.ply: holds 4 vertices"));
  EXPECT_THAT(error_of_frame(2), HasSubstr("021924.ply: is no PLY"));
  WriteZip(data / "image/cam400940.zip", {{"000012.avif", EncodeAvif(ImageU8(42, 64, 3, 9))}, {"000019.png", "x"}});
  const auto capture = OpenCapture(root_);
  EXPECT_THAT(ErrorOf([&] { capture->ReadCameraImage(frames_[1], capture->cameras()[0]); }),
              HasSubstr("cam400940.zip/000019.png: is neither"));
  WriteZip(data / "image/cam400940.zip", {{"000012.avif", "x"}, {"000019.avif", EncodeAvif(ImageU8(42, 64, 3, 9))}});
  EXPECT_EQ(OpenCapture(root_)->cameras()[0].width, 42);
  WriteZip(data / "image/cam400940.zip", {{"000012.avif", "x"}});
  EXPECT_THAT(OpenError(), HasSubstr("000012.avif: is neither"));
  WriteZip(data / "image/cam400940.zip", {{"a/12.png", "x"}, {"b/000012.avif", "x"}});
  EXPECT_THAT(OpenError(), HasSubstr("holds both"));
  WriteFile(data / "image/cam400940.zip", "no zip at all");
  EXPECT_THAT(OpenError(), HasSubstr("cam400940.zip: cannot be read as a zip"));
  fs::remove(data / "head_pose/head_pose.zip");
  EXPECT_THAT(OpenError(), HasSubstr("head_pose.zip: no such file, and no folder"));
  fs::remove(data / "frame_list.csv");
  EXPECT_THAT(OpenError(), HasSubstr("is no capture"));
}

TEST_F(Ava256Test, ManyThreadsReadTheSame) {
  WriteFolder();
  const auto capture = OpenCapture(root_);
  const ImageU8 truth = source_->ReadCameraImage(frames_[1], source_->cameras()[0]);
  SetThreadCount(4);
  ParallelFor(64, [&](int64_t i) {
    const FrameId& frame = frames_[static_cast<size_t>(i % 3)];
    capture->ReadTracked(frame);
    capture->ReadHeadMask(frame, capture->cameras()[static_cast<size_t>(i % 2)]);
    EXPECT_EQ(capture->ReadCameraImage(frames_[1], capture->cameras()[0]), truth);
  });
  SetThreadCount(0);
}

// The bytes of a zip of one file, to be damaged.
std::string ZipBytes(const std::string& content, bool deflate) {
  const ScratchFolder scratch;
  WriteZip(scratch / "z.zip", {{"cam1/000001.txt", content}}, deflate);
  return ReadFile(scratch / "z.zip");
}

std::string ReadZipped(const std::string& bytes, uint64_t most = 1 << 20) {
  return PackedFolder::FromZipBytes("z.zip", bytes, {".txt"}).Read(1, most);
}

TEST(PackedFolderTest, LiesAboutSizesAreErrors) {
  const std::string content(5000, 'a');
  const auto with_size = [](std::string bytes, uint32_t size) {
    // Uncompressed sizes: 22 bytes into the local header, 24 into the central one.
    const size_t local = bytes.find("PK\x03\x04"), central = bytes.find("PK\x01\x02");
    std::memcpy(bytes.data() + local + 22, &size, 4);
    std::memcpy(bytes.data() + central + 24, &size, 4);
    return bytes;
  };
  const std::string good = ZipBytes(content, true);
  ASSERT_EQ(ReadZipped(good), content);
  EXPECT_THAT(ErrorOf([&] { ReadZipped(good, 4999); }), HasSubstr("z.zip/cam1/000001.txt: is 5000 bytes large"));
  EXPECT_NE(ErrorOf([&] { ReadZipped(with_size(good, 100)); }), "");
  EXPECT_NE(ErrorOf([&] { ReadZipped(with_size(good, 5001)); }), "");
  EXPECT_THAT(ErrorOf([&] { ReadZipped(with_size(good, 0xfffffff0), uint64_t{1} << 40); }), HasSubstr("packed ones"));
  // A bomb that tells the truth.
  EXPECT_THAT(ErrorOf([&] { ReadZipped(ZipBytes(std::string(1 << 24, '\0'), true)); }), HasSubstr("at most 1048576"));
}

TEST(PackedFolderTest, NamesStayBelowTheZips) {
  const ScratchFolder scratch;
  const auto path = scratch / "z.zip";
  WriteZip(path, {{"/etc/000001.txt", "x"}});
  const std::string bytes = ReadFile(path);
  EXPECT_EQ(PackedFolder::FromZipBytes("z.zip", bytes, {".txt"}).NameOf(1), "z.zip/etc/000001.txt");
}

TEST(PackedFolderTest, DamagedZipsAreErrorsOrWhole) {
  Random random(11);
  for (const bool deflate : {false, true}) {
    const std::string content = "some text that does not matter, but is known; some text again, so that it packs";
    const std::string good = ZipBytes(content, deflate);
    for (size_t length = 0; length < good.size(); ++length) {
      EXPECT_NE(ErrorOf([&] { ReadZipped(good.substr(0, length)); }), "") << length;
    }
    for (int round = 0; round < 3000; ++round) {
      std::string bytes = good;
      for (int64_t i = 0, n = 1 + random.Below(3); i < n; ++i) {
        bytes[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] =
            static_cast<char>(random.Below(256));
      }
      // The checksum tells: what is read is what was written.
      ErrorOf([&] { EXPECT_EQ(ReadZipped(bytes), content); });
    }
  }
}

TEST(TablesTest, ThePublishedCalibration) {
  const auto path = SampleData("ava256/camera_calibration.json");
  if (!path) GTEST_SKIP() << "sample data absent";
  const auto cameras = ParseSensorCalibration(*path, ReadFile(*path));
  ASSERT_EQ(cameras.size(), 1u);
  const Camera& camera = cameras[0].camera;
  EXPECT_EQ(camera.name, "400940");
  EXPECT_NEAR(camera.intrinsics(0, 0), 10355.089, 1e-3);
  EXPECT_NEAR(camera.intrinsics(0, 2), 1413.068, 1e-3);
  EXPECT_NEAR(camera.intrinsics(1, 2), 1783.600, 1e-3);
  // About a metre from the middle of the dome, looking at it: a transposed rotation would look elsewhere.
  const Eigen::Vector3d centre = camera.CentreInWorld(), axis = camera.cam_from_world.rotation.row(2);
  EXPECT_NEAR(cameras[0].lens.k[0], -0.0734, 1e-4);
  EXPECT_FALSE(cameras[0].lens.IsPinhole());
  Camera published = camera;
  published.width = 667, published.height = 1024;
  published.intrinsics.topRows<2>() /= 4;
  EXPECT_NEAR(cameras[0].LargestShiftPx(published), 6, 3);
  EXPECT_GT(centre.norm(), 500);
  EXPECT_LT(centre.norm(), 2000);
  EXPECT_LT(axis.dot(centre), 0);
}

TEST(TablesTest, WrongCalibrationsAreNamed) {
  const std::string good =
      R"({"KRT": [{"cameraId": "7", "K": [[900, 0, 0], [0, 900, 0], [300, 500, 1]],
          "T": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 6, 1000, 1]], "distortion": [0, 0, 0, 0]}]})";
  const auto error = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return ErrorOf([&] { ParseSensorCalibration("c.json", text); });
  };
  EXPECT_EQ(error("7", "7"), "");
  EXPECT_EQ(ParseSensorCalibration("c.json", good)[0].camera.cam_from_world.translation, Eigen::Vector3d(5, 6, 1000));
  EXPECT_EQ(error("\"7\"", "7"), "");
  EXPECT_THAT(error("{\"KRT\"", "[\"KRT\""), HasSubstr("c.json: is no JSON"));
  EXPECT_THAT(error("KRT", "cameras"), HasSubstr("expected {\"KRT\": [cameras]}"));
  EXPECT_THAT(error("\"7\"", "\"../7\""), HasSubstr("cannot be a name"));
  EXPECT_THAT(error("\"7\"", "[]"), HasSubstr("cannot be a name"));
  EXPECT_THAT(error("[[900, 0, 0], [0, 900, 0], [300, 500, 1]]", "[[900, 0, 300], [0, 900, 500], [0, 0, 1]]"),
              AllOf(HasSubstr("camera 7"), HasSubstr("K is not stored transposed")));
  EXPECT_THAT(error("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 6, 1000, 1]]",
                    "[[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 1000], [0, 0, 0, 1]]"),
              HasSubstr("T is not stored transposed"));
  EXPECT_THAT(error("[[1, 0, 0, 0]", "[[-1, 0, 0, 0]"), HasSubstr("its rotation mirrors"));
  EXPECT_THAT(error("[[1, 0, 0, 0]", "[[3, 0, 0, 0]"), HasSubstr("is off by"));
  EXPECT_THAT(error("[[900,", "[[-900,"), HasSubstr("focal lengths of -900"));
  EXPECT_THAT(error("[[900,", "[[\"900\","), HasSubstr("no finite number"));
  EXPECT_THAT(error("[[900, 0, 0]", "[[900, 0]"), HasSubstr("needs 3 numbers"));
  EXPECT_THAT(error("1000, 1]", "1e99, 1]"), HasSubstr("translation"));
  EXPECT_THAT(error("[0, 0, 0, 0]}", "[0, 0]}"), HasSubstr("\"distortion\" needs 4"));
  EXPECT_THAT(error("\"T\"", "\"R\""), HasSubstr("has no \"T\""));
  EXPECT_THAT(error("}]}", "}, 5]}"), HasSubstr("camera 1 of the list"));
  Random random(3);
  for (int round = 0; round < 2000; ++round) {
    std::string text = good;
    text[static_cast<size_t>(random.Below(static_cast<int64_t>(text.size())))] = static_cast<char>(random.Below(256));
    ErrorOf([&] { ParseSensorCalibration("c.json", text); });
  }
}

TEST(TablesTest, WrongFrameListsAreNamed) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseFrameListCsv("f.csv", text); }); };
  EXPECT_EQ(ParseFrameListCsv("f.csv", "frame_id,seg_id\r\n 7 ,E1\r\n")[0], (ListedFrame{"E1", 7}));
  EXPECT_THAT(error(""), HasSubstr("f.csv: is empty"));
  EXPECT_THAT(error("seg_id,frame_id\n"), HasSubstr("lists no frames"));
  EXPECT_THAT(error("segment,frame\n"), HasSubstr("f.csv:1: expected a column 'seg_id'"));
  EXPECT_THAT(error("seg_id,frame_id\nE1\n"), HasSubstr("f.csv:2: expected 2 values"));
  EXPECT_THAT(error("seg_id,frame_id\nE1,-4\n"), HasSubstr("expected frame numbers, found '-4'"));
  EXPECT_THAT(error("seg_id,frame_id\n../x,4\n"), HasSubstr("cannot have the name"));
  EXPECT_THAT(ParseFrameSplitsCsv("s", "frame,split\n1,train\n2,test\n", "g", ""),
              ElementsAre(ListedFrame{"all", 1}, ListedFrame{"test_all", 2}));
}

}  // namespace
}  // namespace likeness
