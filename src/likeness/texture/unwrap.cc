#include "likeness/texture/unwrap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Zero for triangles without area (less than a millionth of their longest side squared), which then face no camera.
Eigen::Vector3f Normal(const Vertices& vertices, const Eigen::Vector3i& corners) {
  const auto corner = [&](int i) -> Eigen::Vector3d { return vertices.row(corners[i]).cast<double>(); };
  const Eigen::Vector3d ab = corner(1) - corner(0), ac = corner(2) - corner(0), bc = corner(2) - corner(1);
  const Eigen::Vector3d normal = ab.cross(ac);
  const double longest_squared = std::max({ab.squaredNorm(), ac.squaredNorm(), bc.squaredNorm()});
  if (normal.norm() <= 1e-6 * longest_squared) return Eigen::Vector3f::Zero();
  return normal.normalized().cast<float>();
}

// Where a texel's colour comes from: the upper left of four pixels, and the weights of the right and lower ones.
struct Footprint {
  int x = 0, y = 0;
  float right = 0, lower = 0;
};

// Whether all four pixels are in the image, which also sorts out positions that are not finite.
bool Locate(float x_px, float y_px, int width, int height, Footprint* footprint) {
  const float x = x_px - 0.5f, y = y_px - 0.5f;
  if (!(x >= 0 && y >= 0 && x <= static_cast<float>(width - 1) && y <= static_cast<float>(height - 1))) return false;
  footprint->x = std::min(static_cast<int>(x), width - 2);
  footprint->y = std::min(static_cast<int>(y), height - 2);
  footprint->right = x - static_cast<float>(footprint->x);
  footprint->lower = y - static_cast<float>(footprint->y);
  return true;
}

// Neighbouring texels can lie on rows of pixels that are kilobytes apart.
void Prefetch(const ImageU8& image, const Footprint& f) {
  __builtin_prefetch(image.at(f.x, f.y));
  __builtin_prefetch(image.at(f.x, f.y + 1));
}

bool IsHead(const ImageU8& mask, const Footprint& f) {
  const uint8_t* upper = mask.at(f.x, f.y);
  const uint8_t* lower = mask.at(f.x, f.y + 1);
  return (upper[0] & upper[1] & lower[0] & lower[1]) == 255;
}

// The unseen are 0 in published textures, so the seen are at least 1.
void Sample(const ImageU8& image, const Footprint& f, uint8_t* texel) {
  const uint8_t* upper = image.at(f.x, f.y);
  const uint8_t* lower = image.at(f.x, f.y + 1);
  const float w11 = f.right * f.lower, w10 = f.right - w11, w01 = f.lower - w11, w00 = 1 - f.right - w01;
  for (int c = 0; c < 3; ++c) {
    const float value = w00 * upper[c] + w10 * upper[3 + c] + w01 * lower[c] + w11 * lower[3 + c];
    texel[c] = static_cast<uint8_t>(std::max(1, static_cast<int>(value + 0.5f)));
  }
}

}  // namespace

void UnwrapOptions::Check() const {
  if (size < 16 || size > 8192) throw Error("--size {}: expected 16 to 8192 texels", size);
  if (!(grazing_deg >= 1 && grazing_deg <= 89)) throw Error("--grazing {}: expected 1 to 89 degrees", grazing_deg);
}

FrameUnwrapper::FrameUnwrapper(const MeshTopology& topology, const TexelMap& texels, const Vertices& vertices_in_head,
                               const UnwrapOptions& options)
    : size_(texels.size), min_cosine_(static_cast<float>(std::cos(options.grazing_deg * std::numbers::pi / 180))) {
  LIKENESS_CHECK(vertices_in_head.rows() == topology.vertex_count);
  scene_.Add(vertices_in_head, topology.triangles);
  scene_.Build();

  std::vector<Eigen::Vector3f> normals(topology.triangles.size());
  for (size_t t = 0; t < normals.size(); ++t) normals[t] = Normal(vertices_in_head, topology.triangles[t]);

  float largest_mm = 0;
  blocks_.reserve(static_cast<size_t>((size_ + 3) / 4) * static_cast<size_t>((size_ + 3) / 4));
  for (int y = 0; y < size_; y += 4) {
    for (int x = 0; x < size_; x += 4) {
      Block block = {};
      block.x = x;
      block.y = y;
      for (int i = 0; i < 16; ++i) {
        const int column = x + i % 4, row = y + i / 4;
        if (column >= size_ || row >= size_) continue;
        const TexelMap::Texel& texel = texels.at(column, row);
        if (texel.triangle < 0) continue;
        const Eigen::Vector3i& corners = topology.triangles[static_cast<size_t>(texel.triangle)];
        const Eigen::RowVector3f point = (1 - texel.b1 - texel.b2) * vertices_in_head.row(corners[0]) +
                                         texel.b1 * vertices_in_head.row(corners[1]) +
                                         texel.b2 * vertices_in_head.row(corners[2]);
        const Eigen::Vector3f& normal = normals[static_cast<size_t>(texel.triangle)];
        block.covered |= 1u << i;
        block.px[i] = point.x(), block.py[i] = point.y(), block.pz[i] = point.z();
        block.nx[i] = normal.x(), block.ny[i] = normal.y(), block.nz[i] = normal.z();
        largest_mm = std::max(largest_mm, point.cwiseAbs().maxCoeff());
      }
      if (block.covered != 0) blocks_.push_back(block);
    }
  }
  // Interpolation and intersection round coordinates of up to largest_mm a few times each, which moves the point off
  // its plane; at the steepest angle that counts, the ray crosses that gap in 1 / min_cosine times its width.
  clearance_mm_ = 16 * std::numeric_limits<float>::epsilon() * largest_mm / min_cosine_;
}

