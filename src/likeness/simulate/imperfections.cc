#include "likeness/simulate/imperfections.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/image/srgb.h"

namespace likeness {
namespace {

using Eigen::Vector3d;

// Tracking errors are alike this far over the surface and this long.
constexpr double kNoiseLengthMm = 25, kNoiseSeconds = 0.3;
constexpr double kRoughShare = 0.1;  // of the variance, differs from vertex to vertex and frame to frame
constexpr int kWaves = 96;

// A hundredth of the variance at mid grey is read noise, as of a sensor with a few electrons of it in two thousand.
constexpr double kReadShare = 0.01;

// Draws beyond this many standard deviations would be faults, not imperfections.
double Moderate(Random* random) { return std::clamp(random->Normal(), -2.5, 2.5); }

double ReprojectionError(const Camera& a, const Camera& b, const Vertices& points) {
  double sum = 0;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    const Vector3d p = points.row(v).transpose().cast<double>();
    sum += (a.Project(p) - b.Project(p)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.rows()));
}

// Pixels that the points spread over, from their centre: root mean square.
double SpreadPx(const Camera& camera, const Vertices& points, double* depth) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double squares = 0, depths = 0;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    const Vector3d p = points.row(v).transpose().cast<double>();
    const Eigen::Vector2d pixel = camera.Project(p);
    mean += pixel;
    squares += pixel.squaredNorm();
    depths += (camera.cam_from_world * p).z();
  }
  const auto n = static_cast<double>(points.rows());
  *depth = depths / n;
  return std::sqrt(std::max(squares / n - (mean / n).squaredNorm(), 1.0));
}

const std::array<float, 256>& LinearTable() {
  static const auto table = [] {
    std::array<float, 256> t;
    for (int i = 0; i < 256; ++i) t[i] = LinearFromSrgb(static_cast<float>(i) / 255);
    return t;
  }();
  return table;
}

// Half of a Gaussian, from its centre; the whole sums to 1.
std::vector<float> GaussianWeights(double sigma) {
  std::vector<float> weights = {1};
  if (sigma <= 0) return weights;
  const int radius = static_cast<int>(std::ceil(3.5 * sigma));
  double sum = 1;
  for (int i = 1; i <= radius; ++i) {
    const double w = std::exp(-0.5 * i * i / (sigma * sigma));
    weights.push_back(static_cast<float>(w));
    sum += 2 * w;
  }
  for (float& w : weights) w = static_cast<float>(w / sum);
  return weights;
}

// One row of the blurred image, linear; edges repeat.
void BlurRow(const ImageU8& image, int y, const std::vector<float>& weights, std::vector<float>* column,
             std::vector<float>* row) {
  const int width = image.width(), radius = static_cast<int>(weights.size()) - 1;
  const size_t values = 3 * static_cast<size_t>(width);
  column->assign(values, 0);
  for (int j = -radius; j <= radius; ++j) {
    const uint8_t* in = image.row(std::clamp(y + j, 0, image.height() - 1));
    const float w = weights[static_cast<size_t>(std::abs(j))];
    for (size_t i = 0; i < values; ++i) (*column)[i] += w * LinearTable()[in[i]];
  }
  if (radius == 0) {
    row->swap(*column);
    return;
  }
  row->assign(values, 0);
  for (int x = 0; x < width; ++x) {
    float* to = row->data() + 3 * static_cast<size_t>(x);
    for (int j = -radius; j <= radius; ++j) {
      const float* from = column->data() + 3 * static_cast<size_t>(std::clamp(x + j, 0, width - 1));
      const float w = weights[static_cast<size_t>(std::abs(j))];
      for (int c = 0; c < 3; ++c) to[c] += w * from[c];
    }
  }
}

uint8_t ToByte(double level) { return static_cast<uint8_t>(std::lround(std::clamp(level, 0.0, 255.0))); }

}  // namespace

void ImperfectionOptions::Check() const {
  const auto check = [](const char* what, double value, double most) {
    if (!(value >= 0 && value <= most)) throw Error("{} lies between 0 and {}, not at {}", what, most, value);
  };
  check("the tracking noise", tracking_noise_mm, 50);
  check("the count of smoothing iterations", tracking_smoothing, 10000);
  check("the calibration error", calibration_error_px, 500);
  check("the lens blur", lens_blur_px, 100);
  check("the exposure flicker", exposure_flicker, 0.3);
  check("the sensor noise", sensor_noise, 100);
  check("the spread of colour gains", colour_gain, 0.3);
  check("the spread of colour biases", colour_bias, 100);
}

