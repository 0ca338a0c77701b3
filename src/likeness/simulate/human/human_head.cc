#include "likeness/simulate/human/human_head.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/simulate/human/atlas.h"
#include "likeness/simulate/human/eye.h"
#include "likeness/simulate/human/eye_paint.h"
#include "likeness/simulate/human/hair.h"
#include "likeness/simulate/human/identity.h"
#include "likeness/simulate/human/lashes.h"
#include "likeness/simulate/human/linear_shapes.h"
#include "likeness/simulate/human/pigment.h"
#include "likeness/simulate/human/skin.h"
#include "likeness/simulate/human/skin_regions.h"
#include "likeness/simulate/human/teeth.h"
#include "likeness/simulate/human/tracked_mesh.h"

namespace likeness {
namespace {

// Triangles of some of the subdivided quads as a surface of its own, and where its vertices stand among the fine ones.
struct FinePart {
  Surface surface;
  std::vector<int> fine_vertices;
};

class HumanHead : public Head {
 public:
  HumanHead(const std::filesystem::path& data_folder, const HumanRecipe& recipe);

  const std::string& name() const override { return name_; }
  const std::vector<Surface>& surfaces() const override { return surfaces_; }
  const MeshTopology& tracked_topology() const override { return tracked_.topology; }
  PosedHead Pose(std::span<const float, kExpressionCount> weights) const override;

