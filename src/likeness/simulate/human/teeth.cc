#include "likeness/simulate/human/teeth.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "likeness/base/error.h"
#include "likeness/simulate/human/noise.h"
#include "likeness/simulate/human/pigment.h"
#include "likeness/simulate/human/skin_regions.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

struct ToothSize {
  float width, height;  // of the crown, mm
  float edge, neck;     // thickness at the biting edge and at the gum, mm
  float point;          // how far the middle of the edge stands out
};
// From the middle backwards: incisors, canine, premolars, molars; after Wheeler's tables of mean crowns.
constexpr int kTeethPerSide = 7;
constexpr ToothSize kUpperTeeth[kTeethPerSide] = {
    {8.5f, 10.5f, 1.6f, 6.5f, 0.1f}, {6.6f, 9.2f, 1.5f, 6, 0.2f}, {7.6f, 10, 2.2f, 7.5f, 1.1f}, {7, 8.5f, 6, 8, 0.9f},
    {6.8f, 8, 6.5f, 8, 0.7f},        {10, 7.5f, 8.5f, 10, 0.4f},  {9.5f, 7, 8.5f, 10, 0.3f}};
constexpr ToothSize kLowerTeeth[kTeethPerSide] = {{5.4f, 9, 1.4f, 5.5f, 0.05f}, {5.9f, 9.2f, 1.5f, 5.8f, 0.1f},
                                                  {6.9f, 10, 2.2f, 7, 1.0f},    {7, 8.5f, 5.5f, 7.5f, 0.8f},
                                                  {7.1f, 8, 6.5f, 8, 0.6f},     {10.5f, 7.5f, 8.5f, 10, 0.4f},
                                                  {10, 7, 8.5f, 10, 0.3f}};

// Outer biting edge of the left half of the helper's arches, in the space of skin_regions.h.
const std::vector<Vector3f>& ArchPoints(Jaw jaw) {
  static const std::vector<Vector3f> upper = {{0, -68, 21.8f},         {8.9f, -67.6f, 21.4f},   {17.4f, -66, 16.2f},
                                              {22.1f, -64, 9.2f},      {25.4f, -62.3f, 1},      {28.4f, -60.4f, -7.7f},
                                              {29.7f, -59.2f, -14.6f}, {31.1f, -57.6f, -21.1f}, {31, -55.9f, -28.3f}};
  static const std::vector<Vector3f> lower = {{0, -68.7f, 21.7f},   {9.1f, -68.4f, 21.2f},   {17.7f, -66.8f, 16.3f},
                                              {22.2f, -64.9f, 9},   {25.6f, -63.1f, 0.8f},   {28.4f, -61.5f, -8.1f},
                                              {29.2f, -60, -14.9f}, {30.6f, -58.6f, -21.5f}, {31, -56.7f, -28.9f}};
  return jaw == Jaw::kUpper ? upper : lower;
}

// Axes at a place of the arch: right-handed up to mirroring, all unit.
struct ArchFrame {
  Vector3f edge;     // the outer biting edge
  Vector3f along;    // away from the middle
  Vector3f outward;  // to lips and cheeks
  Vector3f root;     // from the edge to the gum
};

// `place`: mm along the arch from the middle, positive to the subject's left.
ArchFrame FrameAt(Jaw jaw, float place) {
  const std::vector<Vector3f>& points = ArchPoints(jaw);
  // The helper's arch is flat in front: its first corner is rounded off by averaging over a window.
  const auto at = [&](float s) {
    const float sign = s < 0 ? -1.0f : 1.0f;
    float left = std::abs(s);
    Vector3f p = points.back();
    for (size_t i = 1; i < points.size(); ++i) {
      const float length = (points[i] - points[i - 1]).norm();
      if (left <= length || i + 1 == points.size()) {
        p = points[i - 1] + (points[i] - points[i - 1]) * (left / length);
        break;
      }
      left -= length;
    }
    return Vector3f(sign * p.x(), p.y(), p.z());
  };
  const auto smooth = [&](float s) {
    constexpr int kTaps = 9;
    constexpr float kWindow = 6;
    Vector3f sum = Vector3f::Zero();
    for (int i = 0; i < kTaps; ++i) sum += at(s + kWindow * (static_cast<float>(i) / (kTaps - 1) - 0.5f) * 2);
    return Vector3f(sum / kTaps);
  };
  ArchFrame frame;
  frame.edge = smooth(place);
  Vector3f along = smooth(place + 0.5f) - smooth(place - 0.5f);
  along.y() = 0;
  frame.along = along.normalized();
  frame.outward = Vector3f(-frame.along.z(), 0, frame.along.x());
  if (frame.outward.dot(Vector3f(frame.edge.x(), 0, frame.edge.z() + 15)) < 0) frame.outward *= -1;
  // Front teeth lean: their roots stand behind lips that lean back from the upper gum and forward to the lower edge.
  const float front = SmoothStep(30, 5, std::abs(place));
  const float lean = jaw == Jaw::kUpper ? 0.22f : -0.24f;
  const Vector3f up = jaw == Jaw::kUpper ? Vector3f(0, 1, 0) : Vector3f(0, -1, 0);
  frame.root = (up + front * lean * frame.outward).normalized();
  return frame;
}

