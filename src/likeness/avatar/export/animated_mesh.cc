#include "likeness/avatar/export/animated_mesh.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/geometry/mesh_distance.h"

namespace likeness {
namespace {

constexpr int kMostSamples = 200;

using Row = Eigen::Map<const Eigen::RowVectorXf>;
Row AsRow(const Vertices& vertices) { return {vertices.data(), vertices.size()}; }

struct Basis {
  Eigen::RowVectorXf mean;     // [3 V]
  Eigen::MatrixXf directions;  // [K, 3 V], orthonormal rows
};

// Principal directions of meshes [N, 3 V], the farthest-reaching first, by the small matrix of their inner products.
Basis PrincipalDirections(Eigen::MatrixXd meshes, const AnimateOptions& options) {
  const Eigen::RowVectorXd mean = meshes.colwise().mean();
  meshes.rowwise() -= mean;
  const Eigen::MatrixXd products = meshes * meshes.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(products);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0);  // rising
  const double points = static_cast<double>(meshes.size()) / 3;
  // What is smaller is rounding, without a direction of its own.
  const double least = 1e-10 * values.maxCoeff();
  double left = values.sum();
  std::vector<Eigen::RowVectorXf> rows;
  for (Eigen::Index i = values.size() - 1; i >= 0; --i) {
    const bool near = std::sqrt(std::max(0.0, left) / points) <= options.tolerance_mm;
    if (near || values[i] <= least || static_cast<int>(rows.size()) == options.most_targets) break;
    const Eigen::RowVectorXd direction = solver.eigenvectors().col(i).transpose() * meshes;
    rows.emplace_back(direction.normalized().cast<float>());
    left -= values[i];
  }
  Basis basis{mean.cast<float>(), Eigen::MatrixXf(static_cast<Eigen::Index>(rows.size()), meshes.cols())};
  for (size_t k = 0; k < rows.size(); ++k) basis.directions.row(static_cast<Eigen::Index>(k)) = rows[k];
  return basis;
}

Eigen::MatrixXd SampleMeshes(const Performance& performance, const MeshDecoder& decode, int vertices) {
  const int frames = performance.frame_count(), count = std::min(frames, kMostSamples);
  Eigen::MatrixXd meshes(count, 3 * static_cast<Eigen::Index>(vertices));
  for (int i = 0; i < count; ++i) {
    const auto frame = static_cast<int>(int64_t{i} * frames / count);
    const Vertices mesh = decode(performance.Code(frame));
    meshes.row(i) = AsRow(mesh).cast<double>();
  }
  return meshes;
}

// Scales targets so that the largest weight of each is 1, as sliders expect.
void Normalise(AnimatedMesh* mesh) {
  const size_t count = mesh->targets.size();
  for (size_t k = 0; k < count; ++k) {
    float most = 0;
    for (size_t i = k; i < mesh->weights.size(); i += count) most = std::max(most, std::abs(mesh->weights[i]));
    if (most == 0) continue;
    mesh->targets[k] *= most;
    for (size_t i = k; i < mesh->weights.size(); i += count) mesh->weights[i] /= most;
  }
}

void MeasureErrors(const Performance& performance, const MeshDecoder& decode, AnimatedMesh* mesh) {
  const std::vector<int> used = VerticesInTriangles(mesh->topology);
  double sum = 0;
  for (int frame = 0; frame < performance.frame_count(); ++frame) {
    const Vertices difference = mesh->At(frame) - decode(performance.Code(frame));
    for (const int i : used) {
      const double distance = difference.row(i).norm();
      sum += distance;
      mesh->largest_error_mm = std::max(mesh->largest_error_mm, distance);
    }
  }
  mesh->mean_error_mm = sum / static_cast<double>(used.size()) / performance.frame_count();
}

}  // namespace

void AnimateOptions::Check() const {
  if (most_targets < 1 || most_targets > 256) throw Error("an animation has 1 to 256 targets, not {}", most_targets);
  if (!(tolerance_mm >= 0)) throw Error("the tolerance is 0 mm or more, not {}", tolerance_mm);
}

Vertices AnimatedMesh::At(int frame) const {
  Vertices mesh = rest;
  for (size_t k = 0; k < targets.size(); ++k) mesh += weights[frame * targets.size() + k] * targets[k];
  return mesh;
}

AnimatedMesh Animate(const Performance& performance, const MeshDecoder& decode, const MeshTopology& topology,
                     const AnimateOptions& options) {
  options.Check();
  const Basis basis = PrincipalDirections(SampleMeshes(performance, decode, topology.vertex_count), options);
  AnimatedMesh mesh;
  mesh.topology = topology;
  mesh.rest = Eigen::Map<const Vertices>(basis.mean.data(), topology.vertex_count, 3);
  for (Eigen::Index k = 0; k < basis.directions.rows(); ++k) {
    const Eigen::RowVectorXf direction = basis.directions.row(k);
    mesh.targets.emplace_back(Eigen::Map<const Vertices>(direction.data(), topology.vertex_count, 3));
  }
  mesh.seconds = performance.seconds;
  for (int frame = 0; frame < performance.frame_count(); ++frame) {
    const Vertices decoded = decode(performance.Code(frame));
    const Eigen::VectorXf weights = basis.directions * (AsRow(decoded) - basis.mean).transpose();
    mesh.weights.insert(mesh.weights.end(), weights.begin(), weights.end());
    mesh.first_from_head.push_back(performance.world_from_head.front().Inverse() * performance.world_from_head[frame]);
  }
  Normalise(&mesh);
  MeasureErrors(performance, decode, &mesh);
  return mesh;
}

}  // namespace likeness