uint32_t FrameUnwrapper::Facing(const Block& block, const Eigen::Vector3f& centre) const {
  const float least = min_cosine_ * min_cosine_;
  float margin[16];  // negative where the texel faces away, or is seen at too flat an angle
  for (int i = 0; i < 16; ++i) {
    const float dx = centre.x() - block.px[i], dy = centre.y() - block.py[i], dz = centre.z() - block.pz[i];
    const float dot = dx * block.nx[i] + dy * block.ny[i] + dz * block.nz[i];
    margin[i] = dot * std::abs(dot) - least * (dx * dx + dy * dy + dz * dz);
  }
  uint32_t facing = 0;
  for (int i = 0; i < 16; ++i) facing |= (margin[i] >= 0 ? 1u : 0u) << i;
  return facing & block.covered;
}

uint32_t FrameUnwrapper::Unoccluded(const Block& block, uint32_t wanted, const Eigen::Vector3f& centre) const {
  RayPacket16 rays;
  std::copy_n(block.px, 16, rays.origin_x);
  std::copy_n(block.py, 16, rays.origin_y);
  std::copy_n(block.pz, 16, rays.origin_z);
  for (int i = 0; i < 16; ++i) {
    // t runs from 0 at the surface to 1 at the camera.
    const float dx = centre.x() - block.px[i], dy = centre.y() - block.py[i], dz = centre.z() - block.pz[i];
    rays.direction_x[i] = dx;
    rays.direction_y[i] = dy;
    rays.direction_z[i] = dz;
    rays.t_min[i] = clearance_mm_ / std::sqrt(dx * dx + dy * dy + dz * dz);
    rays.t_max[i] = 1;
  }
  return wanted & ~scene_.Occluded16(rays, wanted);
}

ImageU8 FrameUnwrapper::Visibility(const Eigen::Vector3d& camera_centre_in_head) const {
  const Eigen::Vector3f centre = camera_centre_in_head.cast<float>();
  ImageU8 mask(size_, size_, 1);
  for (const Block& block : blocks_) {
    uint32_t seen = Facing(block, centre);
    if (seen != 0) seen = Unoccluded(block, seen, centre);
    for (; seen != 0; seen &= seen - 1) {
      const int i = std::countr_zero(seen);
      *mask.at(block.x + i % 4, block.y + i / 4) = 255;
    }
  }
  return mask;
}

UnwrappedView FrameUnwrapper::Unwrap(const Camera& camera, const RigidTransform& world_from_head, const ImageU8& image,
                                     const ImageU8* head_mask) const {
  LIKENESS_CHECK(image.width() == camera.width && image.height() == camera.height && image.channels() == 3);
  LIKENESS_CHECK(camera.width >= 2 && camera.height >= 2);
  LIKENESS_CHECK(head_mask == nullptr || (head_mask->width() == image.width() &&
                                          head_mask->height() == image.height() && head_mask->channels() == 1));
  const RigidTransform cam_from_head = camera.cam_from_world * world_from_head;
  const Eigen::Vector3f centre = cam_from_head.Inverse().translation.cast<float>();
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << cam_from_head.rotation, cam_from_head.translation;
  const Eigen::Matrix<float, 3, 4> image_from_head = (camera.intrinsics * matrix).cast<float>();

  UnwrappedView view = {ImageU8(size_, size_, 3), ImageU8(size_, size_, 1)};
  std::array<Footprint, 16> footprints;
  for (const Block& block : blocks_) {
    uint32_t seen = Facing(block, centre);
    for (uint32_t rest = seen; rest != 0; rest &= rest - 1) {
      const int i = std::countr_zero(rest);
      const Eigen::Vector3f p = image_from_head * Eigen::Vector4f(block.px[i], block.py[i], block.pz[i], 1);
      Footprint& footprint = footprints[static_cast<size_t>(i)];
      if (p.z() > 0 && Locate(p.x() / p.z(), p.y() / p.z(), camera.width, camera.height, &footprint)) {
        Prefetch(image, footprint);
        if (head_mask != nullptr) Prefetch(*head_mask, footprint);
      } else {
        seen &= ~(1u << i);
      }
    }
    if (seen != 0) seen = Unoccluded(block, seen, centre);  // while the pixels come
    for (; seen != 0; seen &= seen - 1) {
      const int i = std::countr_zero(seen);
      const Footprint& footprint = footprints[static_cast<size_t>(i)];
      if (head_mask != nullptr && !IsHead(*head_mask, footprint)) continue;
      const int x = block.x + i % 4, y = block.y + i / 4;
      Sample(image, footprint, view.texture.at(x, y));
      *view.mask.at(x, y) = 255;
    }
  }
  return view;
}

}  // namespace likeness
