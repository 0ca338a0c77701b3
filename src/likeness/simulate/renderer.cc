#include "likeness/simulate/renderer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/image/srgb.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Rays that pass a transparent or partly covered surface go on; after this many surfaces they end.
constexpr int kMostLayers = 16;
// Below this share of a ray nobody sees what follows.
constexpr float kLeastOpen = 0.01f;
// Rays go on this far behind a surface.
constexpr float kStepMm = 1e-3f;
constexpr size_t kPacket = 16;

// A vector of no length stays as it is.
Vector3f Normalised(const Vector3f& v) {
  const float squares = v.squaredNorm();
  return squares > 1e-30f ? Vector3f(v * (1 / std::sqrt(squares))) : v;
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

// What the samples of a pixel find on one surface. Values are sums over samples, each weighted with its share of the
// pixel.
struct HeadRenderer::Fragment {
  int surface = 0;
  // Of the first sample: which vertices' lights are interpolated, and how.
  Eigen::Vector3i corners;
  float weights[3] = {};
  float t = 0;      // along the ray, mm
  Vector3f view;    // towards the camera
  float share = 0;  // of the pixel
  Vector3f albedo = Vector3f::Zero();
  Vector3f smooth = Vector3f::Zero();  // normal without the normal map
  Vector3f normal = Vector3f::Zero();  // with it
  float roughness = 0;
  float specular = 0;

  // Scales the sums.
  void Weigh(float factor) {
    share *= factor;
    albedo *= factor;
    smooth *= factor;
    normal *= factor;
    roughness *= factor;
    specular *= factor;
  }

  bool SameSurface(const Fragment& other) const {
    constexpr float kNearMm = 3, kCosine = 0.9f;
    return surface == other.surface && std::abs(t - other.t) < kNearMm &&
           smooth.dot(other.smooth) > kCosine * smooth.norm() * other.smooth.norm();
  }

  void Join(const Fragment& other) {
    share += other.share;
    albedo += other.albedo;
    smooth += other.smooth;
    normal += other.normal;
    roughness += other.roughness;
    specular += other.specular;
  }
};

// What a camera's rays start from.
struct HeadRenderer::Lens {
  Vector3f origin;
  Eigen::Matrix3d unproject;               // direction through a pixel position (x, y): this times (x, y, 1)
  std::vector<Eigen::Vector2d> positions;  // of samples in a pixel
};

// Of a block of pixels: the rays, how much of each goes on, which ones do, and what they found. Kept from block to
// block, so that memory is asked for once.
struct HeadRenderer::Scratch {
  std::vector<Ray> rays, packet;
  std::vector<RayHit> hits;
  std::vector<float> open;
  std::vector<int> going_on;
  std::vector<std::vector<Fragment>> fragments;  // of each pixel
};

void ShadingOptions::Check() const {
  if (samples < 1 || samples > 64) throw Error("a pixel takes 1 to 64 samples, not {}", samples);
}

HeadRenderer::HeadRenderer(const Head& head, const LightRig& rig, const ShadingOptions& options)
    : head_(head), lights_(rig), options_(options) {
  options.Check();
  for (const Surface& surface : head.surfaces()) {
    maps_.emplace_back(surface.material, options.shading == Shading::kFull);
    std::vector<CornerUvs>& corners = corner_uvs_.emplace_back();
    for (const Eigen::Vector3i& uvs : surface.topology.triangle_uvs) {
      corners.push_back({surface.topology.uvs[uvs[0]], surface.topology.uvs[uvs[1]], surface.topology.uvs[uvs[2]]});
    }
  }
}

LitHead HeadRenderer::Light(const PosedHead& posed, const RigidTransform& world_from_head) const {
  return LightHead(head_, posed, world_from_head, options_.shading == Shading::kFull ? &lights_ : nullptr);
}

Vector2f HeadRenderer::TextureCoordinate(const RayHit& found) const {
  const CornerUvs& corners = corner_uvs_[static_cast<size_t>(found.mesh)][static_cast<size_t>(found.triangle)];
  return (1 - found.b1 - found.b2) * corners[0] + found.b1 * corners[1] + found.b2 * corners[2];
}

HeadRenderer::Fragment HeadRenderer::MakeFragment(const LitHead& lit, const Ray& ray, const RayHit& found) const {
  const Surface& surface = head_.surfaces()[found.mesh];
  const Material& material = surface.material;
  const bool full = options_.shading == Shading::kFull;
  Fragment fragment;
  fragment.surface = found.mesh;
  fragment.corners = surface.topology.triangles[found.triangle];
  fragment.weights[0] = 1 - found.b1 - found.b2;
  fragment.weights[1] = found.b1;
  fragment.weights[2] = found.b2;
  fragment.t = found.t;
  fragment.view = -ray.direction;
  const Vector2f uv = TextureCoordinate(found);
  const MaterialMaps& maps = maps_[static_cast<size_t>(found.mesh)];
  fragment.share = material.transparent ? 1 : maps.Coverage(uv);
  if (fragment.share == 0) return fragment;
  const SurfaceSample sample = maps.Sample(uv);
  fragment.albedo = sample.albedo;
  if (!full) return fragment;

  Vector3f corners[3];
  for (int k = 0; k < 3; ++k) {
    corners[k] = lit.positions[found.mesh].row(fragment.corners[k]).transpose();
    fragment.smooth += fragment.weights[k] * lit.normals[found.mesh].row(fragment.corners[k]).transpose();
  }
  const Vector3f edge1 = corners[1] - corners[0], edge2 = corners[2] - corners[0];
  // Hairs are round: a card of them looks the same from both sides.
  const bool behind = material.albedo.channels() != 4 && edge1.cross(edge2).dot(fragment.view) < 0;
  fragment.smooth = Normalised(fragment.smooth) * (behind ? -1.0f : 1.0f);
  fragment.normal = fragment.smooth;
  if (maps.has_normals()) {
    const CornerUvs& corner_uvs = corner_uvs_[static_cast<size_t>(found.mesh)][static_cast<size_t>(found.triangle)];
    const Vector2f d1 = corner_uvs[1] - corner_uvs[0], d2 = corner_uvs[2] - corner_uvs[0];
    const float side = d1.x() * d2.y() - d1.y() * d2.x() < 0 ? -1.0f : 1.0f;
    const auto tangential = [&](const Vector3f& v) -> Vector3f {
      return Normalised(v - fragment.smooth * fragment.smooth.dot(v));
    };
    const Vector3f tangent = tangential(side * (edge1 * d2.y() - edge2 * d1.y()));
    const Vector3f bitangent = tangential(side * (edge2 * d1.x() - edge1 * d2.x()));
    const Vector3f& local = sample.normal;
    fragment.normal = Normalised(tangent * local.x() + bitangent * local.y() + fragment.smooth * local.z());
  }
  fragment.roughness = sample.roughness;
  fragment.specular = sample.specular;
  return fragment;
}

// Adds what a ray meets to its pixel's fragments. `open` is how much of the ray came so far; returns how much goes on.
float HeadRenderer::Meet(const LitHead& lit, const Ray& ray, const RayHit& found, float open, float share,
                         std::vector<Fragment>* fragments) const {
  Fragment fragment = MakeFragment(lit, ray, found);
  if (fragment.share == 0) return open;
  const float coverage = fragment.share;
  fragment.share = 1;
  fragment.Weigh(share * open * coverage);
  const auto same = std::find_if(fragments->begin(), fragments->end(),
                                 [&](const Fragment& other) { return other.SameSurface(fragment); });
  if (same != fragments->end()) {
    same->Join(fragment);
  } else {
    fragments->push_back(fragment);
  }
  return head_.surfaces()[found.mesh].material.transparent ? open : open * (1 - coverage);
}

// Returns the light that a fragment sends towards the camera, weighted with its share.
Vector3f HeadRenderer::Shade(const LitHead& lit, const Fragment& fragment) const {
  const Material& material = head_.surfaces()[fragment.surface].material;
  const float scale = 1 / fragment.share;
  const Vector3f normal = Normalised(fragment.normal), smooth = Normalised(fragment.smooth);
  LightQuery query;
  for (int k = 0; k < 3; ++k) {
    query.visible[k] = lit.visible[fragment.surface].data() +
                       static_cast<size_t>(fragment.corners[k]) * static_cast<size_t>(lights_.groups());
    query.weights[k] = fragment.weights[k];
  }
  for (int c = 0; c < 3; ++c) {
    query.wrap[c] = material.scatter[c];
    query.diffuse_normal[c] = Normalised(normal + material.scatter[c] * (smooth - normal));
  }
  query.normal = normal;
  query.view = fragment.view;
  const auto alpha_of = [&](float roughness) {
    // A light of some size widens the highlight (Karis 2013).
    return std::clamp(roughness * roughness + 0.5f * lights_.angular_radius(), 0.01f, 1.0f);
  };
  query.specular = {alpha_of(fragment.roughness * scale), material.specular_f0};
  query.coat = {alpha_of(material.coat_roughness), 0.04f};
  query.has_specular = !material.transparent && fragment.specular > 0 && material.specular_f0 > 0;
  query.has_coat = material.coat > 0;
  const LightSum sum = SumLights(lights_, query);

  Vector3f colour = Vector3f::Constant(fragment.share * material.coat * sum.coat);
  if (material.transparent) return colour;
  const float kept = 1 - fragment.specular * scale * material.specular_f0;  // what the specular layer lets through
  float openness = 0;
  for (int k = 0; k < 3; ++k) {
    openness += fragment.weights[k] * lit.openness[fragment.surface][static_cast<size_t>(fragment.corners[k])];
  }
  for (int c = 0; c < 3; ++c) {
    // What hides the lights is of much the same colour and as bright as this point, and sends light here in turn.
    const float bounced = 1 + (1 - openness) * fragment.albedo[c] * scale;
    colour[c] += kept * fragment.albedo[c] * bounced * sum.diffuse[c] + fragment.specular * sum.specular;
  }
  return colour;
}

// The colour of a pixel.
Vector3f HeadRenderer::Resolve(const LitHead& lit, const std::vector<Fragment>& fragments) const {
  Vector3f colour = Vector3f::Zero();
  for (const Fragment& fragment : fragments) {
    if (options_.shading == Shading::kFull) {
      colour += Shade(lit, fragment);
    } else if (!head_.surfaces()[fragment.surface].material.transparent) {
      colour += fragment.albedo;
    }
  }
  return colour;
}

// Pixels that the projections of all vertices span.
HeadRenderer::PixelBox HeadRenderer::BoundingBox(const LitHead& lit, const Camera& camera) {
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

// Traces one small block of pixels, [x0, x1) x [y0, y1), and writes it.
void HeadRenderer::RenderBlock(const LitHead& lit, const Lens& lens, const PixelBox& block, Scratch* scratch,
                               HeadPicture* picture) const {
  const size_t samples = lens.positions.size();
  const float share = 1.0f / static_cast<float>(samples);
  const bool full = options_.shading == Shading::kFull;
  auto& [rays, packet, hits, open, going_on, fragments] = *scratch;
  rays.clear();
  going_on.clear();
  size_t pixels = 0;
  for (int y = block.y0; y < block.y1; ++y) {
    for (int x = block.x0; x < block.x1; ++x, ++pixels) {
      if (fragments.size() <= pixels) fragments.emplace_back();
      fragments[pixels].clear();
      for (const Eigen::Vector2d& position : lens.positions) {
        const Eigen::Vector3d direction = lens.unproject * Eigen::Vector3d(x + position.x(), y + position.y(), 1);
        going_on.push_back(static_cast<int>(rays.size()));
        rays.push_back({lens.origin, direction.normalized().cast<float>()});
      }
    }
  }
  open.assign(rays.size(), 1);
  for (int layer = 0; layer < kMostLayers && !going_on.empty(); ++layer) {
    size_t kept = 0;
    for (size_t begin = 0; begin < going_on.size(); begin += kPacket) {
      const size_t count = std::min(kPacket, going_on.size() - begin);
      packet.clear();
      for (size_t i = begin; i < begin + count; ++i) packet.push_back(rays[static_cast<size_t>(going_on[i])]);
      hits.resize(count);
      lit.scene.Intersect16(packet, hits);
      // Texels lie all over memory: ask for all before using the first.
      for (const RayHit& hit : hits) {
        if (hit.mesh >= 0) maps_[static_cast<size_t>(hit.mesh)].Prefetch(TextureCoordinate(hit));
      }
      for (size_t i = 0; i < count; ++i) {
        if (hits[i].mesh < 0) continue;
        const int index = going_on[begin + i];
        const auto r = static_cast<size_t>(index);
        open[r] = Meet(lit, rays[r], hits[i], open[r], share, &fragments[r / samples]);
        if (open[r] < kLeastOpen) continue;
        rays[r].t_min = hits[i].t + kStepMm;
        going_on[kept++] = index;
      }
    }
    going_on.resize(kept);
  }
  size_t pixel = 0;
  for (int y = block.y0; y < block.y1; ++y) {
    for (int x = block.x0; x < block.x1; ++x, ++pixel) {
      if (fragments[pixel].empty()) continue;
      float coverage = 0;
      for (size_t i = 0; i < samples; ++i) coverage += share * (1 - open[pixel * samples + i]);
      const Vector3f colour = Resolve(lit, fragments[pixel]);
      uint8_t* rgb = picture->rgb.at(x, y);
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(colour[c], 0.0f, 1.0f);
        rgb[c] = static_cast<uint8_t>(std::lround(255 * (full ? SrgbFromLinear(value) : value)));
      }
      // Sums of shares miss one half by rounding.
      *picture->mask.at(x, y) = coverage >= 0.5f - 1e-4f ? 255 : 0;
    }
  }
}

HeadPicture HeadRenderer::Render(const LitHead& lit, const Camera& camera) const {
  LIKENESS_CHECK(lit.head == &head_);
  HeadPicture picture{ImageU8(camera.width, camera.height, 3), ImageU8(camera.width, camera.height, 1)};
  const PixelBox box = BoundingBox(lit, camera);
  picture.camera_rays = int64_t{options_.samples} * (box.x1 - box.x0) * (box.y1 - box.y0);
  Lens lens;
  lens.origin = camera.CentreInWorld().cast<float>();
  lens.unproject = camera.cam_from_world.rotation.transpose() * camera.intrinsics.inverse();
  lens.positions = SamplePositions(options_.samples);
  // A block of pixels makes up a packet of rays, a tile of blocks keeps to one part of the head.
  const int samples = options_.samples;
  const int block_width = samples == 1 || samples == 2 ? 4 : samples <= 8 ? 2 : 1;
  const int block_height = samples == 1 ? 4 : samples <= 4 ? 2 : 1;
  constexpr int kTile = 32;
  const int across = (box.x1 - box.x0 + kTile - 1) / kTile, down = (box.y1 - box.y0 + kTile - 1) / kTile;
  ParallelFor(int64_t{across} * down, [&](int64_t index) {
    const int left = box.x0 + static_cast<int>(index % across) * kTile;
    const int top = box.y0 + static_cast<int>(index / across) * kTile;
    const int right = std::min(left + kTile, box.x1), bottom = std::min(top + kTile, box.y1);
    Scratch scratch;
    for (int y = top; y < bottom; y += block_height) {
      for (int x = left; x < right; x += block_width) {
        const PixelBox block = {x, std::min(x + block_width, right), y, std::min(y + block_height, bottom)};
        RenderBlock(lit, lens, block, &scratch, &picture);
      }
    }
  });
  return picture;
}

}  // namespace likeness
