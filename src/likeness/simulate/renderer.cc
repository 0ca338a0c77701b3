#include "likeness/simulate/renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "likeness/base/parallel.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Rays that pass a transparent or partly covered surface go on; after this many surfaces they end.
constexpr int kMostLayers = 16;

float LinearFromSrgb(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

float SrgbFromLinear(float value) {
  return value <= 0.0031308f ? value * 12.92f : 1.055f * std::pow(value, 1 / 2.4f) - 0.055f;
}

const std::array<float, 256>& LinearTable() {
  static const auto table = [] {
    std::array<float, 256> t;
    for (int i = 0; i < 256; ++i) t[i] = LinearFromSrgb(static_cast<float>(i) / 255);
    return t;
  }();
  return table;
}

// The four texels around a texture coordinate and their weights; edges repeat.
struct Footprint {
  int x0, x1, y0, y1;
  float fx, fy;

  Footprint(const Vector2f& uv, int width, int height) {
    const float x = std::clamp(uv.x(), 0.0f, 1.0f) * static_cast<float>(width) - 0.5f;
    const float y = (1 - std::clamp(uv.y(), 0.0f, 1.0f)) * static_cast<float>(height) - 0.5f;
    const float x_floor = std::floor(x), y_floor = std::floor(y);
    fx = x - x_floor;
    fy = y - y_floor;
    x0 = std::max(static_cast<int>(x_floor), 0);
    y0 = std::max(static_cast<int>(y_floor), 0);
    x1 = std::min(static_cast<int>(x_floor) + 1, width - 1);
    y1 = std::min(static_cast<int>(y_floor) + 1, height - 1);
  }

  // value(x, y) -> float or vector
  template <typename F>
  auto Blend(const F& value) const {
    using T = decltype(value(0, 0));
    const T a = value(x0, y0), b = value(x1, y0), c = value(x0, y1), d = value(x1, y1);
    return T((1 - fy) * ((1 - fx) * a + fx * b) + fy * ((1 - fx) * c + fx * d));
  }
};

// RGB and coverage; `decode` maps a byte to a number.
Eigen::Vector4f SampleAlbedo(const ImageU8& image, const Vector2f& uv, const std::array<float, 256>& decode) {
  if (image.empty()) return Eigen::Vector4f::Ones();
  const bool has_alpha = image.channels() == 4;
  const bool grey = image.channels() < 3;
  return Footprint(uv, image.width(), image.height()).Blend([&](int x, int y) -> Eigen::Vector4f {
    const uint8_t* p = image.at(x, y);
    return {decode[p[0]], decode[p[grey ? 0 : 1]], decode[p[grey ? 0 : 2]],
            has_alpha ? static_cast<float>(p[3]) / 255 : 1.0f};
  });
}

float SampleScalar(const ImageF& map, const Vector2f& uv, float otherwise) {
  if (map.empty()) return otherwise;
  return Footprint(uv, map.width(), map.height()).Blend([&](int x, int y) { return *map.at(x, y); });
}

const std::array<float, 256>& ByteTable() {
  static const auto table = [] {
    std::array<float, 256> t;
    for (int i = 0; i < 256; ++i) t[i] = static_cast<float>(i) / 255;
    return t;
  }();
  return table;
}

// Pixels that the projections of all vertices span: [x0, x1) x [y0, y1).
struct PixelBox {
  int x0 = 0, x1 = 0, y0 = 0, y1 = 0;
};

PixelBox BoundingBox(const LitHead& lit, const Camera& camera) {
  Eigen::Array2d low(1e30, 1e30), high(-1e30, -1e30);
  for (const Vertices& positions : lit.positions) {
    for (int v = 0; v < positions.rows(); ++v) {
      const Eigen::Vector3d world = positions.row(v).transpose().cast<double>();
      // A head around the camera covers everything.
      if ((camera.cam_from_world * world).z() < 1) return {0, camera.width, 0, camera.height};
      const Eigen::Array2d pixel = camera.Project(world).array();
      low = low.min(pixel);
      high = high.max(pixel);
    }
  }
  PixelBox box;
  box.x0 = static_cast<int>(std::clamp(std::floor(low.x()), 0.0, static_cast<double>(camera.width)));
  box.y0 = static_cast<int>(std::clamp(std::floor(low.y()), 0.0, static_cast<double>(camera.height)));
  box.x1 = static_cast<int>(std::clamp(std::ceil(high.x()), 0.0, static_cast<double>(camera.width)));
  box.y1 = static_cast<int>(std::clamp(std::ceil(high.y()), 0.0, static_cast<double>(camera.height)));
  return box;
}

// Hammersley points: evenly spread for any count, the centre for one.
std::vector<Eigen::Vector2d> SamplePositions(int count) {
  std::vector<Eigen::Vector2d> positions;
  for (int i = 0; i < count; ++i) {
    double inverse = 0, digit = 0.5;
    for (int bits = i; bits != 0; bits >>= 1, digit /= 2) inverse += (bits & 1) != 0 ? digit : 0;
    positions.emplace_back((i + 0.5) / count, inverse + 0.5 / count);
  }
  return positions;
}

}  // namespace

