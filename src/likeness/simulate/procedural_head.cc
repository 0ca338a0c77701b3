#include "likeness/simulate/procedural_head.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/simulate/procedural_shape.h"
#include "likeness/simulate/procedural_skin.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3i;

// A grid of columns x rows cells; the last column's vertices are the first one's when it is `closed`.
struct Grid {
  int columns, rows;
  bool closed;

  int VertexColumns() const { return closed ? columns : columns + 1; }
  int VertexCount() const { return VertexColumns() * (rows + 1); }
  int Vertex(int i, int j) const { return j * VertexColumns() + (closed ? i % columns : i); }
  int Uv(int i, int j) const { return j * (columns + 1) + i; }

  // Cells for which `keep(i, j)`; corners run counter-clockwise in (i, j).
  template <typename F>
  MeshTopology Topology(const F& keep) const {
    MeshTopology topology;
    topology.vertex_count = VertexCount();
    for (int j = 0; j <= rows; ++j) {
      for (int i = 0; i <= columns; ++i) {
        topology.uvs.emplace_back(static_cast<float>(i) / columns, static_cast<float>(j) / rows);
      }
    }
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        if (!keep(i, j)) continue;
        const auto add = [&](int i1, int j1, int i2, int j2, int i3, int j3) {
          topology.triangles.emplace_back(Vertex(i1, j1), Vertex(i2, j2), Vertex(i3, j3));
          topology.triangle_uvs.emplace_back(Uv(i1, j1), Uv(i2, j2), Uv(i3, j3));
        };
        // Diagonals mirror about the middle, so that the head is symmetric.
        if (i < columns / 2) {
          add(i, j, i + 1, j, i + 1, j + 1);
          add(i, j, i + 1, j + 1, i, j + 1);
        } else {
          add(i, j, i + 1, j, i, j + 1);
          add(i + 1, j, i + 1, j + 1, i, j + 1);
        }
      }
    }
    return topology;
  }
};

// Teeth: one row as an arch, u along it, v towards the gum.
constexpr Grid kTeethGrid = {48, 4, false};

Vertices TeethPositions(const ProceduralShape& shape, bool upper) {
  Vertices vertices(kTeethGrid.VertexCount(), 3);
  const Vector3d lips = ProceduralShape(std::array<float, kExpressionCount>{}).LipCentre();
  for (int j = 0; j <= kTeethGrid.rows; ++j) {
    for (int i = 0; i <= kTeethGrid.columns; ++i) {
      const double along = 2.0 * i / kTeethGrid.columns - 1, up = static_cast<double>(j) / kTeethGrid.rows;
      const double notch = 0.7 * std::pow(std::abs(std::sin(6 * std::numbers::pi * along)), 0.5);
      const double angle = 1.35 * along;
      const double height = (upper ? 0.2 : -0.4) + (upper ? 1 : -1) * 9 * up;
      const Vector3d point = lips + Vector3d(21 * std::sin(angle), height, -30 + 24 * std::cos(angle) + notch);
      vertices.row(kTeethGrid.Vertex(i, j)) = shape.MoveWithJaw(point, upper ? 0 : 1).transpose().cast<float>();
    }
  }
  return vertices;
}

// White teeth with dark gaps under pink gums.
ImageU8 PaintTeeth() {
  ImageU8 image(384, 64, 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double along = 2 * (x + 0.5) / image.width() - 1, up = 1 - (y + 0.5) / image.height();
      const double gap = std::abs(std::sin(6 * std::numbers::pi * along)) < 0.12 ? 0.6 : 1;
      const bool gum = up > 0.72 + 0.08 * std::abs(std::sin(6 * std::numbers::pi * along));
      const Eigen::Array3d colour =
          gum ? Eigen::Array3d(180, 95, 92) : Eigen::Array3d(232, 224, 204) * (gap * (1 - 0.1 * up));
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<uint8_t>(colour[c]);
    }
  }
  return image;
}

constexpr Grid kEyeGrid = {32, 24, true};

Vertices EyePositions(const ProceduralShape& shape, bool left) {
  Vertices vertices(kEyeGrid.VertexCount(), 3);
  const Vector3d centre = shape.EyeCentre(left);
  const Eigen::Matrix3d gaze = shape.Gaze(left);
  for (int j = 0; j <= kEyeGrid.rows; ++j) {
    for (int i = 0; i < kEyeGrid.columns; ++i) {
      const double angle = std::numbers::pi * (1 - static_cast<double>(j) / kEyeGrid.rows);
      const double around = 2 * std::numbers::pi * i / kEyeGrid.columns - std::numbers::pi;
      const Vector3d d(std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around), std::cos(angle));
      vertices.row(kEyeGrid.Vertex(i, j)) = (centre + kEyeballRadiusMm * (gaze * d)).transpose().cast<float>();
    }
  }
  return vertices;
}

