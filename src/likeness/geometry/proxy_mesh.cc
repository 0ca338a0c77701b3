#include "likeness/geometry/proxy_mesh.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr int kAround = 64, kDown = 48;  // faces of the ellipsoid; they stand off it by 0.4% of a radius at most

// -1 ... 1 in the texture to an angle around the head, 0 at the front. The front half takes 68% of the range.
double Longitude(double t) { return std::numbers::pi * (t + t * t * t) / 2; }

Eigen::Vector3d OnBall(double longitude, double polar) {
  return {std::sin(polar) * std::sin(longitude), std::cos(polar), std::sin(polar) * std::cos(longitude)};
}

}  // namespace

double Ellipsoid::RadiiOf(const Eigen::Vector3d& point) const { return from_ball.ldlt().solve(point - centre).norm(); }

Ellipsoid EnclosingEllipsoid(const Eigen::MatrixX3d& points) {
  constexpr double kTolerance = 0.01;
  constexpr int kMostSteps = 100'000;
  const Eigen::Index n = points.rows();
  if (n < 4) throw Error("an ellipsoid needs four points or more, not {}", n);
  // In the points' own axes and units, so that the sums are well conditioned.
  const Eigen::RowVector3d middle = points.colwise().mean();
  const double scale = (points.rowwise() - middle).rowwise().norm().maxCoeff();
  Eigen::Matrix4Xd lifted(4, n);
  lifted.topRows<3>() = ((points.rowwise() - middle) / scale).transpose();
  lifted.row(3).setOnes();
  const Eigen::Matrix3d spread = lifted.topRows<3>() * lifted.topRows<3>().transpose() / static_cast<double>(n);
  if (!(scale > 0) || Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues()[0] < 1e-12) {
    throw Error("an ellipsoid needs points that do not lie in a plane");
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Constant(n, 1.0 / static_cast<double>(n));
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Matrix4d moment = lifted * weight.asDiagonal() * lifted.transpose();
    const Eigen::VectorXd kappa = lifted.cwiseProduct(moment.inverse() * lifted).colwise().sum();
    Eigen::Index farthest = 0;
    const double most = kappa.maxCoeff(&farthest);
    if (most <= 4 * (1 + kTolerance)) break;
    const double share = (most - 4) / (4 * (most - 1));
    weight *= 1 - share;
    weight[farthest] += share;
  }
  const Eigen::Vector3d centre = lifted.topRows<3>() * weight;
  const Eigen::Matrix3d covariance =
      lifted.topRows<3>() * weight.asDiagonal() * lifted.topRows<3>().transpose() - centre * centre.transpose();
  Ellipsoid ellipsoid;
  ellipsoid.centre = centre * scale + middle.transpose();
  ellipsoid.from_ball = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(3 * scale * scale * covariance).operatorSqrt();
  double farthest = 0;
  for (Eigen::Index i = 0; i < n; ++i) farthest = std::max(farthest, ellipsoid.RadiiOf(points.row(i)));
  ellipsoid.from_ball *= farthest;
  return ellipsoid;
}

ProxyMesh EllipsoidMesh(const Ellipsoid& ellipsoid) {
  ProxyMesh mesh;
  MeshTopology& topology = mesh.topology;
  // The poles, then rings from top to bottom; the texture coordinates of a pole are one for each face.
  std::vector<Eigen::Vector3d> ball = {{0, 1, 0}, {0, -1, 0}};
  const auto vertex = [](int i, int j) { return j == 0 ? 0 : j == kDown ? 1 : 2 + (j - 1) * kAround + i % kAround; };
  const auto uv = [](int i, int j) { return j * (kAround + 1) + i; };
  for (int j = 0; j <= kDown; ++j) {
    for (int i = 0; i <= kAround; ++i) {
      const bool pole = j == 0 || j == kDown;
      const double u = std::min(1.0, (i + (pole ? 0.5 : 0)) / kAround);
      topology.uvs.emplace_back(static_cast<float>(u), static_cast<float>(1 - static_cast<double>(j) / kDown));
      if (!pole && i < kAround) ball.push_back(OnBall(Longitude(2 * u - 1), std::numbers::pi * j / kDown));
    }
  }
  topology.vertex_count = static_cast<int>(ball.size());
  double nearest = 1;  // face to the centre
  const auto add = [&](std::array<std::array<int, 2>, 3> corners) {
    Eigen::Vector3i vertices, uvs;
    for (int c = 0; c < 3; ++c) {
      vertices[c] = vertex(corners[c][0], corners[c][1]);
      uvs[c] = uv(corners[c][0], corners[c][1]);
    }
    const Eigen::Vector3d &a = ball[vertices[0]], &b = ball[vertices[1]], &c = ball[vertices[2]];
    nearest = std::min(nearest, (b - a).cross(c - a).normalized().dot(a));
    topology.triangles.push_back(vertices);
    topology.triangle_uvs.push_back(uvs);
  };
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAround; ++i) {
      if (j + 1 < kDown) add({{{i, j}, {i, j + 1}, {i + 1, j + 1}}});
      if (j == kDown - 1) add({{{i, j}, {i, j + 1}, {i + 1, j}}});
      if (j > 0 && j + 1 < kDown) add({{{i, j}, {i + 1, j + 1}, {i + 1, j}}});
    }
  }
  mesh.vertices.resize(topology.vertex_count, 3);
  for (int i = 0; i < topology.vertex_count; ++i) {
    mesh.vertices.row(i) = (ellipsoid.centre + ellipsoid.from_ball * ball[i] / nearest).cast<float>().transpose();
  }
  return mesh;
}

ProxyMesh BillboardMesh(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z) {
  LIKENESS_CHECK(low.x() < high.x() && low.y() < high.y());
  ProxyMesh mesh;
  mesh.topology.vertex_count = 4;
  mesh.topology.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.topology.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.topology.triangle_uvs = mesh.topology.triangles;
  Eigen::Matrix<double, 4, 3> corners;
  corners << low.x(), low.y(), z, high.x(), low.y(), z, high.x(), high.y(), z, low.x(), high.y(), z;
  mesh.vertices = corners.cast<float>();
  return mesh;
}

}  // namespace likeness
