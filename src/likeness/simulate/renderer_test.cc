#include "likeness/simulate/renderer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <numbers>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kPi = std::numbers::pi;

// A head of surfaces that do not move.
class StillHead : public Head {
 public:
  void Add(Surface surface, const Vertices& vertices) {
    surface.topology.vertex_count = static_cast<int>(vertices.rows());
    posed_.surfaces.push_back(vertices);
    posed_.normals.push_back(VertexNormals(vertices, surface.topology.triangles));
    surfaces_.push_back(std::move(surface));
  }
  const std::string& name() const override { return name_; }
  const std::vector<Surface>& surfaces() const override { return surfaces_; }
  const MeshTopology& tracked_topology() const override { return surfaces_.front().topology; }
  PosedHead Pose(std::span<const float, kExpressionCount>) const override { return posed_; }
  const PosedHead& posed() const { return posed_; }

 private:
  std::string name_ = "still";
  std::vector<Surface> surfaces_;
  PosedHead posed_;
};

ImageU8 Flat(std::array<uint8_t, 4> colour, int channels = 3) {
  ImageU8 image(1, 1, channels);
  for (int c = 0; c < channels; ++c) image.at(0, 0)[c] = colour[c];
  return image;
}

// A square of side 2 `half` in the plane z, facing +z, cut into cells.
void AddSquare(StillHead* head, double half, double z, int cells, Material material) {
  Surface surface;
  surface.material = std::move(material);
  Vertices vertices((cells + 1) * (cells + 1), 3);
  const auto index = [&](int i, int j) { return j * (cells + 1) + i; };
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const float u = static_cast<float>(i) / cells, v = static_cast<float>(j) / cells;
      vertices.row(index(i, j)) << static_cast<float>(half) * (2 * u - 1), static_cast<float>(half) * (2 * v - 1),
          static_cast<float>(z);
      surface.topology.uvs.emplace_back(u, v);
      if (i == cells || j == cells) continue;
      surface.topology.triangles.emplace_back(index(i, j), index(i + 1, j), index(i + 1, j + 1));
      surface.topology.triangles.emplace_back(index(i, j), index(i + 1, j + 1), index(i, j + 1));
    }
  }
  surface.topology.triangle_uvs = surface.topology.triangles;
  head->Add(std::move(surface), vertices);
}

constexpr double kSphereRadius = 50;

StillHead Sphere(Material material) {
  Surface surface;
  surface.material = std::move(material);
  const int columns = 128, rows = 96;
  Vertices vertices(columns * (rows + 1), 3);
  const auto index = [&](int i, int j) { return j * columns + i % columns; };
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double latitude = kPi * (static_cast<double>(j) / rows - 0.5), longitude = 2 * kPi * i / columns;
      vertices.row(index(i, j)) =
          (kSphereRadius * Vector3d(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                                    std::cos(latitude) * std::cos(longitude)))
              .transpose()
              .cast<float>();
      if (j == rows) continue;
      surface.topology.triangles.emplace_back(index(i, j), index(i + 1, j), index(i + 1, j + 1));
      surface.topology.triangles.emplace_back(index(i, j), index(i + 1, j + 1), index(i, j + 1));
    }
  }
  surface.topology.uvs = {{0.5f, 0.5f}};
  surface.topology.triangle_uvs.assign(surface.topology.triangles.size(), Eigen::Vector3i::Zero());
  StillHead head;
  head.Add(std::move(surface), vertices);
  return head;
}

Camera FrontCamera(int size, double half_mm, double azimuth = 0) {
  const double distance = 1000;
  const Vector3d centre = distance * Vector3d(std::sin(azimuth), 0, std::cos(azimuth));
  return LookAt(centre, Vector3d::Zero(), Vector3d::UnitY(), size / 2.0 * distance / half_mm, size, size);
}