// What one ray brings home.
struct HeadRenderer::Sample {
  Vector3f colour = Vector3f::Zero();
  float coverage = 0;
};

// A ray's meeting with a surface.
struct HeadRenderer::Hit {
  int surface = 0;
  Eigen::Vector3i corners;  // vertices
  float weights[3] = {};
  Vector2f uv;
  Eigen::Matrix<float, 3, 3> corner_positions;  // a column each
  Vector2f corner_uvs[3];
  Vector3f view;  // towards the camera
  Eigen::Vector4f albedo;
};

void RenderOptions::Check() const {
  if (samples < 1 || samples > 64) throw Error("a pixel takes 1 to 64 samples, not {}", samples);
}

HeadRenderer::HeadRenderer(const Head& head, const LightRig& rig, const RenderOptions& options)
    : head_(head), lights_(rig), options_(options) {
  options.Check();
}

LitHead HeadRenderer::Light(const PosedHead& posed, const RigidTransform& world_from_head) const {
  return LightHead(head_, posed, world_from_head, options_.shading == Shading::kFull ? &lights_ : nullptr);
}

// Returns the light that a surface point sends towards the camera.
Vector3f HeadRenderer::Shade(const LitHead& lit, const Hit& hit) const {
  const Material& material = head_.surfaces()[hit.surface].material;
  const Vertices& normals = lit.normals[hit.surface];
  Vector3f smooth = Vector3f::Zero();
  for (int k = 0; k < 3; ++k) smooth += hit.weights[k] * normals.row(hit.corners[k]).transpose();
  const Vector3f edge1 = hit.corner_positions.col(1) - hit.corner_positions.col(0);
  const Vector3f edge2 = hit.corner_positions.col(2) - hit.corner_positions.col(0);
  const Vector3f face = edge1.cross(edge2);
  if (face.dot(hit.view) < 0) smooth = -smooth;  // seen from behind
  smooth.normalize();

  Vector3f normal = smooth;
  if (!material.normal_map.empty()) {
    const Vector2f d1 = hit.corner_uvs[1] - hit.corner_uvs[0], d2 = hit.corner_uvs[2] - hit.corner_uvs[0];
    const float area = d1.x() * d2.y() - d1.y() * d2.x();
    Vector3f tangent = (edge1 * d2.y() - edge2 * d1.y()) * (area < 0 ? -1.0f : 1.0f);
    Vector3f bitangent = (edge2 * d1.x() - edge1 * d2.x()) * (area < 0 ? -1.0f : 1.0f);
    tangent = (tangent - smooth * smooth.dot(tangent)).stableNormalized();
    bitangent = (bitangent - smooth * smooth.dot(bitangent)).stableNormalized();
    const ImageF& map = material.normal_map;
    const Vector3f local = Footprint(hit.uv, map.width(), map.height()).Blend([&](int x, int y) -> Vector3f {
      return Eigen::Map<const Vector3f>(map.at(x, y));
    });
    normal = (tangent * local.x() + bitangent * local.y() + smooth * local.z()).stableNormalized();
  }

  LightQuery query;
  for (int k = 0; k < 3; ++k) {
    query.visibility[k] =
        lit.visibility[hit.surface].data() + static_cast<size_t>(hit.corners[k]) * static_cast<size_t>(lights_.size());
    query.weights[k] = hit.weights[k];
  }
  for (int c = 0; c < 3; ++c) {
    query.wrap[c] = material.scatter[c];
    query.diffuse_normal[c] = (normal + material.scatter[c] * (smooth - normal)).normalized();
  }
  query.normal = normal;
  query.view = hit.view;
  const auto alpha_of = [&](float roughness) {
    // A light of some size widens the highlight (Karis 2013).
    return std::clamp(roughness * roughness + 0.5f * lights_.angular_radius(), 0.01f, 1.0f);
  };
  const float specular = SampleScalar(material.specular_map, hit.uv, 1);
  query.specular = {alpha_of(SampleScalar(material.roughness_map, hit.uv, material.roughness)), material.specular_f0};
  query.coat = {alpha_of(material.coat_roughness), 0.04f};
  query.has_specular = !material.transparent && specular > 0 && material.specular_f0 > 0;
  query.has_coat = material.coat > 0;
  const LightSum sum = SumLights(lights_, query);

  Vector3f colour = Vector3f::Constant(material.coat * sum.coat);
  if (material.transparent) return colour;
  const float kept = 1 - specular * material.specular_f0;  // what the specular layer lets through
  for (int c = 0; c < 3; ++c) colour[c] += kept * hit.albedo[c] * sum.diffuse[c] + specular * sum.specular;
  return colour;
}