Vector3f ToBase(const Vector3f& point) { return point + kRegionOrigin; }

void AppendVertices(const std::vector<Vector3f>& points, Vertices* vertices) {
  vertices->resize(static_cast<Eigen::Index>(points.size()), 3);
  for (size_t i = 0; i < points.size(); ++i) vertices->row(static_cast<Eigen::Index>(i)) = points[i].transpose();
}

void AppendTriangle(int a, int b, int c, MeshTopology* topology) {
  topology->triangles.emplace_back(a, b, c);
  topology->triangle_uvs.emplace_back(a, b, c);
}

// Where the teeth stand: `place` of each one's middle, left and right of the subject in turn.
struct Tooth {
  ToothSize size;
  float place;
  int index;
};
std::vector<Tooth> ToothRow(Jaw jaw) {
  const auto& sizes = jaw == Jaw::kUpper ? kUpperTeeth : kLowerTeeth;
  std::vector<Tooth> row;
  float place = 0;
  for (int i = 0; i < kTeethPerSide; ++i) {
    place += sizes[i].width / 2;
    row.push_back({sizes[i], place, 2 * i});
    row.push_back({sizes[i], -place, 2 * i + 1});
    place += sizes[i].width / 2;
  }
  return row;
}

}  // namespace

JawMesh MakeTeeth(Jaw jaw) {
  constexpr int kAround = 16;
  struct Ring {
    float height, width, thickness;  // fractions: of the crown; of its width; from edge (0) to neck (1)
    float front;                     // mm in front of the arch
  };
  constexpr Ring kRings[] = {
      {0.0f, 0.62f, -0.12f, -0.75f},  {0.015f, 0.80f, -0.04f, -0.55f}, {0.05f, 0.92f, 0.02f, -0.4f},
      {0.16f, 0.985f, 0.15f, -0.25f}, {0.34f, 1.0f, 0.45f, -0.15f},    {0.58f, 0.95f, 0.8f, -0.2f},
      {0.82f, 0.86f, 1.0f, -0.4f},    {1.02f, 0.78f, 1.0f, -0.7f},     {1.25f, 0.70f, 0.9f, -1.1f}};
  JawMesh mesh;
  std::vector<Vector3f> points;
  MeshTopology& topology = mesh.topology;
  for (const Tooth& tooth : ToothRow(jaw)) {
    const ArchFrame frame = FrameAt(jaw, tooth.place);
    const int first = static_cast<int>(points.size());
    const float u = (static_cast<float>(tooth.index) + 0.5f) / (2 * kTeethPerSide);
    Vector3f centre = Vector3f::Zero();
    for (const Ring& ring : kRings) {
      const float thickness = tooth.size.edge + (tooth.size.neck - tooth.size.edge) * ring.thickness;
      const float half_width = 0.485f * tooth.size.width * ring.width;
      for (int i = 0; i < kAround; ++i) {
        // A superellipse: flat in front, with rounded flanks.
        const float angle = 2 * kPi * static_cast<float>(i) / kAround;
        const auto shaped = [](float x) { return std::copysign(std::pow(std::abs(x), 0.62f), x); };
        const float x = half_width * shaped(std::cos(angle));
        const float z = ring.front - thickness / 2 + thickness / 2 * shaped(std::sin(angle));
        const float middle = 1 - std::abs(x) / (tooth.size.width / 2);
        const float stand_out = tooth.size.point * middle * SmoothStep(0.5f, 0, ring.height);
        const float height = ring.height * tooth.size.height + 0.5f - stand_out;
        points.push_back(ToBase(frame.edge + x * frame.along + z * frame.outward + height * frame.root));
        topology.uvs.emplace_back(u, ring.height / 1.25f);
        if (&ring == &kRings[0]) centre += points.back() / kAround;
      }
    }
    const int cap = static_cast<int>(points.size());
    points.push_back(centre);
    topology.uvs.emplace_back(u, 0.0f);
    const size_t first_triangle = topology.triangles.size();
    for (int i = 0; i < kAround; ++i) {
      const int j = (i + 1) % kAround;
      AppendTriangle(cap, first + i, first + j, &topology);
      for (size_t r = 0; r + 1 < std::size(kRings); ++r) {
        const int a = first + static_cast<int>(r) * kAround + i, b = first + static_cast<int>(r) * kAround + j;
        AppendTriangle(a, a + kAround, b + kAround, &topology);
        AppendTriangle(a, b + kAround, b, &topology);
      }
    }
    // Mirrored frames turn triangles over; the cap must face away from the root.
    const Eigen::Vector3i cap_triangle = topology.triangles[first_triangle];
    const Vector3f normal =
        (points[cap_triangle[1]] - points[cap_triangle[0]]).cross(points[cap_triangle[2]] - points[cap_triangle[0]]);
    if (normal.dot(frame.root) > 0) {
      for (size_t t = first_triangle; t < topology.triangles.size(); ++t) {
        std::swap(topology.triangles[t][1], topology.triangles[t][2]);
        std::swap(topology.triangle_uvs[t][1], topology.triangle_uvs[t][2]);
      }
    }
  }
  AppendVertices(points, &mesh.vertices);
  topology.vertex_count = static_cast<int>(points.size());
  return mesh;
}