double Linear(uint8_t value) {
  const double v = value / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

LightRig OneLight(const Vector3d& direction, double irradiance) {
  LightRig rig;
  rig.lights = {{direction.normalized().cast<float>(), static_cast<float>(irradiance)}};
  return rig;
}

Material Matte(float scatter = 0) {
  Material material;
  material.albedo = Flat({188, 188, 188, 255});
  material.specular_f0 = 0;
  material.scatter = {scatter, scatter, scatter};
  return material;
}

// Where the ray through a pixel meets the sphere.
Vector3d SphereNormal(const Camera& camera, int x, int y) {
  const Vector3d o = camera.CentreInWorld(), d = camera.RayInWorld({x + 0.5, y + 0.5});
  const double b = o.dot(d), c = o.squaredNorm() - kSphereRadius * kSphereRadius, root = b * b - c;
  return root < 0 ? Vector3d(0, 0, 0) : Vector3d((o + (-b - std::sqrt(root)) * d) / kSphereRadius);
}

TEST(RendererTest, AMatteSphereUnderOneLightFollowsLambert) {
  for (const float wrap : {0.0f, 0.3f}) {
    const StillHead head = Sphere(Matte(wrap));
    const Vector3d light = Vector3d(1, 1, 2).normalized();
    const HeadRenderer renderer(head, OneLight(light, kPi), {.samples = 1});
    const Camera camera = FrontCamera(80, 60);
    const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), camera);
    int compared = 0;
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 80; ++x) {
        const Vector3d normal = SphereNormal(camera, x, y);
        const double facing = normal.dot(light);
        // The sphere's own shadow is interpolated between vertices near the terminator.
        if (normal.norm() == 0 || (wrap == 0 && std::abs(facing) < 0.06) || normal.z() < 0.3) continue;
        const double expected = std::min(1.0, Linear(188) * std::max(0.0, facing + wrap) / ((1 + wrap) * (1 + wrap)));
        // Half a grey level at this slope of the sRGB curve, and the facets' interpolated normals.
        EXPECT_NEAR(Linear(picture.rgb.at(x, y)[1]), expected, 0.0045) << x << " " << y << " wrap " << wrap;
        ++compared;
      }
    }
    EXPECT_GT(compared, 2000);
  }
}

// A plain reading of the microfacet equations, in double precision.
double ReferenceGgx(const Vector3d& n, const Vector3d& l, const Vector3d& v, double alpha, double f0) {
  const Vector3d h = (l + v).normalized();
  const double nl = n.dot(l), nv = n.dot(v), nh = n.dot(h), vh = v.dot(h), a2 = alpha * alpha;
  if (nl <= 0) return 0;
  const double d = a2 / (kPi * std::pow(nh * nh * (a2 - 1) + 1, 2));
  const double f = f0 + (1 - f0) * std::pow(1 - vh, 5);
  const double visibility = 0.5 / (2 * nl * nv * (1 - alpha) + (nl + nv) * alpha);
  return d * f * visibility;
}

LightQuery Query(const std::vector<uint16_t>& visible, const Vector3d& view, float alpha, float f0) {
  LightQuery query;
  for (int k = 0; k < 3; ++k) query.visible[k] = visible.data();
  query.normal = Vector3f::UnitZ();
  for (Vector3f& n : query.diffuse_normal) n = query.normal;
  query.view = view.cast<float>();
  query.specular = {alpha, f0};
  return query;
}

TEST(LightSumTest, SumsAgreeWithTheEquations) {
  const LightRig rig = EvenLights(60);
  const LightTable table(rig);
  Random random(3);
  std::vector<uint16_t> visible(table.groups());
  for (uint16_t& v : visible) v = static_cast<uint16_t>(random.Below(1 << 16));
  for (const float alpha : {0.05f, 0.25f, 0.9f}) {
    const Vector3d view = Vector3d(0.5, -0.2, 0.7).normalized();
    LightQuery query = Query(visible, view, alpha, 0.04f);
    query.coat = {0.1f, 0.02f};
    query.has_coat = true;
    query.wrap[0] = 0.5f;
    const LightSum sum = SumLights(table, query);
    double specular = 0, coat = 0, red = 0, green = 0;
    for (int i = 0; i < table.size(); ++i) {
      const Vector3d l = table.Direction(i).cast<double>();
      const double strength = table.Irradiance(i) * (visible[i / LightTable::kGroup] >> i % LightTable::kGroup & 1);
      specular += strength * ReferenceGgx(Vector3d::UnitZ(), l, view, alpha, 0.04f) * l.z();
      coat += strength * ReferenceGgx(Vector3d::UnitZ(), l, view, 0.1f, 0.02f) * l.z();
      red += strength * std::max(0.0, l.z() + 0.5) / 2.25 / kPi;
      green += strength * std::max(0.0, l.z()) / kPi;
    }
    EXPECT_NEAR(sum.specular, specular, 1e-4 * specular);
    EXPECT_NEAR(sum.coat, coat, 1e-4 * coat);
    EXPECT_NEAR(sum.diffuse[0], red, 1e-5);
    EXPECT_NEAR(sum.diffuse[1], green, 1e-5);
  }
}