Imperfections::Imperfections(const ImperfectionOptions& options, uint64_t seed, const MeshTopology& topology,
                             const Vertices& neutral)
    : options_(options), seed_(seed), neutral_(neutral) {
  options.Check();
  if (options.tracking_smoothing == 0) return;
  neighbours_.resize(static_cast<size_t>(topology.vertex_count));
  for (const Eigen::Vector3i& triangle : topology.triangles) {
    for (int k = 0; k < 3; ++k) {
      auto& list = neighbours_[static_cast<size_t>(triangle[k])];
      list.push_back(triangle[(k + 1) % 3]);
      list.push_back(triangle[(k + 2) % 3]);
    }
  }
  for (auto& list : neighbours_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

Camera Imperfections::Calibrated(const Camera& truth) const {
  if (options_.calibration_error_px == 0) return truth;
  Random random(seed_, Hash({Hash("calibration"), Hash(truth.name)}));
  // Each of the nine moves points by about a pixel.
  double depth_mm = 1;
  const double spread_px = SpreadPx(truth, neutral_, &depth_mm), focal_px = truth.intrinsics(0, 0);
  Vector3d turn, shift, lens;
  for (Vector3d* part : {&turn, &shift, &lens}) *part = {random.Normal(), random.Normal(), random.Normal()};
  turn = turn.cwiseQuotient(Vector3d(focal_px, focal_px, spread_px));
  shift = shift.cwiseProduct(Vector3d(depth_mm / focal_px, depth_mm / focal_px, depth_mm / spread_px));
  const auto moved = [&](double amount) {
    Camera camera = truth;
    const Vector3d axis = amount * turn;
    const RigidTransform error{Eigen::AngleAxisd(axis.norm(), axis.stableNormalized()).toRotationMatrix(),
                               amount * shift};
    // The camera turns about itself, not about the world's origin.
    camera.cam_from_world.rotation = error.rotation * truth.cam_from_world.rotation;
    camera.cam_from_world.translation = error.rotation * truth.cam_from_world.translation + error.translation;
    const double zoom = 1 + amount * lens[0] / spread_px;
    camera.intrinsics(0, 0) *= zoom;
    camera.intrinsics(1, 1) *= zoom;
    camera.intrinsics(0, 2) += amount * lens[1];
    camera.intrinsics(1, 2) += amount * lens[2];
    return camera;
  };
  // The error grows almost linearly.
  double amount = options_.calibration_error_px;
  for (int i = 0; i < 8; ++i) {
    amount *= options_.calibration_error_px / std::max(ReprojectionError(moved(amount), truth, neutral_), 1e-12);
  }
  return moved(amount);
}

// Taubin 1995: a step that shrinks and one that undoes the shrinking.
Vertices Imperfections::Smoothed(Vertices mesh) const {
  Vertices next = mesh;
  for (int i = 0; i < options_.tracking_smoothing; ++i) {
    for (const float step : {0.5f, -0.53f}) {
      for (Eigen::Index v = 0; v < mesh.rows(); ++v) {
        const std::vector<int>& around = neighbours_[static_cast<size_t>(v)];
        if (around.empty()) continue;
        Eigen::RowVector3f mean = Eigen::RowVector3f::Zero();
        for (const int n : around) mean += mesh.row(n);
        next.row(v) = mesh.row(v) + step * (mean / static_cast<float>(around.size()) - mesh.row(v));
      }
      mesh.swap(next);
    }
  }
  return mesh;
}

Vertices Imperfections::Tracked(const Vertices& truth, double time_s) const {
  LIKENESS_CHECK(truth.rows() == neutral_.rows());
  Vertices mesh = options_.tracking_smoothing > 0 ? Smoothed(truth) : truth;
  if (options_.tracking_noise_mm == 0) return mesh;
  // Of one coordinate.
  const double variance = options_.tracking_noise_mm * options_.tracking_noise_mm / 3;
  const auto wave_mm = static_cast<float>(std::sqrt(2 * (1 - kRoughShare) * variance / kWaves));
  const auto rough_mm = static_cast<float>(std::sqrt(kRoughShare * variance));
  for (int axis = 0; axis < 3; ++axis) {
    Random waves(seed_, Hash({Hash("tracking"), static_cast<uint64_t>(axis)}));
    Random rough(seed_, Hash({Hash("rough tracking"), static_cast<uint64_t>(axis),
                              static_cast<uint64_t>(std::llround(time_s * 1e6))}));
    // Waves of random direction and length add up to a field with a Gaussian covariance (Rahimi and Recht 2007).
    Eigen::ArrayXf sum = Eigen::ArrayXf::Zero(mesh.rows());
    for (int w = 0; w < kWaves; ++w) {
      const Eigen::Vector3d k =
          Vector3d(waves.Normal(), waves.Normal(), waves.Normal()) * (std::numbers::sqrt2 / kNoiseLengthMm);
      const double phase = waves.Uniform(0, 2 * std::numbers::pi) + waves.Normal() * time_s / kNoiseSeconds;
      sum += ((neutral_ * k.cast<float>()).array() + static_cast<float>(std::remainder(phase, 2 * std::numbers::pi)))
                 .cos();
    }
    for (Eigen::Index v = 0; v < mesh.rows(); ++v) {
      mesh(v, axis) += wave_mm * sum[v] + rough_mm * static_cast<float>(rough.Normal());
    }
  }
  return mesh;
}

double Imperfections::Exposure(const FrameId& frame) const {
  Random random(seed_, Hash({Hash("exposure"), Hash(frame.segment), Hash(frame.frame)}));
  return 1 + options_.exposure_flicker * Moderate(&random);
}

void Imperfections::Colours(const std::string& camera, Eigen::Array3d* gain, Eigen::Array3d* bias) const {
  Random random(seed_, Hash({Hash("colours"), Hash(camera)}));
  for (int c = 0; c < 3; ++c) {
    (*gain)[c] = 1 + options_.colour_gain * Moderate(&random);
    (*bias)[c] = options_.colour_bias * Moderate(&random);
  }
}

void Imperfections::Photograph(const FrameId& frame, const std::string& camera, ImageU8* rgb) const {
  if (!options_.OfImages()) return;
  LIKENESS_CHECK(rgb->channels() == 3);
  Eigen::Array3d gain, bias;
  Colours(camera, &gain, &bias);
  const auto exposure = static_cast<float>(Exposure(frame));
  const bool linear = options_.lens_blur_px > 0 || options_.sensor_noise > 0 || options_.exposure_flicker > 0;
  const std::vector<float> weights = GaussianWeights(options_.lens_blur_px);
  // What one level is worth in linear light at mid grey.
  const float grey = LinearFromSrgb(128.0f / 255);
  const float level = (LinearFromSrgb(129.0f / 255) - LinearFromSrgb(127.0f / 255)) / 2;
  const auto variance = static_cast<float>(std::pow(options_.sensor_noise * level, 2));
  const float shot = static_cast<float>(1 - kReadShare) * variance / grey;
  const float read = static_cast<float>(kReadShare) * variance;
  const ImageU8 sharp = weights.size() > 1 ? *rgb : ImageU8();  // a row's neighbours must not have changed
  const ImageU8& source = weights.size() > 1 ? sharp : *rgb;
  const uint64_t picture = Hash({Hash("sensor"), Hash(frame.segment), Hash(frame.frame), Hash(camera)});
  ParallelFor(rgb->height(), [&](int64_t y) {
    uint8_t* out = rgb->row(static_cast<int>(y));
    const int values = 3 * rgb->width();
    std::vector<float> column, row;
    if (linear) BlurRow(source, static_cast<int>(y), weights, &column, &row);
    Random random(seed_, Hash({picture, static_cast<uint64_t>(y)}));
    for (int i = 0; i < values; ++i) {
      double encoded = out[i];
      if (linear) {
        float light = exposure * row[static_cast<size_t>(i)];
        if (variance > 0) light += std::sqrt(shot * light + read) * static_cast<float>(random.Normal());
        encoded = 255.0 * SrgbFromLinear(std::clamp(light, 0.0f, 1.0f));
      }
      out[i] = ToByte(encoded * gain[i % 3] + bias[i % 3]);
    }
  });
}

}  // namespace likeness
