// A simulated capture, published as Ava-256 publishes: AVIF with loss, K of another size, zips; read back and
// converted.

#include <gtest/gtest.h>

#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/capture/ava256/test_folder.h"
#include "likeness/capture/convert.h"
#include "likeness/image/metrics.h"
#include "likeness/simulate/simulate.h"

namespace likeness {
namespace {

// The root mean square distance of a pixel from where the mesh's vertices fall in the other capture's camera.
double ReprojectionPx(const Capture& a, const Capture& b, const FrameId& frame, const std::string& camera) {
  const TrackedFrame in_a = a.ReadTracked(frame), in_b = b.ReadTracked(frame);
  double sum = 0;
  for (Eigen::Index i = 0; i < in_a.vertices_in_head.rows(); ++i) {
    const auto at = [&](const Capture& capture, const TrackedFrame& tracked) {
      const Eigen::Vector3d point = tracked.vertices_in_head.row(i).transpose().cast<double>();
      return capture.FindCamera(camera).Project(tracked.world_from_head * point);
    };
    sum += (at(a, in_a) - at(b, in_b)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(in_a.vertices_in_head.rows()));
}

void ExpectSame(const Capture& truth, const Capture& read, double least_psnr_db) {
  ASSERT_EQ(read.frames(), truth.frames());
  ASSERT_EQ(read.cameras().size(), truth.cameras().size());
  for (const FrameId& frame : truth.frames()) {
    for (const Camera& camera : read.cameras()) {
      const Camera& source = truth.FindCamera(camera.name);
      EXPECT_LT(ReprojectionPx(truth, read, frame, camera.name), 1e-6) << camera.name;
      const ImageU8 a = truth.ReadCameraImage(frame, source), b = read.ReadCameraImage(frame, camera);
      ASSERT_TRUE(a.SameShape(b));
      const double mse = MaskedSquaredError(a, b, ImageU8(a.width(), a.height(), 1, 255)).Mean();
      EXPECT_GT(PsnrDb(mse), least_psnr_db) << camera.name;
      EXPECT_EQ(read.ReadHeadMask(frame, camera), truth.ReadHeadMask(frame, source));
    }
  }
}

TEST(Ava256SimulatedTest, ReadAndConvertedItEqualsItsSource) {
  SetQuiet(true);
  const ScratchFolder scratch;
  SimulateOptions simulate;
  simulate.out = scratch / "truth";
  simulate.head = "procedural";
  simulate.frames = 3;
  simulate.rig.cameras = 2;
  simulate.rig.held_out_cameras = 0;
  simulate.rig.width = 83;
  simulate.rig.height = 128;
  simulate.render.samples = 1;
  simulate.lights = 20;
  Simulate(simulate);
  const auto truth = OpenCapture(simulate.out);

  TestFolderOptions published;
  published.quantizer = 12;
  TestFolder(scratch / "published", published).Write(*truth);
  const auto read = OpenCapture(scratch / "published");
  EXPECT_EQ(read->layout_name(), "Ava-256");
  ExpectSame(*truth, *read, 38);

  ConvertOptions convert;
  convert.out = scratch / "converted";
  EXPECT_TRUE(ConvertCapture(*read, convert).unreadable.empty());
  ExpectSame(*truth, *OpenCapture(convert.out), 38);
}

}  // namespace
}  // namespace likeness