// Under uniform light a perfect reflector sends back at most what arrives. Seen along the normal, with alpha 1, D is
// 1 / pi and V is 1 / (2 (1 + n.l)): the integral over the hemisphere is 1 - ln 2.
TEST(LightSumTest, SpecularLayersDoNotMakeLight) {
  LightRig rig = EvenLights(4096);
  for (Light& light : rig.lights) light.irradiance = static_cast<float>(4 * kPi / 4096);  // radiance 1 all around
  const LightTable table(rig);
  const std::vector<uint16_t> visible(table.groups(), 0xffff);
  for (const double tilt : {0.0, 0.7, 1.2}) {
    const Vector3d view(std::sin(tilt), 0, std::cos(tilt));
    for (const float alpha : {0.2f, 0.5f, 1.0f}) {
      const float reflected = SumLights(table, Query(visible, view, alpha, 1)).specular;
      EXPECT_LT(reflected, 1.01f) << "alpha " << alpha << " tilt " << tilt;
      if (tilt == 0 && alpha == 1) {
        EXPECT_NEAR(reflected, 1 - std::log(2.0), 2e-3);
      }
      if (tilt == 0 && alpha == 0.2f) {
        EXPECT_GT(reflected, 0.93f);
      }
    }
  }
}

TEST(LightSumTest, LightAndViewMayBeExchanged) {
  Random random(5);
  const std::vector<uint16_t> visible = {0xffff};
  for (int trial = 0; trial < 100; ++trial) {
    const auto direction = [&] {
      return Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(0.1, 1)).normalized();
    };
    const Vector3d a = direction(), b = direction();
    const auto reflectance = [&](const Vector3d& light, const Vector3d& view) {
      return SumLights(LightTable(OneLight(light, 1)), Query(visible, view, 0.3f, 0.04f)).specular / light.z();
    };
    EXPECT_NEAR(reflectance(a, b), reflectance(b, a), 1e-4 * reflectance(a, b));
  }
}

TEST(RendererTest, HighlightsMoveWithTheViewAndMatteColourDoesNot) {
  Material glossy = Matte();
  glossy.specular_f0 = 0.04f;
  glossy.roughness = 0.3f;
  const Vector3d light = Vector3d(0.5, 0, 1).normalized();
  const auto brightest_in_world = [&](const StillHead& head, double azimuth) -> Vector3d {
    const HeadRenderer renderer(head, OneLight(light, 1.5), {.samples = 1});
    const Camera camera = FrontCamera(100, 60, azimuth);
    const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), camera);
    int best = -1;
    Vector3d sum = Vector3d::Zero();  // over the brightest pixels
    for (int y = 0; y < 100; ++y) {
      for (int x = 0; x < 100; ++x) {
        const int value = picture.rgb.at(x, y)[1];
        if (value > best) sum.setZero();
        if (value >= best) sum += SphereNormal(camera, x, y);
        best = std::max(best, value);
      }
    }
    return sum.normalized().eval();
  };
  const StillHead glossy_head = Sphere(glossy), matte_head = Sphere(Matte());
  for (const double azimuth : {-0.6, 0.5}) {
    // The brightest point lies half way between light and camera.
    const Vector3d to_camera(std::sin(azimuth), 0, std::cos(azimuth));
    const Vector3d half_way = (light + to_camera).normalized();
    EXPECT_LT(std::acos(std::min(1.0, brightest_in_world(glossy_head, azimuth).dot(half_way))), 0.12);
    EXPECT_LT(std::acos(std::min(1.0, brightest_in_world(matte_head, azimuth).dot(light))), 0.12);
  }
}

// A small square in front of a large one, lit askew: its shadow falls where geometry says.
TEST(RendererTest, ShadowsFallWhereGeometrySays) {
  StillHead head;
  AddSquare(&head, 50, 0, 100, Matte());
  AddSquare(&head, 8, 20, 2, Matte());
  const Vector3d light = Vector3d(1, 0, 1).normalized();
  const HeadRenderer renderer(head, OneLight(light, kPi), {.samples = 1});
  const Camera camera = FrontCamera(100, 52);
  const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), camera);
  const auto value_at = [&](double x, double y) {
    const Eigen::Vector2d pixel = camera.Project({x, y, 0});
    return picture.rgb.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))[0];
  };
  const auto lit = value_at(30, 30);
  EXPECT_GT(lit, 100);
  // The shadow is the square moved by -20 along x: from -28 to -12.
  EXPECT_EQ(value_at(-20, 0), 0);
  EXPECT_EQ(value_at(-26, 6), 0);
  EXPECT_EQ(value_at(-30, 0), lit);
  EXPECT_EQ(value_at(-20, 10), lit);
  EXPECT_EQ(value_at(12, 0), lit);
}

