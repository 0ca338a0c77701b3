#include "likeness/capture/undistort.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"

namespace likeness {
namespace {

constexpr int kRowsAtOnce = 16;

// Calls body(y) for all rows, on all threads.
template <typename Body>
void ForRows(int height, const Body& body) {
  ParallelFor((height + kRowsAtOnce - 1) / kRowsAtOnce, [&](int64_t chunk) {
    const int first = static_cast<int>(chunk) * kRowsAtOnce;
    for (int y = first; y < std::min(height, first + kRowsAtOnce); ++y) body(y);
  });
}

}  // namespace

Undistorter::Undistorter(const DistortedCamera& source, const Camera& target)
    : source_width_(source.camera.width), source_height_(source.camera.height), valid_(target.width, target.height, 1) {
  LIKENESS_CHECK(source_width_ >= 2 && source_height_ >= 2 && target.width >= 1 && target.height >= 1);
  FindSamples(source, target);
  FindPositions(source, target);
}

// Enough samples that neighbours are at most a source pixel and a quarter apart, so that nothing is skipped over.
void Undistorter::FindSamples(const DistortedCamera& source, const Camera& target) {
  constexpr int kGrid = 32, kMost = 16;
  const LensRange range(source.lens);
  const Eigen::Matrix3d ideal_from_target = target.intrinsics.inverse();
  double largest_step = 1;  // source pixels a target pixel
  for (int j = 0; j <= kGrid; ++j) {
    for (int i = 0; i <= kGrid; ++i) {
      const Eigen::Vector3d pixel(i * target.width / static_cast<double>(kGrid),
                                  j * target.height / static_cast<double>(kGrid), 1);
      const Eigen::Vector2d ideal = (ideal_from_target * pixel).head<2>();
      if (!range.Contains(ideal)) continue;
      const Eigen::Matrix2d step = source.camera.intrinsics.topLeftCorner<2, 2>() * source.lens.Jacobian(ideal) *
                                   ideal_from_target.topLeftCorner<2, 2>();
      largest_step = std::max(largest_step, Eigen::JacobiSVD<Eigen::Matrix2d>(step).singularValues()[0]);
    }
  }
  samples_ = static_cast<int>(std::clamp(std::ceil(largest_step / 1.25), 1.0, static_cast<double>(kMost)));
}

void Undistorter::FindPositions(const DistortedCamera& source, const Camera& target) {
  positions_.resize(static_cast<size_t>(target.width) * target.height * samples());
  const LensRange range(source.lens);
  const Eigen::Matrix3d ideal_from_target = target.intrinsics.inverse();
  std::atomic<bool> all_valid = true;
  ForRows(target.height, [&](int y) {
    for (int x = 0; x < target.width; ++x) {
      Position* position = positions_.data() + (static_cast<size_t>(y) * target.width + x) * samples();
      bool valid = true;
      for (int s = 0; s < samples() && valid; ++s) {
        const int column = s % samples_, row = s / samples_;
        const Eigen::Vector3d pixel(x + (column + 0.5) / samples_, y + (row + 0.5) / samples_, 1);
        const Eigen::Vector2d ideal = (ideal_from_target * pixel).head<2>();
        const Eigen::Vector2d at =
            (source.camera.intrinsics * source.lens.Distort(ideal).homogeneous()).head<2>() - Eigen::Vector2d(0.5, 0.5);
        // A thousandth of a pixel for the rounding of what lies on the border.
        valid = range.Contains(ideal) && at.x() >= -1e-3 && at.y() >= -1e-3 && at.x() <= source_width_ - 1 + 1e-3 &&
                at.y() <= source_height_ - 1 + 1e-3;
        if (!valid) break;
        position[s].x = static_cast<float>(std::clamp(at.x(), 0.0, source_width_ - 1.0));
        position[s].y = static_cast<float>(std::clamp(at.y(), 0.0, source_height_ - 1.0));
      }
      *valid_.at(x, y) = valid ? 255 : 0;
      if (!valid) all_valid = false;
    }
  });
  all_valid_ = all_valid;
}

ImageU8 Undistorter::Undistort(const ImageU8& image) const {
  LIKENESS_CHECK(image.width() == source_width_ && image.height() == source_height_ && image.channels() <= 4);
  const int channels = image.channels();
  const float weight = 1.0f / static_cast<float>(samples());
  ImageU8 result(valid_.width(), valid_.height(), channels);
  ForRows(result.height(), [&](int y) {
    for (int x = 0; x < result.width(); ++x) {
      if (*valid_.at(x, y) == 0) continue;
      float sums[4] = {};
      const Position* position = At(x, y);
      for (int s = 0; s < samples(); ++s) {
        const int left = std::min(static_cast<int>(position[s].x), source_width_ - 2);
        const int top = std::min(static_cast<int>(position[s].y), source_height_ - 2);
        const float right = position[s].x - static_cast<float>(left), lower = position[s].y - static_cast<float>(top);
        const uint8_t* above = image.at(left, top);
        const uint8_t* below = image.at(left, top + 1);
        const float w11 = right * lower, w10 = right - w11, w01 = lower - w11, w00 = 1 - right - w01;
        for (int c = 0; c < channels; ++c) {
          sums[c] += w00 * above[c] + w10 * above[channels + c] + w01 * below[c] + w11 * below[channels + c];
        }
      }
      for (int c = 0; c < channels; ++c) result.at(x, y)[c] = static_cast<uint8_t>(sums[c] * weight + 0.5f);
    }
  });
  return result;
}

ImageU8 Undistorter::UndistortMask(const ImageU8& mask) const {
  LIKENESS_CHECK(mask.channels() == 1);
  ImageU8 result = Undistort(mask);
  // A mean of 255 rounds to it only when no pixel is much darker; masks have no values in between.
  for (uint8_t& value : result.values()) value = value == 255 ? 255 : 0;
  return result;
}

bool IsSameImage(const DistortedCamera& source, const Camera& target) {
  return source.lens.IsPinhole() && source.camera.width == target.width && source.camera.height == target.height &&
         source.camera.intrinsics == target.intrinsics;
}

}  // namespace likeness
