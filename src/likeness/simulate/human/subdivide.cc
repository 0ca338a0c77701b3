#include "likeness/simulate/human/subdivide.h"

#include <algorithm>
#include <map>
#include <unordered_map>

#include "likeness/base/error.h"

namespace likeness {

Subdivision Subdivide(const std::vector<Quad>& quads, int vertex_count) {
  Subdivision result;
  result.coarse_count = vertex_count;
  result.coarse_quads = quads;
  std::unordered_map<uint64_t, int> edge_indices;
  std::vector<std::array<int, 4>> quad_edges(quads.size());
  for (size_t q = 0; q < quads.size(); ++q) {
    for (int k = 0; k < 4; ++k) {
      const int a = quads[q][k], b = quads[q][(k + 1) % 4];
      LIKENESS_CHECK(a >= 0 && a < vertex_count && b >= 0 && b < vertex_count);
      const auto ends = std::minmax(a, b);
      const uint64_t key = static_cast<uint64_t>(ends.first) << 32 | static_cast<uint32_t>(ends.second);
      const auto [it, added] = edge_indices.try_emplace(key, static_cast<int>(result.edges.size()));
      if (added) {
        result.edges.emplace_back(ends.first, ends.second);
        result.edge_quads.push_back(0);
      }
      ++result.edge_quads[it->second];
      quad_edges[q][k] = it->second;
    }
  }
  const int edge_base = vertex_count, face_base = edge_base + static_cast<int>(result.edges.size());
  result.fine_count = face_base + static_cast<int>(quads.size());
  for (size_t q = 0; q < quads.size(); ++q) {
    for (int k = 0; k < 4; ++k) {
      result.quads.push_back({quads[q][k], edge_base + quad_edges[q][k], face_base + static_cast<int>(q),
                              edge_base + quad_edges[q][(k + 3) % 4]});
    }
  }
  return result;
}

std::vector<int> RefineRow(const std::vector<int>& row, const Subdivision& subdivision) {
  std::map<std::pair<int, int>, int> edges;
  for (size_t e = 0; e < subdivision.edges.size(); ++e) {
    edges[subdivision.edges[e]] = subdivision.coarse_count + static_cast<int>(e);
  }
  std::vector<int> fine = {row.at(0)};
  for (size_t i = 1; i < row.size(); ++i) {
    fine.push_back(edges.at(std::minmax(row[i - 1], row[i])));
    fine.push_back(row[i]);
  }
  return fine;
}

Stencil CatmullClark(const Subdivision& s) {
  using Row = std::unordered_map<int, float>;
  const int edge_base = s.coarse_count, face_base = edge_base + static_cast<int>(s.edges.size());
  std::vector<Row> rows(s.fine_count);
  const auto add = [&](int row, const Row& other, float weight) {
    for (const auto& [column, value] : other) rows[row][column] += weight * value;
  };
  const auto add_vertex = [&](int row, int vertex, float weight) { rows[row][vertex] += weight; };

  for (size_t q = 0; q < s.coarse_quads.size(); ++q) {
    for (const int v : s.coarse_quads[q]) add_vertex(face_base + static_cast<int>(q), v, 0.25f);
  }
  // Edge points: the mean of both ends and, inside, of both face points.
  for (size_t e = 0; e < s.edges.size(); ++e) {
    const float weight = s.edge_quads[e] == 2 ? 0.25f : 0.5f;
    add_vertex(edge_base + static_cast<int>(e), s.edges[e].first, weight);
    add_vertex(edge_base + static_cast<int>(e), s.edges[e].second, weight);
  }
  for (size_t child = 0; child < s.quads.size(); ++child) {
    const auto& [corner, edge, face, previous] = s.quads[child];
    if (s.edge_quads[edge - edge_base] == 2) add(edge, rows[face], 0.25f);
  }
  // Vertex points: (F + 2 R + (n - 3) P) / n inside, where F and R are the means of face points and edge midpoints;
  // (a + 6 P + b) / 8 on a border with neighbours a and b.
  std::vector<int> valence(s.coarse_count, 0), border_valence(s.coarse_count, 0);
  for (size_t e = 0; e < s.edges.size(); ++e) {
    for (const int v : {s.edges[e].first, s.edges[e].second}) {
      ++valence[v];
      if (s.edge_quads[e] != 2) ++border_valence[v];
    }
  }
  for (int v = 0; v < s.coarse_count; ++v) {
    const float n = static_cast<float>(valence[v]);
    if (border_valence[v] == 2) {
      add_vertex(v, v, 0.75f);
    } else if (valence[v] == 0 || border_valence[v] != 0) {
      add_vertex(v, v, 1);
    } else {
      add_vertex(v, v, (n - 3) / n);
    }
  }
  for (size_t e = 0; e < s.edges.size(); ++e) {
    const auto [a, b] = s.edges[e];
    for (const auto& [v, other] : {std::pair(a, b), std::pair(b, a)}) {
      const float n = static_cast<float>(valence[v]);
      if (border_valence[v] == 2) {
        if (s.edge_quads[e] != 2) add_vertex(v, other, 0.125f);
      } else if (border_valence[v] == 0) {
        add_vertex(v, v, 1 / (n * n));
        add_vertex(v, other, 1 / (n * n));
      }
    }
  }
  for (const auto& [corner, edge, face, previous] : s.quads) {
    const float n = static_cast<float>(valence[corner]);
    if (border_valence[corner] == 0) add(corner, rows[face], 1 / (n * n));
  }

  std::vector<Eigen::Triplet<float>> triplets;
  for (int r = 0; r < s.fine_count; ++r) {
    for (const auto& [column, value] : rows[r]) triplets.emplace_back(r, column, value);
  }
  Stencil stencil(s.fine_count, s.coarse_count);
  stencil.setFromTriplets(triplets.begin(), triplets.end());
  return stencil;
}

std::vector<Eigen::Vector2f> SubdivideUvs(const Subdivision& s, const std::vector<Eigen::Vector2f>& uvs) {
  LIKENESS_CHECK(static_cast<int>(uvs.size()) == s.coarse_count);
  std::vector<Eigen::Vector2f> fine = uvs;
  for (const auto& [a, b] : s.edges) fine.push_back((uvs[a] + uvs[b]) / 2);
  for (const Quad& quad : s.coarse_quads) {
    fine.push_back((uvs[quad[0]] + uvs[quad[1]] + uvs[quad[2]] + uvs[quad[3]]) / 4);
  }
  return fine;
}

}  // namespace likeness