TEST(RendererTest, ACavityIsDarkerThanTheOpen) {
  const auto head = MakeProceduralHead({.texture_size = 64});
  std::array<float, kExpressionCount> weights = {};
  weights[static_cast<size_t>(ExpressionIndex("jawOpen"))] = 1;
  const HeadRenderer renderer(*head, EvenLights(100), {});
  const LitHead lit = renderer.Light(head->Pose(weights), {});
  // Skin vertices by how far they lie behind the lips, near the middle of the mouth.
  double deep = 0, open = 0;
  int deep_count = 0, open_count = 0;
  const int groups = static_cast<int>(lit.visible[0].size() / lit.positions[0].rows());
  for (int v = 0; v < lit.positions[0].rows(); ++v) {
    const Eigen::RowVector3f p = lit.positions[0].row(v);
    double seen = 0;
    for (int i = 0; i < groups; ++i) seen += std::popcount(lit.visible[0][static_cast<size_t>(v) * groups + i]);
    if (std::abs(p.x()) < 20 && p.y() < -20 && p.y() > -80 && p.z() > 30 && p.z() < 60) deep += seen, ++deep_count;
    if (std::abs(p.x()) < 40 && p.y() > 40 && p.z() > 50) open += seen, ++open_count;
  }
  ASSERT_GT(deep_count, 10);
  ASSERT_GT(open_count, 10);
  EXPECT_LT(deep / deep_count, 0.35 * open / open_count);
}

TEST(RendererTest, AlbedoShadingShowsTheTexturesOwnValues) {
  // Texels and pixels coincide: 64 x 64 texels on 100 mm, seen through a lens that puts 100 mm on 64 pixels.
  Material material;
  material.albedo = ImageU8(64, 64, 3);
  Random random(1);
  for (uint8_t& value : material.albedo.values()) value = static_cast<uint8_t>(random.Below(256));
  const ImageU8 texture = material.albedo;
  StillHead head;
  AddSquare(&head, 50, 0, 4, material);
  const HeadRenderer renderer(head, EvenLights(10), {.shading = Shading::kAlbedo, .samples = 1});
  const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), FrontCamera(64, 50));
  // Single-precision ray hits land within a hundredth of a texel of the centre.
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture.rgb.at(x, y)[c], texture.at(x, y)[c], 2);
    }
  }
}

TEST(RendererTest, TheMaskIsCoverage) {
  const StillHead head = Sphere(Matte());
  const HeadRenderer renderer(head, OneLight({0, 0, 1}, 1), {.samples = 16});
  const Camera camera = FrontCamera(60, 60);
  const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), camera);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      int inside = 0;
      for (int sub = 0; sub < 64; ++sub) {
        const int column = sub % 8, row = sub / 8;
        const Vector3d o = camera.CentreInWorld();
        const Vector3d d = camera.RayInWorld({x + (column + 0.5) / 8, y + (row + 0.5) / 8});
        inside += (o - o.dot(d) * d).norm() < kSphereRadius ? 1 : 0;
      }
      if (std::abs(inside - 32) < 10) continue;  // too close to half for 16 samples and a faceted sphere
      EXPECT_EQ(*picture.mask.at(x, y), inside > 32 ? 255 : 0) << x << " " << y;
      if (inside == 0) {
        EXPECT_EQ(picture.rgb.at(x, y)[0], 0);
      }
    }
  }
}

TEST(RendererTest, CoverageLetsThroughWhatIsBehind) {
  StillHead head;
  Material back = Matte(), front = Matte();
  back.albedo = Flat({200, 0, 0, 255});
  front.albedo = Flat({0, 100, 0, 128}, 4);
  Material cornea = Matte();
  cornea.transparent = true;
  AddSquare(&head, 50, 0, 1, back);
  AddSquare(&head, 50, 10, 1, front);
  AddSquare(&head, 50, 20, 1, cornea);
  const HeadRenderer renderer(head, OneLight({0, 0, 1}, 1), {.shading = Shading::kAlbedo, .samples = 1});
  const HeadPicture picture = renderer.Render(renderer.Light(head.posed(), {}), FrontCamera(8, 40));
  EXPECT_NEAR(picture.rgb.at(4, 4)[0], 200 * 127 / 255.0, 0.51);
  EXPECT_NEAR(picture.rgb.at(4, 4)[1], 100 * 128 / 255.0, 0.51);
  EXPECT_EQ(*picture.mask.at(4, 4), 255);
}

