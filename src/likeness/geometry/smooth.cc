#include "likeness/geometry/smooth.h"

#include <algorithm>
#include <array>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Neighbours of vertex i: indices[begin[i]] ... indices[begin[i + 1] - 1].
struct Neighbours {
  std::vector<int> begin, indices;
};

// An edge of one triangle alone is on a border, and so are its ends.
Neighbours FindNeighbours(int vertex_count, const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<std::array<int, 2>> edges;
  for (const Eigen::Vector3i& t : triangles) {
    for (int corner = 0; corner < 3; ++corner) {
      const int a = t[corner], b = t[(corner + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(edges.begin(), edges.end());
  struct Edge {
    int a, b;
    bool border;
  };
  std::vector<Edge> distinct;
  std::vector<bool> on_border(vertex_count, false);
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    const bool border = end - i == 1;
    distinct.push_back({edges[i][0], edges[i][1], border});
    if (border) on_border[edges[i][0]] = on_border[edges[i][1]] = true;
    i = end;
  }
  std::vector<std::vector<int>> lists(vertex_count);
  for (const Edge& edge : distinct) {
    if (edge.border || !on_border[edge.a]) lists[edge.a].push_back(edge.b);
    if (edge.border || !on_border[edge.b]) lists[edge.b].push_back(edge.a);
  }
  Neighbours neighbours;
  neighbours.begin.push_back(0);
  for (const std::vector<int>& list : lists) {
    neighbours.indices.insert(neighbours.indices.end(), list.begin(), list.end());
    neighbours.begin.push_back(static_cast<int>(neighbours.indices.size()));
  }
  return neighbours;
}

// Every vertex goes `share` of the way to the mean of its neighbours.
void Step(const Neighbours& neighbours, float share, const Vertices& from, Vertices* to) {
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    const int begin = neighbours.begin[i], end = neighbours.begin[i + 1];
    Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
    for (int n = begin; n < end; ++n) sum += from.row(neighbours.indices[n]);
    to->row(i) = from.row(i);
    if (end > begin) to->row(i) += share * (sum / static_cast<float>(end - begin) - from.row(i));
  }
}

}  // namespace

void TaubinOptions::Check() const {
  if (iterations < 0 || iterations > 1'000'000) {
    throw Error("smoothing takes 0 ... 1000000 iterations, not {}", iterations);
  }
  if (!(shrink > 0 && shrink < 1)) throw Error("a smoothing step goes more than 0 and less than 1, not {}", shrink);
  if (!(pass_band >= 0 && pass_band < 1)) throw Error("the pass band is 0 ... 1, not {}", pass_band);
}

Vertices TaubinSmooth(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                      const TaubinOptions& options) {
  options.Check();
  const Neighbours neighbours = FindNeighbours(static_cast<int>(vertices.rows()), triangles);
  const double grow = 1 / (options.pass_band - 1 / options.shrink);
  Vertices smooth = vertices, other(vertices.rows(), 3);
  for (int i = 0; i < options.iterations; ++i) {
    Step(neighbours, static_cast<float>(options.shrink), smooth, &other);
    Step(neighbours, static_cast<float>(grow), other, &smooth);
  }
  return smooth;
}

}  // namespace likeness
