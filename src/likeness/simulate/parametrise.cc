#include "likeness/simulate/parametrise.h"

#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Mean square stretch of the map from the plane to the surface over one triangle: large where texels are too few.
double StretchSquared(const Eigen::Vector2d p[3], const Eigen::Vector3d q[3]) {
  const double twice_area =
      (p[1].x() - p[0].x()) * (p[2].y() - p[0].y()) - (p[2].x() - p[0].x()) * (p[1].y() - p[0].y());
  if (std::abs(twice_area) < 1e-14) return 1e14;
  const Eigen::Vector3d ds =
      (q[0] * (p[1].y() - p[2].y()) + q[1] * (p[2].y() - p[0].y()) + q[2] * (p[0].y() - p[1].y())) / twice_area;
  const Eigen::Vector3d dt =
      (q[0] * (p[2].x() - p[1].x()) + q[1] * (p[0].x() - p[2].x()) + q[2] * (p[1].x() - p[0].x())) / twice_area;
  return (ds.squaredNorm() + dt.squaredNorm()) / 2;
}

struct Stretch {
  std::vector<double> vertices;  // root of the mean square stretch around each vertex, weighted by area
  double all = 0;                // likewise of the whole disc
};

Stretch MeasureStretch(const Disc& disc, const std::vector<Eigen::Vector2d>& uv) {
  std::vector<double> sum(uv.size(), 0), weight(uv.size(), 0);
  double whole_sum = 0, whole_weight = 0;
  for (size_t f = 0; f < disc.faces.size(); ++f) {
    if (disc.density[f] <= 0) continue;
    const std::vector<int>& face = disc.faces[f];
    for (size_t k = 2; k < face.size(); ++k) {
      const int corners[3] = {face[0], face[k - 1], face[k]};
      Eigen::Vector2d p[3];
      Eigen::Vector3d q[3];
      for (int c = 0; c < 3; ++c) {
        p[c] = uv[corners[c]];
        q[c] = disc.positions[corners[c]].cast<double>() * double{disc.density[f]};
      }
      const double area = (q[1] - q[0]).cross(q[2] - q[0]).norm() / 2;
      const double stretch = StretchSquared(p, q);
      whole_sum += area * stretch;
      whole_weight += area;
      for (const int v : face) {
        sum[v] += area * stretch;
        weight[v] += area;
      }
    }
  }
  for (size_t v = 0; v < uv.size(); ++v) sum[v] = weight[v] > 0 ? std::sqrt(sum[v] / weight[v]) : 0;
  return {sum, std::sqrt(whole_sum / whole_weight)};
}

}  // namespace

std::vector<Eigen::Vector2f> MapDiscToRectangle(const Disc& disc, int rounds) {
  LIKENESS_CHECK(disc.faces.size() == disc.density.size());
  const int count = static_cast<int>(disc.positions.size());
  std::vector<std::map<int, double>> weights(count);
  for (const std::vector<int>& face : disc.faces) {
    for (size_t k = 0; k < face.size(); ++k) {
      const int a = face[k], b = face[(k + 1) % face.size()];
      weights[a][b] = weights[b][a] = 1;
    }
  }
  std::vector<Eigen::Vector2d> uv(count, Eigen::Vector2d::Zero());
  std::vector<bool> fixed(count, false);
  for (const auto& [vertex, point] : disc.border) {
    uv[vertex] = point.cast<double>();
    fixed[vertex] = true;
  }
  std::vector<int> unknown(count, -1);
  int unknowns = 0;
  for (int v = 0; v < count; ++v) {
    if (!fixed[v]) unknown[v] = unknowns++;
  }

  std::vector<Eigen::Vector2d> best;
  int best_round = 0;
  double best_stretch = std::numeric_limits<double>::infinity();
  for (int round = 0;; ++round) {
    std::vector<Eigen::Triplet<double>> triplets;
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(unknowns, 2);
    for (int v = 0; v < count; ++v) {
      if (fixed[v]) continue;
      double sum = 0;
      for (const auto& [other, weight] : weights[v]) sum += weight;
      LIKENESS_CHECK(sum > 0);
      triplets.emplace_back(unknown[v], unknown[v], 1);
      for (const auto& [other, weight] : weights[v]) {
        if (fixed[other]) {
          right.row(unknown[v]) += weight / sum * uv[other].transpose();
        } else {
          triplets.emplace_back(unknown[v], unknown[other], -weight / sum);
        }
      }
    }
    Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    const Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(matrix);
    LIKENESS_CHECK(solver.info() == Eigen::Success);
    const Eigen::MatrixX2d solution = solver.solve(right);
    for (int v = 0; v < count; ++v) {
      if (!fixed[v]) uv[v] = solution.row(unknown[v]);
    }
    const Stretch measured = MeasureStretch(disc, uv);
    if (measured.all < best_stretch) {
      best_stretch = measured.all;
      best = uv;
      best_round = round;
    }
    constexpr int kPatience = 3;
    if (round == rounds || round >= best_round + kPatience) break;

    const std::vector<double>& stretch = measured.vertices;
    double mean = 0;
    int used = 0;
    for (const double s : stretch) {
      if (s > 0) mean += std::log(s), ++used;
    }
    mean = std::exp(mean / std::max(used, 1));
    for (int v = 0; v < count; ++v) {
      for (auto& [other, weight] : weights[v]) {
        if (stretch[other] > 0) weight /= std::clamp(std::sqrt(stretch[other] / mean), 0.25, 4.0);
      }
    }
  }
  std::vector<Eigen::Vector2f> result(count);
  for (int v = 0; v < count; ++v) result[v] = best[v].cast<float>();
  return result;
}

}  // namespace likeness
