#include "likeness/simulate/glb/glb_head.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/simulate/glb/closed_surface.h"
#include "likeness/simulate/glb/glb_material.h"
#include "likeness/simulate/glb/surface_atlas.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

class GlbHead : public Head {
 public:
  GlbHead(const std::filesystem::path& path, const GltfScene& scene, const ShapeMap& map);

  const std::string& name() const override { return name_; }
  const std::vector<Surface>& surfaces() const override { return surfaces_; }
  const MeshTopology& tracked_topology() const override { return tracked_topology_; }
  PosedHead Pose(std::span<const float, kExpressionCount> weights) const override;

 private:
  // A skin vertex that must not cut into an eye.
  struct NearEye {
    int vertex;
    float least;  // distance from the eye's centre, mm
  };

  std::string name_;
  HeadModel model_;
  std::vector<Surface> surfaces_;
  std::vector<std::vector<int>> surface_vertices_;  // for each surface's vertices the model's
  std::vector<Eigen::Vector3i> all_triangles_;      // for normals across surfaces
  std::array<std::vector<NearEye>, 2> near_eyes_;
  ClosedSurface tracked_;
  MeshTopology tracked_topology_;
};

// Moves each triangle's coordinates by whole numbers to where its texture is. Returns how many triangles repeat it.
int UnrepeatUvs(MeshTopology* topology) {
  std::map<std::tuple<int, int, int>, int> moved;
  int repeating = 0;
  for (Eigen::Vector3i& corners : topology->triangle_uvs) {
    Vector2f low = topology->uvs[corners[0]], high = low;
    for (const int uv : corners) {
      low = low.cwiseMin(topology->uvs[uv]);
      high = high.cwiseMax(topology->uvs[uv]);
    }
    const Eigen::Vector2i shift = ((low + high) / 2).array().floor().cast<int>();
    constexpr float kTolerance = 0.01f;
    if ((high - low).maxCoeff() > 1 + kTolerance) ++repeating;
    if (shift.isZero()) continue;
    for (int& uv : corners) {
      const auto [it, added] = moved.try_emplace({uv, shift.x(), shift.y()}, static_cast<int>(topology->uvs.size()));
      if (added) topology->uvs.push_back(topology->uvs[uv] - shift.cast<float>());
      uv = it->second;
    }
  }
  return repeating;
}

template <typename T>
void Crop(const Eigen::AlignedBox2i& box, int parts, Image<T>* image) {
  if (image->empty() || image->width() < parts) return;
  const int x0 = box.min().x() * image->width() / parts, x1 = box.max().x() * image->width() / parts;
  const int y0 = image->height() - box.max().y() * image->height() / parts;
  const int y1 = image->height() - box.min().y() * image->height() / parts;
  Image<T> part(x1 - x0, y1 - y0, image->channels());
  for (int y = y0; y < y1; ++y) std::copy_n(image->at(x0, y), (x1 - x0) * image->channels(), part.row(y - y0));
  *image = std::move(part);
}

// Models often keep one large texture for all of a body: each surface takes what it uses of it.
void CropTextures(Surface* surface) {
  constexpr int kParts = 32;
  Material& material = surface->material;
  const auto divides = [](int width, int height) {
    return width == 1 || (width % kParts == 0 && height % kParts == 0 && height >= kParts);
  };
  if (!divides(material.albedo.width(), material.albedo.height())) return;
  for (const ImageF* map : {&material.normal_map, &material.roughness_map, &material.specular_map}) {
    if (!map->empty() && (map->width() == 1 || !divides(map->width(), map->height()))) return;
  }
  if (material.albedo.width() == 1 && !material.normal_map.empty()) return;
  Eigen::AlignedBox2f used;
  MeshTopology& topology = surface->topology;
  for (const Eigen::Vector3i& corners : topology.triangle_uvs) {
    for (const int uv : corners) used.extend(topology.uvs[uv]);
  }
  constexpr float kMargin = 0.004f;
  const auto grid = [&](float value) { return std::clamp(static_cast<int>(std::floor(value)), 0, kParts - 1); };
  const Eigen::AlignedBox2i box(
      Eigen::Vector2i(grid((used.min().x() - kMargin) * kParts), grid((used.min().y() - kMargin) * kParts)),
      Eigen::Vector2i(grid((used.max().x() + kMargin) * kParts) + 1, grid((used.max().y() + kMargin) * kParts) + 1));
  Crop(box, kParts, &material.albedo);
  Crop(box, kParts, &material.normal_map);
  Crop(box, kParts, &material.roughness_map);
  Crop(box, kParts, &material.specular_map);
  const Vector2f low = box.min().cast<float>() / kParts;
  const Vector2f size = box.sizes().cast<float>() / kParts;
  for (Vector2f& uv : topology.uvs) uv = (uv - low).cwiseQuotient(size);
}