 private:
  std::string name_;
  std::vector<Surface> surfaces_;
  std::vector<std::vector<int>> fine_vertices_;  // of the first surfaces; the others are eyes
  std::vector<Eigen::Vector3i> fine_triangles_;  // all that move linearly, for normals across surfaces
  LinearShapes fine_;
  std::array<EyeFit, 2> eyes_;
  std::array<std::vector<int>, 2> near_eyes_;  // fine vertices that must stay outside of the eye
  EyeMesh eyeball_[2], cornea_[2];
  Lashes lashes_[2];
  HairShells hair_;
  TrackedMesh tracked_;
  std::vector<float> tracked_lift_;  // mm over the skin, for each of tracked_.skin_vertices
};

FinePart MakePart(std::string name, const Subdivision& fine, size_t first_quad, size_t quad_count,
                  const Subdivision& uvs, const std::vector<Eigen::Vector2f>& fine_uvs) {
  FinePart part;
  part.surface.name = std::move(name);
  MeshTopology& topology = part.surface.topology;
  std::map<int, int> index;
  const auto local = [&](int v) {
    const auto [it, added] = index.try_emplace(v, static_cast<int>(part.fine_vertices.size()));
    if (added) part.fine_vertices.push_back(v);
    return it->second;
  };
  for (size_t child = 0; child < 4 * quad_count; ++child) {
    const Quad& q = fine.quads[4 * first_quad + child];
    const Quad& t = uvs.quads[child];
    const Quad v = {local(q[0]), local(q[1]), local(q[2]), local(q[3])};
    topology.triangles.emplace_back(v[0], v[1], v[2]);
    topology.triangles.emplace_back(v[0], v[2], v[3]);
    topology.triangle_uvs.emplace_back(t[0], t[1], t[2]);
    topology.triangle_uvs.emplace_back(t[0], t[2], t[3]);
  }
  topology.uvs = fine_uvs;
  topology.vertex_count = static_cast<int>(part.fine_vertices.size());
  topology.Check(part.surface.name);
  return part;
}

// Helper meshes keep MakeHuman's own uvs, each stretched over its texture.
FinePart MakeHelperPart(const std::string& name, const QuadPart& part, const Subdivision& fine, size_t first_quad) {
  Eigen::AlignedBox2f box;
  std::map<std::pair<float, float>, int> index;
  std::vector<Eigen::Vector2f> uvs;
  std::vector<Quad> quads;
  for (const auto& corners : part.uvs) {
    Quad quad;
    for (int k = 0; k < 4; ++k) {
      const auto [it, added] = index.try_emplace({corners[k].x(), corners[k].y()}, static_cast<int>(uvs.size()));
      if (added) uvs.push_back(corners[k]);
      box.extend(corners[k]);
      quad[k] = it->second;
    }
    quads.push_back(quad);
  }
  for (Eigen::Vector2f& uv : uvs)
    uv = (uv - box.min()).cwiseQuotient(box.sizes()) * 0.98f + Eigen::Vector2f(0.01f, 0.01f);
  const Subdivision subdivided = Subdivide(quads, static_cast<int>(uvs.size()));
  return MakePart(name, fine, first_quad, part.quads.size(), subdivided, SubdivideUvs(subdivided, uvs));
}

// The skin at rest as a sheet to paint on. The first part of `fine` is the face and the second the mouth.
SkinSheet MakeSheet(const BaseMesh& base, const Vertices& fine_rest, const Vertices& fine_average,
                    const HeadAtlas& atlas, const FinePart& skin) {
  SkinSheet sheet;
  sheet.topology = &skin.surface.topology;
  const auto count = static_cast<Eigen::Index>(skin.fine_vertices.size());
  sheet.points.resize(count, 3);
  sheet.average.resize(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    sheet.points.row(i) = fine_rest.row(skin.fine_vertices[i]);
    sheet.average.row(i) = fine_average.row(skin.fine_vertices[i]) - kRegionOrigin.transpose();
  }
  for (const QuadPart* part : {&base.face, &base.mouth}) {
    if (part == &base.mouth) sheet.first_mouth_triangle = static_cast<int>(sheet.makehuman_uvs.size());
    for (const auto& corners : part->uvs) {
      const Eigen::Vector2f centre = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2f next = (corners[k] + corners[(k + 1) % 4]) / 2;
        const Eigen::Vector2f previous = (corners[(k + 3) % 4] + corners[k]) / 2;
        sheet.makehuman_uvs.push_back({corners[k], next, centre});
        sheet.makehuman_uvs.push_back({corners[k], centre, previous});
      }
    }
  }
  for (const SlitLoop& lids : atlas.lids) {
    for (const std::vector<int>* row : {&lids.upper, &lids.lower}) {
      for (size_t i = 0; i < row->size(); ++i) {
        const Eigen::Vector3f here = fine_average.row((*row)[i]);
        sheet.lid_rims.push_back(here - kRegionOrigin);
        if (i + 1 == row->size()) break;
        const Eigen::Vector3f next = fine_average.row((*row)[i + 1]);
        sheet.lid_rims.push_back((here + next) / 2 - kRegionOrigin);
      }
    }
  }
  return sheet;
}

ImageU8 Plain(uint8_t r, uint8_t g, uint8_t b) {
  ImageU8 image(1, 1, 3);
  image.at(0, 0)[0] = r, image.at(0, 0)[1] = g, image.at(0, 0)[2] = b;
  return image;
}

// The row of fine vertices next to a lid's inner edge: its front edge, where lashes grow.
std::vector<int> FrontRim(const BaseMesh& base, const std::vector<int>& lid, const Subdivision& fine) {
  std::vector<int> rim;
  for (size_t i = 0; i + 1 < lid.size(); ++i) {
    for (const Quad& quad : base.face.quads) {
      for (int k = 0; k < 4; ++k) {
        const int a = quad[k], b = quad[(k + 1) % 4], c = quad[(k + 2) % 4], d = quad[(k + 3) % 4];
        const bool forward = a == lid[i] && b == lid[i + 1], backward = b == lid[i] && a == lid[i + 1];
        if (!forward && !backward) continue;
        if (rim.empty()) rim.push_back(forward ? d : c);
        rim.push_back(forward ? c : d);
      }
    }
  }
  LIKENESS_CHECK(rim.size() == lid.size());
  return RefineRow(rim, fine);
}

Material LashMaterial(const HumanRecipe& recipe) {
  const Eigen::Vector3f hair = HairColour(static_cast<float>(std::min(1.0, recipe.hair_melanin + 0.25)), 0.1f, 0);
  Material material;
  material.albedo = ImageU8(1, 1, 4);
  for (int c = 0; c < 3; ++c) material.albedo.at(0, 0)[c] = EncodeSrgb(0.6f * hair[c]);
  // Blades are wider than lashes, or samples would miss most of them, and let as much more through.
  material.albedo.at(0, 0)[3] = static_cast<uint8_t>(255 * Lashes::kCoverage);
  material.roughness = 0.5f;
  material.casts_shadow = false;
  return material;
}

HumanHead::HumanHead(const std::filesystem::path& data_folder, const HumanRecipe& recipe) : name_(recipe.name) {
  recipe.Check(recipe.name);
  const BaseMesh base = ReadBaseMesh(data_folder);
  const Identity identity = ShapeIdentity(base, data_folder, recipe);
  const std::vector<Target> targets = ReadExpressionTargets(data_folder, static_cast<int>(base.vertices.rows()));
  const HeadAtlas atlas = BuildAtlas(base);
  eyes_ = identity.eyes;

  // One subdivision of all that moves linearly.
  std::vector<Quad> quads;
  const auto append = [&](const QuadPart& part) {
    const size_t first = quads.size();
    quads.insert(quads.end(), part.quads.begin(), part.quads.end());
    return first;
  };
  append(base.face);
  append(base.mouth);
  const size_t skin_quads = quads.size();
  const size_t first_socket[2] = {append(base.sockets[0]), append(base.sockets[1])};
  const size_t first_tongue = append(base.tongue);
  const Subdivision fine = Subdivide(quads, static_cast<int>(base.vertices.rows()));
  tracked_ = BuildTrackedMesh(base, atlas, fine);
  for (const Quad& q : fine.quads) {
    fine_triangles_.emplace_back(q[0], q[1], q[2]);
    fine_triangles_.emplace_back(q[0], q[2], q[3]);
  }
  // Teeth and gums come after the subdivided vertices.
  std::vector<Stencil> stencils = {CatmullClark(fine)};
  std::vector<FinePart> jaw_parts;
  int fine_count = fine.fine_count;
  const auto append_jaw = [&](const char* name, const JawMesh& mesh, const QuadPart& helper, Material material) {
    FinePart part{{name, mesh.topology, std::move(material)}, {}};
    for (int i = 0; i < mesh.topology.vertex_count; ++i) part.fine_vertices.push_back(fine_count + i);
    for (const Eigen::Vector3i& t : mesh.topology.triangles) fine_triangles_.emplace_back(t.array() + fine_count);
    stencils.push_back(FollowAffinely(mesh.vertices, base.vertices, UsedVertices(helper.quads)));
    fine_count += mesh.topology.vertex_count;
    jaw_parts.push_back(std::move(part));
  };
  append_jaw("upper teeth", MakeTeeth(Jaw::kUpper), base.upper_teeth, TeethMaterial(recipe));
  append_jaw("upper gums", MakeGums(Jaw::kUpper), base.upper_teeth, GumMaterial(recipe));
  append_jaw("lower teeth", MakeTeeth(Jaw::kLower), base.lower_teeth, TeethMaterial(recipe));
  append_jaw("lower gums", MakeGums(Jaw::kLower), base.lower_teeth, GumMaterial(recipe));
  const Stencil stencil = Stack(stencils);
  fine_ = LinearShapes(stencil, identity.vertices, targets);

  std::vector<Quad> skin_uvs = atlas.face;
  skin_uvs.insert(skin_uvs.end(), atlas.mouth.begin(), atlas.mouth.end());
  const Subdivision uv_subdivision = Subdivide(skin_uvs, static_cast<int>(atlas.uvs.size()));
  std::vector<FinePart> parts;
  parts.push_back(MakePart("skin", fine, 0, skin_quads, uv_subdivision, SubdivideUvs(uv_subdivision, atlas.uvs)));
  const SkinSheet sheet = MakeSheet(base, fine_.rest(), stencil * base.vertices, atlas, parts.back());
  parts.back().surface.material = PaintSkin(sheet, ReadSkinMasks(data_folder), recipe);
  hair_ = HairShells(parts.back().fine_vertices, parts.back().surface.topology.triangles, sheet.points, sheet.average,
                     recipe);
  const std::vector<float> hair_height = hair_.ApparentHeight(fine_count);
  for (const int v : tracked_.skin_vertices) tracked_lift_.push_back(hair_height[v]);
  for (const int side : {kLeft, kRight}) {
    parts.push_back(MakeHelperPart(side == kLeft ? "left lid inside" : "right lid inside", base.sockets[side], fine,
                                   first_socket[side]));
    parts.back().surface.material.albedo = Plain(190, 110, 100);
  }
  for (FinePart& part : jaw_parts) parts.push_back(std::move(part));
  parts.push_back(MakeHelperPart("tongue", base.tongue, fine, first_tongue));
  parts.back().surface.material = TongueMaterial(recipe);
  for (FinePart& part : parts) {
    surfaces_.push_back(std::move(part.surface));
    fine_vertices_.push_back(std::move(part.fine_vertices));
  }

  for (const int side : {kLeft, kRight}) {
    const std::string which = side == kLeft ? "left " : "right ";
    eyeball_[side] = MakeEyeball(eyes_[side].radius);
    cornea_[side] = MakeCornea(eyes_[side].radius);
    surfaces_.push_back({which + "eye", eyeball_[side].topology, PaintEyeball(recipe, side)});
    surfaces_.push_back({which + "cornea", cornea_[side].topology, CorneaMaterial()});
    lashes_[side] = Lashes(FrontRim(base, atlas.lids[side].upper, fine), FrontRim(base, atlas.lids[side].lower, fine),
                           static_cast<Side>(side), recipe);
    surfaces_.push_back({which + "lashes", lashes_[side].topology(), LashMaterial(recipe)});
    for (const Quad& quad : fine.quads) {
      for (const int v : quad) {
        const Eigen::Vector3f p = fine_.rest().row(v);
        if ((p - eyes_[side].centre).norm() < 1.6f * eyes_[side].radius) near_eyes_[side].push_back(v);
      }
    }
    std::sort(near_eyes_[side].begin(), near_eyes_[side].end());
    near_eyes_[side].erase(std::unique(near_eyes_[side].begin(), near_eyes_[side].end()), near_eyes_[side].end());
  }
  for (int shell = 0; shell < kHairShells; ++shell) {
    surfaces_.push_back({fmt::format("hair {}", shell + 1), hair_.topology(), hair_.material(shell)});
  }
}

PosedHead HumanHead::Pose(std::span<const float, kExpressionCount> weights) const {
  PosedHead posed;
  Vertices fine = fine_.Pose(weights);
  Eigen::Matrix3f gaze[2];
  for (const int side : {kLeft, kRight}) {
    gaze[side] = GazeRotation(static_cast<Side>(side), weights);
    // Lids slide over the eye.
    constexpr float kLidClearance = 0.25f;  // mm
    const EyeFit& eye = eyes_[side];
    const Eigen::Vector3f axis = gaze[side].col(2);
    for (const int v : near_eyes_[side]) {
      const Eigen::Vector3f d = Eigen::Vector3f(fine.row(v)) - eye.centre;
      const float distance = d.norm();
      if (distance <= 0) continue;
      const float least = eye.radius * EyeReach(d.dot(axis) / distance) + kLidClearance;
      if (distance < least) fine.row(v) = (eye.centre + d * (least / distance)).transpose();
    }
  }
  const Vertices normals = VertexNormals(fine, fine_triangles_);
  const auto gather = [](const Vertices& all, const std::vector<int>& rows) {
    Vertices some(static_cast<Eigen::Index>(rows.size()), 3);
    for (size_t i = 0; i < rows.size(); ++i) some.row(static_cast<Eigen::Index>(i)) = all.row(rows[i]);
    return some;
  };
  for (const std::vector<int>& rows : fine_vertices_) {
    posed.surfaces.push_back(gather(fine, rows));
    posed.normals.push_back(gather(normals, rows));
  }
  const auto append = [&](Vertices positions, const MeshTopology& topology) {
    posed.normals.push_back(VertexNormals(positions, topology.triangles));
    posed.surfaces.push_back(std::move(positions));
  };
  for (const int side : {kLeft, kRight}) {
    for (const EyeMesh* mesh : {&eyeball_[side], &cornea_[side]}) {
      Vertices turned = mesh->vertices * gaze[side].transpose();
      turned.rowwise() += eyes_[side].centre.transpose();
      append(std::move(turned), mesh->topology);
    }
    append(lashes_[side].Positions(fine, eyes_[side]), lashes_[side].topology());
  }
  for (int shell = 0; shell < kHairShells; ++shell) append(hair_.Positions(shell, fine, normals), hair_.topology());
  posed.tracked = tracked_.Positions(fine, eyes_);
  for (size_t i = 0; i < tracked_.skin_vertices.size(); ++i) {
    posed.tracked.row(static_cast<Eigen::Index>(i)) += tracked_lift_[i] * normals.row(tracked_.skin_vertices[i]);
  }
  return posed;
}

}  // namespace

std::unique_ptr<Head> MakeHumanHead(const std::filesystem::path& data_folder, const HumanRecipe& recipe) {
  return std::make_unique<HumanHead>(data_folder, recipe);
}

}  // namespace likeness