class ProceduralHead : public Head {
 public:
  explicit ProceduralHead(const ProceduralOptions& options)
      : plain_(options.plain), grid_{40 * options.detail, 36 * options.detail, true} {
    const auto inside = [this](const GridRectangle& r, int i, int j) {
      const double p = r.P((i + 0.5) / grid_.columns), q = r.Q((j + 0.5) / grid_.rows);
      return std::abs(p) < 1 && std::abs(q) < 1;
    };
    tracked_topology_ = grid_.Topology([](int, int) { return true; });
    Surface skin;
    skin.name = "skin";
    skin.topology = plain_ ? tracked_topology_ : grid_.Topology([&](int i, int j) {
      return !inside(kLeftEyeRectangle, i, j) && !inside(kRightEyeRectangle, i, j);
    });
    skin.material.albedo = PaintProceduralSkin(options.texture_size, options.seed);
    skin.material.roughness = 0.45f;
    skin.material.scatter = {0.4f, 0.2f, 0.12f};
    surfaces_.push_back(std::move(skin));
    if (plain_) return;
    for (const bool left : {true, false}) {
      Surface eye;
      eye.name = left ? "left eye" : "right eye";
      eye.topology = kEyeGrid.Topology([](int, int) { return true; });
      eye.material.albedo = PaintProceduralEye(256, options.seed);
      eye.material.specular_f0 = 0.02f;
      eye.material.coat = 1;
      surfaces_.push_back(std::move(eye));
    }
    for (const bool upper : {true, false}) {
      Surface teeth;
      teeth.name = upper ? "upper teeth" : "lower teeth";
      teeth.topology = kTeethGrid.Topology([](int, int) { return true; });
      if (!upper) {
        // The lower row runs downwards from its edge: turn its triangles to face out.
        for (auto* list : {&teeth.topology.triangles, &teeth.topology.triangle_uvs}) {
          for (Vector3i& t : *list) std::swap(t[1], t[2]);
        }
      }
      teeth.material.albedo = PaintTeeth();
      teeth.material.coat = 0.6f;
      teeth.material.coat_roughness = 0.2f;
      surfaces_.push_back(std::move(teeth));
    }
  }

  const std::string& name() const override { return name_; }
  const std::vector<Surface>& surfaces() const override { return surfaces_; }
  const MeshTopology& tracked_topology() const override { return tracked_topology_; }

  PosedHead Pose(std::span<const float, kExpressionCount> weights) const override {
    const ProceduralShape shape(weights);
    PosedHead posed;
    posed.tracked.resize(grid_.VertexCount(), 3);
    for (int j = 0; j <= grid_.rows; ++j) {
      for (int i = 0; i < grid_.columns; ++i) {
        posed.tracked.row(grid_.Vertex(i, j)) =
            shape.Point(static_cast<double>(i) / grid_.columns, static_cast<double>(j) / grid_.rows)
                .transpose()
                .cast<float>();
      }
    }
    posed.surfaces.push_back(posed.tracked);
    if (!plain_) {
      posed.surfaces.push_back(EyePositions(shape, true));
      posed.surfaces.push_back(EyePositions(shape, false));
      posed.surfaces.push_back(TeethPositions(shape, true));
      posed.surfaces.push_back(TeethPositions(shape, false));
    }
    for (size_t i = 0; i < posed.surfaces.size(); ++i) {
      posed.normals.push_back(VertexNormals(posed.surfaces[i], surfaces_[i].topology.triangles));
    }
    return posed;
  }

 private:
  const std::string name_ = "procedural";
  const bool plain_;
  const Grid grid_;
  std::vector<Surface> surfaces_;
  MeshTopology tracked_topology_;
};

}  // namespace

void ProceduralOptions::Check() const {
  if (texture_size < 16 || texture_size > 8192) {
    throw Error("a procedural head's texture has 16 to 8192 texels a side, not {}", texture_size);
  }
  if (detail < 1 || detail > 8) throw Error("a procedural head's detail is 1 to 8, not {}", detail);
}

std::unique_ptr<Head> MakeProceduralHead(const ProceduralOptions& options) {
  options.Check();
  return std::make_unique<ProceduralHead>(options);
}

}  // namespace likeness