// u right and v up: a map that leans the normal to +u makes the surface face a light from +x.
TEST(RendererTest, NormalMapsLeanTheSurfaceAlongUAndV) {
  const auto value = [](const Vector3f& local, const Vector3d& light) {
    Material material = Matte();
    material.normal_map = ImageF(1, 1, 3);
    for (int c = 0; c < 3; ++c) material.normal_map.at(0, 0)[c] = local.normalized()[c];
    StillHead head;
    AddSquare(&head, 50, 0, 1, material);
    const HeadRenderer renderer(head, OneLight(light, kPi), {.samples = 1});
    return Linear(*renderer.Render(renderer.Light(head.posed(), {}), FrontCamera(8, 40)).rgb.at(4, 4));
  };
  const Vector3d from_x = Vector3d(1, 0, 1).normalized(), from_y = Vector3d(0, 1, 1).normalized();
  const Vector3f lean_u(0.3f, 0, 1), lean_v(0, 0.3f, 1);
  EXPECT_NEAR(value(lean_u, from_x), Linear(188) * lean_u.normalized().cast<double>().dot(from_x), 0.004);
  EXPECT_NEAR(value(lean_u, from_y), Linear(188) * lean_u.normalized().cast<double>().dot(from_y), 0.004);
  EXPECT_NEAR(value(lean_v, from_y), Linear(188) * lean_v.normalized().cast<double>().dot(from_y), 0.004);
}

TEST(RendererTest, PicturesDoNotDependOnThreads) {
  const auto head = MakeProceduralHead({.texture_size = 64, .detail = 1});
  const PosedHead posed = head->Pose(std::array<float, kExpressionCount>{});
  std::vector<HeadPicture> pictures;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    const HeadRenderer renderer(*head, EvenLights(50), {});
    pictures.push_back(renderer.Render(renderer.Light(posed, {}), FrontCamera(60, 120)));
  }
  SetThreadCount(0);
  for (const HeadPicture& picture : pictures) {
    EXPECT_EQ(picture.rgb, pictures[0].rgb);
    EXPECT_EQ(picture.mask, pictures[0].mask);
  }
}

// Head and camera moved together show the same picture when the lights move along.
TEST(RendererTest, HeadPosesMoveTheHead) {
  const auto head = MakeProceduralHead({.texture_size = 64, .detail = 1});
  const PosedHead posed = head->Pose(std::array<float, kExpressionCount>{});
  const RigidTransform pose{RotationFromYawPitchRoll(0.4, -0.2, 0.1), {30, -20, 50}};
  LightRig rig = EvenLights(30), moved_rig = rig;
  for (Light& light : moved_rig.lights) light.direction = pose.rotation.cast<float>() * light.direction;
  const Camera camera = FrontCamera(60, 130);
  Camera moved_camera = camera;
  moved_camera.cam_from_world = camera.cam_from_world * pose.Inverse();
  const HeadRenderer renderer(*head, rig, {}), moved_renderer(*head, moved_rig, {});
  const HeadPicture here = renderer.Render(renderer.Light(posed, {}), camera);
  const HeadPicture there = moved_renderer.Render(moved_renderer.Light(posed, pose), moved_camera);
  // Rounding may turn single rays and shadow rays.
  int different = 0;
  for (size_t i = 0; i < here.rgb.values().size(); ++i) {
    different += std::abs(here.rgb.values()[i] - there.rgb.values()[i]) > 6 ? 1 : 0;
  }
  EXPECT_LT(different, 0.01 * static_cast<double>(here.rgb.values().size()));
}

TEST(LightRigTest, LightsAreEvenAndExposed) {
  const LightRig rig = EvenLights(200, 0.9f);
  Vector3f mean = Vector3f::Zero();
  double facing = 0, closest = 10;
  for (size_t i = 0; i < rig.lights.size(); ++i) {
    const Light& light = rig.lights[i];
    EXPECT_NEAR(light.direction.norm(), 1, 1e-5);
    EXPECT_GT(light.irradiance, 0);
    mean += light.direction / 200;
    facing += light.irradiance * std::max(0.0f, light.direction.z()) / kPi;
    for (size_t j = 0; j < i; ++j)
      closest = std::min<double>(closest, (rig.lights[j].direction - light.direction).norm());
  }
  EXPECT_LT(mean.norm(), 0.01);
  EXPECT_NEAR(facing, 0.9, 1e-4);
  EXPECT_GT(closest, 0.15);  // a perfect spread of 200 has some 0.27
  EXPECT_NE(ErrorOf([] { EvenLights(0); }), "");
}

TEST(RendererTest, WrongOptionsAreErrors) {
  const StillHead head = Sphere(Matte());
  EXPECT_NE(ErrorOf([&] { HeadRenderer(head, EvenLights(1), {.samples = 0}); }), "");
}

}  // namespace
}  // namespace likeness
