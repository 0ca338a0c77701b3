#include "likeness/simulate/glb/triangles.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace likeness {
namespace {

uint64_t Key(int a, int b) { return (uint64_t{static_cast<uint32_t>(a)} << 32) | static_cast<uint32_t>(b); }

}  // namespace

EdgeMap::EdgeMap(const std::vector<Eigen::Vector3i>& triangles) {
  left_.reserve(3 * triangles.size());
  for (size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) left_.try_emplace(Key(triangles[t][k], triangles[t][(k + 1) % 3]), static_cast<int>(t));
  }
}

int EdgeMap::Left(int a, int b) const {
  const auto found = left_.find(Key(a, b));
  return found == left_.end() ? -1 : found->second;
}

std::vector<int> ManifoldSubset(const std::vector<Eigen::Vector3i>& triangles) {
  std::unordered_map<uint64_t, int> left;
  std::vector<int> kept;
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Eigen::Vector3i& t = triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    if (left.contains(Key(t[0], t[1])) || left.contains(Key(t[1], t[2])) || left.contains(Key(t[2], t[0]))) continue;
    for (int k = 0; k < 3; ++k) left[Key(t[k], t[(k + 1) % 3])] = 1;
    kept.push_back(static_cast<int>(i));
  }
  return kept;
}

std::vector<std::vector<int>> BorderLoops(const std::vector<Eigen::Vector3i>& triangles) {
  const EdgeMap edges(triangles);
  std::map<int, std::vector<int>> next;  // ordered, so that loops come in the same order everywhere
  for (const Eigen::Vector3i& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      if (edges.Left(t[(k + 1) % 3], t[k]) < 0) next[t[k]].push_back(t[(k + 1) % 3]);
    }
  }
  std::vector<std::vector<int>> loops;
  for (auto& [start, others] : next) {
    while (!others.empty()) {
      std::vector<int> path = {start};
      while (true) {
        std::vector<int>& ways = next[path.back()];
        if (ways.empty()) break;
        const int v = ways.back();
        ways.pop_back();
        const auto before = std::find(path.begin(), path.end(), v);
        if (before == path.end()) {
          path.push_back(v);
          continue;
        }
        loops.emplace_back(before, path.end());
        path.erase(before + 1, path.end());
        if (path.size() == 1) break;
      }
    }
  }
  return loops;
}

std::vector<int> ConnectedPieces(const std::vector<Eigen::Vector3i>& triangles, int vertex_count) {
  std::vector<int> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Eigen::Vector3i& t : triangles) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  std::vector<int> piece, number(vertex_count, -1);
  int count = 0;
  for (const Eigen::Vector3i& t : triangles) {
    int& n = number[root(t[0])];
    if (n < 0) n = count++;
    piece.push_back(n);
  }
  return piece;
}

}  // namespace likeness