GlbHead::GlbHead(const std::filesystem::path& path, const GltfScene& scene, const ShapeMap& map)
    : name_(path.filename().string()), model_(BuildHeadModel(path, scene, map)) {
  tracked_ = CloseSurface(path, model_);
  const Vertices& rest = model_.shapes.rest();
  const SurfaceAtlas atlas = MakeSurfaceAtlas(path, tracked_, tracked_.Positions(rest, model_.eyes), model_);
  tracked_topology_ = {tracked_.vertex_count, atlas.uvs, tracked_.triangles, atlas.triangle_uvs};
  tracked_topology_.Check(path.string());

  int repeating = 0;
  for (const ModelSurface& source : model_.surfaces) {
    Surface surface;
    surface.name = source.name;
    surface.material = MakeMaterial(path, scene, source.material, source.kind);
    std::map<int, int> index;
    std::vector<int> vertices;
    for (const Eigen::Vector3i& t : source.triangles) {
      Eigen::Vector3i local;
      for (int k = 0; k < 3; ++k) {
        const auto [it, added] = index.try_emplace(t[k], static_cast<int>(vertices.size()));
        if (added) vertices.push_back(t[k]);
        local[k] = it->second;
      }
      surface.topology.triangles.push_back(local);
      all_triangles_.push_back(t);
    }
    surface.topology.vertex_count = static_cast<int>(vertices.size());
    surface.topology.uvs = source.uvs;
    surface.topology.triangle_uvs = source.triangle_uvs;
    repeating += UnrepeatUvs(&surface.topology);
    CropTextures(&surface);
    surface.topology.Check(path.string());
    surfaces_.push_back(std::move(surface));
    surface_vertices_.push_back(std::move(vertices));
    if (source.kind != PartKind::kSkin) continue;
    for (const int v : surface_vertices_.back()) {
      for (const int side : {kLeft, kRight}) {
        const ModelEye& eye = model_.eyes[side];
        const float distance = (rest.row(v).transpose() - eye.centre).norm();
        if (!eye.has_ball || distance > 1.8f * eye.radius) continue;
        near_eyes_[side].push_back({v, std::min(distance, eye.radius + kLidClearanceMm)});
      }
    }
  }

  if (!model_.missing.empty()) {
    std::string list;
    for (const std::string& name : model_.missing) list += (list.empty() ? "" : ", ") + name;
    LogInfo("{}: no shape for {}", name_, list);
  }
  if (model_.is_cut) LogInfo("{}: cut off {:.0f} mm below the eyes", name_, kCutBelowEyesMm);
  if (repeating > 0) LogWarning("{}: {} triangles repeat their texture, which is not supported", name_, repeating);
  LogInfo("{}: {} tracked vertices; atlas {}, {:.0f}% of it used{}", name_, tracked_.vertex_count,
          atlas.is_own ? "of the model" : "made anew", 100 * atlas.fill,
          atlas.is_own || atlas.own_fill == 0 ? "" : fmt::format(" (the model's own: {:.0f}%)", 100 * atlas.own_fill));
}

PosedHead GlbHead::Pose(std::span<const float, kExpressionCount> weights) const {
  Vertices all = model_.shapes.Pose(weights);
  for (const int side : {kLeft, kRight}) {
    for (const NearEye& near : near_eyes_[side]) {
      const Vector3f d = all.row(near.vertex).transpose() - model_.eyes[side].centre;
      const float distance = d.norm();
      if (distance >= near.least || distance <= 0) continue;
      all.row(near.vertex) = (model_.eyes[side].centre + d * (near.least / distance)).transpose();
    }
  }
  const Eigen::Matrix3f gaze[2] = {GazeRotation(kLeft, weights), GazeRotation(kRight, weights)};
  for (size_t v = 0; v < model_.turns.size(); ++v) {
    const int side = model_.turns[v];
    if (side < 0) continue;
    const Vector3f& centre = model_.eyes[side].centre;
    const auto row = static_cast<Eigen::Index>(v);
    all.row(row) = (centre + gaze[side] * (all.row(row).transpose() - centre)).transpose();
  }
  const Vertices normals = VertexNormals(all, all_triangles_);
  PosedHead posed;
  for (const std::vector<int>& vertices : surface_vertices_) {
    const auto count = static_cast<Eigen::Index>(vertices.size());
    Vertices some(count, 3), some_normals(count, 3);
    for (size_t i = 0; i < vertices.size(); ++i) {
      some.row(static_cast<Eigen::Index>(i)) = all.row(vertices[i]);
      some_normals.row(static_cast<Eigen::Index>(i)) = normals.row(vertices[i]);
    }
    posed.surfaces.push_back(std::move(some));
    posed.normals.push_back(std::move(some_normals));
  }
  posed.tracked = tracked_.Positions(all, model_.eyes);
  return posed;
}

}  // namespace

std::unique_ptr<Head> ParseGlbHead(const std::filesystem::path& path_for_errors, std::string_view bytes,
                                   const ReadBeside& read_beside, std::string_view shape_map_json) {
  const ShapeMap map = shape_map_json.empty() ? ShapeMap() : ParseShapeMap("the shape map", shape_map_json);
  return std::make_unique<GlbHead>(path_for_errors, ParseGltf(path_for_errors, bytes, read_beside), map);
}

std::unique_ptr<Head> ReadGlbHead(const std::filesystem::path& model, const std::filesystem::path& shape_map) {
  const ShapeMap map =
      shape_map.empty() ? ShapeMap() : ParseShapeMap(shape_map, ReadFile(shape_map, uint64_t{1} << 24));
  return std::make_unique<GlbHead>(model, ReadGltf(model), map);
}

}  // namespace likeness
