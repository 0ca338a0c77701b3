#include "likeness/viewer/directions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Smaller deviations than this share of the largest one are rounding.
constexpr double kLeastDeviation = 1e-4;

// The frame whose offset from the mean has the smallest angle with a direction.
const FrameCode& MostSimilar(const std::vector<const FrameCode*>& codes, const Eigen::MatrixXd& offsets,
                             const Eigen::VectorXd& direction) {
  const Eigen::VectorXd lengths = offsets.rowwise().norm().cwiseMax(1e-12);
  Eigen::Index best = 0;
  (offsets * direction).cwiseQuotient(lengths).maxCoeff(&best);
  return *codes[static_cast<size_t>(best)];
}

std::string NameOf(const FrameCode& frame) { return frame.segment + "/" + frame.frame; }

}  // namespace

std::vector<CodeDirection> FindDirections(const std::vector<const FrameCode*>& codes, std::span<const float> mean,
                                          std::span<const float> jacobian) {
  const auto latent = static_cast<Eigen::Index>(mean.size()), count = static_cast<Eigen::Index>(codes.size());
  LIKENESS_CHECK(latent > 0 && jacobian.size() % (3 * mean.size()) == 0);
  if (count < 2) return {};
  Eigen::MatrixXd offsets(count, latent);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::vector<float>& mu = codes[static_cast<size_t>(i)]->mu;
    for (Eigen::Index k = 0; k < latent; ++k) offsets(i, k) = static_cast<double>(mu[k]) - mean[k];
  }
  const Eigen::MatrixXd covariance = offsets.transpose() * offsets / static_cast<double>(count);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> mm_per_unit(
      jacobian.data(), static_cast<Eigen::Index>(jacobian.size() / mean.size()), latent);
  const double vertices = static_cast<double>(jacobian.size()) / (3 * static_cast<double>(mean.size()));
  const double largest = std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
  std::vector<CodeDirection> directions;
  for (Eigen::Index i = 0; i < latent; ++i) {
    const double deviation = std::sqrt(std::max(0.0, solver.eigenvalues()[i]));
    if (deviation == 0 || deviation < kLeastDeviation * largest) continue;
    Eigen::VectorXd step = deviation * solver.eigenvectors().col(i);
    // An eigenvector's sign means nothing: plus is where the frame that lies the farthest is.
    const Eigen::VectorXd along = offsets * step;
    if (along.maxCoeff() < -along.minCoeff()) step = -step;
    const Eigen::VectorXf step_f = step.cast<float>();
    CodeDirection direction;
    direction.step.assign(step_f.data(), step_f.data() + latent);
    direction.movement_mm = (mm_per_unit * step_f).cast<double>().norm() / std::sqrt(vertices);
    direction.plus = NameOf(MostSimilar(codes, offsets, step));
    direction.minus = NameOf(MostSimilar(codes, offsets, -step));
    directions.push_back(std::move(direction));
  }
  std::stable_sort(directions.begin(), directions.end(),
                   [](const auto& a, const auto& b) { return a.movement_mm > b.movement_mm; });
  return directions;
}

}  // namespace likeness