JawMesh MakeGums(Jaw jaw) {
  JawMesh mesh;
  std::vector<Tooth> row = ToothRow(jaw);
  std::sort(row.begin(), row.end(), [](const Tooth& a, const Tooth& b) { return a.place < b.place; });
  struct Column {
    float place, height, neck, papilla;  // papilla: 0 at the middle of a tooth, 1 between two
  };
  std::vector<Column> columns;
  constexpr int kPerTooth = 8;
  for (size_t i = 0; i < row.size(); ++i) {
    for (int k = 0; k < kPerTooth; ++k) {
      const float t = (static_cast<float>(k) + 0.5f) / kPerTooth - 0.5f;
      const float between = std::abs(2 * t);
      columns.push_back(
          {row[i].place + t * row[i].size.width, row[i].size.height, row[i].size.neck, between * between * between});
    }
  }
  // Heights change smoothly from tooth to tooth.
  for (int round = 0; round < 4; ++round) {
    const std::vector<Column> before = columns;
    for (size_t i = 1; i + 1 < columns.size(); ++i) {
      columns[i].height = (before[i - 1].height + 2 * before[i].height + before[i + 1].height) / 4;
      columns[i].neck = (before[i - 1].neck + 2 * before[i].neck + before[i + 1].neck) / 4;
    }
  }
  constexpr int kRows = 11;
  std::vector<Vector3f> points;
  MeshTopology& topology = mesh.topology;
  for (size_t i = 0; i < columns.size(); ++i) {
    const Column& c = columns[i];
    const ArchFrame frame = FrameAt(jaw, c.place);
    const float margin = c.height * (0.93f - 0.30f * c.papilla);
    const float inset = 0.75f * c.papilla;
    const std::array<std::array<float, 2>, kRows> section = {{{0.6f, c.height + 11},
                                                              {0.9f, c.height + 6},
                                                              {0.75f, c.height + 2.5f},
                                                              {0.45f - 0.4f * inset, margin + 1.6f},
                                                              {0.05f - inset, margin + 0.35f},
                                                              {-0.55f - inset, margin},
                                                              {-c.neck + 0.6f + inset, margin},
                                                              {-c.neck - 0.3f + inset, margin + 0.5f},
                                                              {-c.neck - 0.9f, margin + 2},
                                                              {-c.neck - 1.3f, c.height + 5},
                                                              {-c.neck - 1.5f, c.height + 11}}};
    for (int r = 0; r < kRows; ++r) {
      points.push_back(ToBase(frame.edge + section[r][0] * frame.outward + section[r][1] * frame.root));
      topology.uvs.emplace_back(static_cast<float>(i) / static_cast<float>(columns.size() - 1),
                                static_cast<float>(r) / (kRows - 1));
    }
  }
  for (size_t i = 0; i + 1 < columns.size(); ++i) {
    for (int r = 0; r + 1 < kRows; ++r) {
      const int a = static_cast<int>(i) * kRows + r, b = a + kRows;
      AppendTriangle(a, a + 1, b + 1, &topology);
      AppendTriangle(a, b + 1, b, &topology);
    }
  }
  // The first row faces outwards.
  const size_t middle = (columns.size() / 2) * 2 * (kRows - 1);
  const Eigen::Vector3i t = topology.triangles[middle];
  const Vector3f normal = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
  if (normal.z() < 0) {
    for (size_t k = 0; k < topology.triangles.size(); ++k) {
      std::swap(topology.triangles[k][1], topology.triangles[k][2]);
      std::swap(topology.triangle_uvs[k][1], topology.triangle_uvs[k][2]);
    }
  }
  AppendVertices(points, &mesh.vertices);
  topology.vertex_count = static_cast<int>(points.size());
  return mesh;
}

