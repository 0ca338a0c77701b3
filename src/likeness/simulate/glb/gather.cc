#include "likeness/simulate/glb/gather.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace likeness {
namespace {

using Eigen::Vector3f;

}  // namespace

Gathered GatherParts(const GltfScene& scene, const ShapeMap& map) {
  Gathered all;
  all.shapes.resize(kExpressionCount);
  Eigen::Index count = 0;
  for (const GltfPart& part : scene.parts) count += part.positions.rows();
  all.positions.resize(count, 3);
  int first = 0;
  for (const GltfPart& part : scene.parts) {
    const int rows = static_cast<int>(part.positions.rows());
    all.positions.middleRows(first, rows) = part.positions * kMmPerUnit;
    std::vector<std::string> names;
    for (const GltfMorph& morph : part.morphs) names.push_back(morph.name);
    const auto matched = MatchShapes(names, map);
    for (int k = 0; k < kExpressionCount; ++k) {
      std::map<int, Vector3f> moved;
      for (const ShapeTerm& term : matched[k]) {
        const GltfMorph& morph = part.morphs[term.target];
        for (size_t i = 0; i < morph.vertices.size(); ++i) {
          const auto [it, added] = moved.try_emplace(morph.vertices[i], Vector3f::Zero());
          it->second += term.weight * kMmPerUnit * morph.deltas[i];
        }
      }
      for (const auto& [vertex, delta] : moved) {
        all.shapes[k].vertices.push_back(first + vertex);
        all.shapes[k].deltas.push_back(delta);
      }
    }
    ModelSurface surface;
    const std::string material = part.material < 0 ? "" : scene.materials[part.material].name;
    surface.name = part.mesh.empty() ? part.node : part.mesh;
    surface.kind = KindFromNames(part.mesh, part.node, material);
    surface.material = part.material;
    surface.uvs = part.uvs;
    surface.triangle_uvs = part.triangles;
    for (const Eigen::Vector3i& t : part.triangles) surface.triangles.emplace_back(t.array() + first);
    all.surfaces.push_back(std::move(surface));
    first += rows;
  }
  return all;
}

// Makes one vertex of those of the same kind of part that lie in one place and move alike.
void JoinSeams(Gathered* all) {
  constexpr float kGridMm = 0.005f;
  const auto on_grid = [](float mm) { return std::llround(mm / kGridMm); };
  std::vector<uint64_t> motion(static_cast<size_t>(all->positions.rows()), 0);
  for (int k = 0; k < kExpressionCount; ++k) {
    const Target& shape = all->shapes[k];
    for (size_t i = 0; i < shape.vertices.size(); ++i) {
      uint64_t& hash = motion[static_cast<size_t>(shape.vertices[i])];
      for (int c = 0; c < 3; ++c) {
        // Tiny motions round to nothing and leave the hash as it is.
        const int64_t step = on_grid(shape.deltas[i][c]);
        if (step != 0) hash = (hash ^ static_cast<uint64_t>(step * 3 + c + 1000003 * k)) * 0x9E3779B97F4A7C15u;
      }
    }
  }
  std::map<std::tuple<int, int64_t, int64_t, int64_t, uint64_t>, int> index;
  std::vector<int> joined(static_cast<size_t>(all->positions.rows()), -1), source;
  for (ModelSurface& surface : all->surfaces) {
    for (Eigen::Vector3i& t : surface.triangles) {
      for (int& v : t) {
        if (joined[v] < 0) {
          const Vector3f p = all->positions.row(v);
          const auto key = std::tuple(static_cast<int>(surface.kind), on_grid(p.x()), on_grid(p.y()), on_grid(p.z()),
                                      motion[static_cast<size_t>(v)]);
          const auto [it, added] = index.try_emplace(key, static_cast<int>(source.size()));
          if (added) source.push_back(v);
          joined[v] = it->second;
        }
        v = joined[v];
      }
    }
  }
  Vertices positions(static_cast<Eigen::Index>(source.size()), 3);
  for (size_t i = 0; i < source.size(); ++i)
    positions.row(static_cast<Eigen::Index>(i)) = all->positions.row(source[i]);
  all->positions = std::move(positions);
  for (Target& shape : all->shapes) {
    Target kept;
    for (size_t i = 0; i < shape.vertices.size(); ++i) {
      const int v = joined[shape.vertices[i]];
      if (v < 0 || source[v] != shape.vertices[i]) continue;
      kept.vertices.push_back(v);
      kept.deltas.push_back(shape.deltas[i]);
    }
    shape = std::move(kept);
  }
}

std::vector<int> VerticesOf(const std::vector<Eigen::Vector3i>& triangles) {
  std::set<int> used;
  for (const Eigen::Vector3i& t : triangles) used.insert({t[0], t[1], t[2]});
  return {used.begin(), used.end()};
}

}  // namespace likeness