// Follows one ray through transparent and partly covered surfaces.
HeadRenderer::Sample HeadRenderer::Trace(const LitHead& lit, Ray ray) const {
  Sample sample;
  float open = 1;  // how much of the ray goes on
  const bool full = options_.shading == Shading::kFull;
  for (int layer = 0; layer < kMostLayers && open > 0.004f; ++layer) {
    const RayHit found = lit.scene.Intersect(ray);
    if (found.mesh < 0) break;
    ray.t_min = found.t + 1e-3f;  // t counts in millimetres
    const Surface& surface = head_.surfaces()[found.mesh];
    Hit hit;
    hit.surface = found.mesh;
    hit.corners = surface.topology.triangles[found.triangle];
    hit.weights[0] = 1 - found.b1 - found.b2;
    hit.weights[1] = found.b1;
    hit.weights[2] = found.b2;
    hit.uv.setZero();
    for (int k = 0; k < 3; ++k) {
      hit.corner_uvs[k] = surface.topology.uvs[surface.topology.triangle_uvs[found.triangle][k]];
      hit.uv += hit.weights[k] * hit.corner_uvs[k];
      hit.corner_positions.col(k) = lit.positions[found.mesh].row(hit.corners[k]).transpose();
    }
    hit.view = -ray.direction;
    if (surface.material.transparent) {
      if (full) sample.colour += open * Shade(lit, hit);
      continue;
    }
    hit.albedo = SampleAlbedo(surface.material.albedo, hit.uv, full ? LinearTable() : ByteTable());
    const float coverage = hit.albedo[3];
    if (coverage > 0) {
      sample.colour += open * coverage * (full ? Shade(lit, hit) : Vector3f(hit.albedo.head<3>()));
      sample.coverage += open * coverage;
    }
    open *= 1 - coverage;
  }
  return sample;
}

HeadPicture HeadRenderer::Render(const LitHead& lit, const Camera& camera) const {
  LIKENESS_CHECK(lit.head == &head_);
  HeadPicture picture{ImageU8(camera.width, camera.height, 3), ImageU8(camera.width, camera.height, 1)};
  const PixelBox box = BoundingBox(lit, camera);
  const std::vector<Eigen::Vector2d> positions = SamplePositions(options_.samples);
  const Vector3f origin = camera.CentreInWorld().cast<float>();
  const float share = 1.0f / static_cast<float>(options_.samples);
  const bool full = options_.shading == Shading::kFull;
  ParallelFor(box.y1 - box.y0, [&](int64_t row) {
    const int y = box.y0 + static_cast<int>(row);
    for (int x = box.x0; x < box.x1; ++x) {
      Vector3f colour = Vector3f::Zero();
      float coverage = 0;
      for (const Eigen::Vector2d& position : positions) {
        const Vector3f direction = camera.RayInWorld(Eigen::Vector2d(x, y) + position).cast<float>();
        const Sample sample = Trace(lit, {origin, direction});
        colour += sample.colour;
        coverage += sample.coverage;
      }
      uint8_t* rgb = picture.rgb.at(x, y);
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(colour[c] * share, 0.0f, 1.0f);
        rgb[c] = static_cast<uint8_t>(std::lround(255 * (full ? SrgbFromLinear(value) : value)));
      }
      *picture.mask.at(x, y) = coverage * share >= 0.5f ? 255 : 0;
    }
  });
  return picture;
}

}  // namespace likeness