Material TeethMaterial(const HumanRecipe& recipe) {
  constexpr int kWidth = 2 * kTeethPerSide, kHeight = 48;
  Material material;
  material.albedo = ImageU8(kWidth, kHeight, 3);
  const float yellow = 0.25f + 0.6f * static_cast<float>(recipe.age);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int from_middle = x / 2;
      const float v = 1.25f * (1 - (static_cast<float>(y) + 0.5f) / kHeight);  // 0 at the edge, 1 at the gum
      const float tone = 1 + 0.05f * (2 * UnitFromBits(HashCell(x, 0, 0, static_cast<uint32_t>(recipe.seed))) - 1) -
                         0.03f * static_cast<float>(from_middle);
      Vector3f colour = Vector3f(0.86f, 0.77f, 0.65f) - yellow * Vector3f(0.04f, 0.09f, 0.18f);
      colour -= SmoothStep(0.35f, 1.1f, v) * Vector3f(0.06f, 0.13f, 0.17f);  // dentine shows through
      colour -= SmoothStep(0.16f, 0.0f, v) * Vector3f(0.18f, 0.14f, 0.08f);  // the edge lets light through
      for (int c = 0; c < 3; ++c) material.albedo.at(x, y)[c] = EncodeSrgb(tone * colour[c]);
    }
  }
  material.roughness = 0.35f;
  material.specular_f0 = 0.05f;
  material.scatter = {0.2f, 0.18f, 0.15f};
  material.coat = 0.6f;
  material.coat_roughness = 0.15f;
  return material;
}

namespace {

// Moist tissue with fine relief in its own texture coordinates.
Material MoistMaterial(const Vector3f& colour, float relief, uint32_t seed) {
  constexpr int kSize = 256;
  Material material;
  material.albedo = ImageU8(kSize, kSize, 3);
  material.normal_map = ImageF(kSize, kSize, 3);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const auto height = [&](int i, int j) {
        return FractalNoise(Vector3f(static_cast<float>(i) / 5, static_cast<float>(j) / 5, 0), 3, seed);
      };
      const float tone =
          1 + 0.25f * FractalNoise(Vector3f(static_cast<float>(x) / 30, static_cast<float>(y) / 30, 5), 3, seed);
      for (int c = 0; c < 3; ++c) material.albedo.at(x, y)[c] = EncodeSrgb(tone * colour[c]);
      const Vector3f normal(relief * (height(x - 1, y) - height(x + 1, y)),
                            relief * (height(x, y + 1) - height(x, y - 1)), 1);
      for (int c = 0; c < 3; ++c) material.normal_map.at(x, y)[c] = normal.normalized()[c];
    }
  }
  material.roughness = 0.4f;
  material.scatter = {0.35f, 0.15f, 0.12f};
  material.coat = 0.5f;
  material.coat_roughness = 0.2f;
  return material;
}

}  // namespace

Material GumMaterial(const HumanRecipe& recipe) {
  const float dark = 1 - 0.45f * static_cast<float>(recipe.melanin * recipe.melanin);
  return MoistMaterial(dark * Vector3f(0.62f, 0.23f, 0.20f), 0.15f, static_cast<uint32_t>(recipe.seed) + 200);
}

Material TongueMaterial(const HumanRecipe& recipe) {
  return MoistMaterial(Vector3f(0.50f, 0.19f, 0.17f), 0.6f, static_cast<uint32_t>(recipe.seed) + 300);
}

Stencil FollowAffinely(const Vertices& points, const Vertices& coarse, const std::vector<int>& helper) {
  LIKENESS_CHECK(helper.size() >= 4);
  Eigen::MatrixX4d corners(static_cast<Eigen::Index>(helper.size()), 4);
  for (size_t i = 0; i < helper.size(); ++i) {
    corners.row(static_cast<Eigen::Index>(i)) << coarse.row(helper[i]).cast<double>(), 1;
  }
  // Weights that reproduce affine functions: [p 1] (C^T C)^-1 C^T. About the helper's centre for the numbers' sake.
  const Eigen::RowVector3d centre = corners.leftCols<3>().colwise().mean();
  corners.leftCols<3>().rowwise() -= centre;
  const Eigen::Matrix4d inverse = (corners.transpose() * corners).inverse();
  std::vector<Eigen::Triplet<float>> triplets;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    Eigen::RowVector4d point;
    point << points.row(p).cast<double>() - centre, 1;
    const Eigen::RowVectorXd weights = point * inverse * corners.transpose();
    for (size_t i = 0; i < helper.size(); ++i) {
      triplets.emplace_back(static_cast<int>(p), helper[i], static_cast<float>(weights[static_cast<Eigen::Index>(i)]));
    }
  }
  Stencil stencil(points.rows(), coarse.rows());
  stencil.setFromTriplets(triplets.begin(), triplets.end());
  return stencil;
}

}  // namespace likeness
