// From a camera image to a texture: for each texel, the colour of its surface point if the camera sees it.
// Lombardi et al. 2018, section "Building A Data-driven Avatar"; the average texture (equation 1) is in texture_sums.h.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/image/image.h"

namespace likeness {

struct UnwrapOptions {
  int size = 1024;          // texels a side
  double grazing_deg = 80;  // between a triangle's normal and the direction to the camera; seen no further than this
  bool use_masks = true;    // texels take colour from head pixels alone, where the capture has masks
  bool held_out = true;     // also unwrap cameras that are held out; evaluation of textures needs them
  bool redo = false;        // drop textures of this size that exist

  // Throws Error when a value is out of range.
  void Check() const;
};

// What one camera shows of the texture.
struct UnwrappedView {
  ImageU8 texture;  // RGB, row 0 is v = 1; at least 1 in every channel where seen, 0 where not
  ImageU8 mask;     // 1 channel: w of equation 1, as 255 (seen) and 0
};

// One frame's mesh, made ready to be seen from any number of cameras. Const methods may be called from many threads.
class FrameUnwrapper {
 public:
  // `texels` must be of `topology`; it is the same for all frames.
  FrameUnwrapper(const MeshTopology& topology, const TexelMap& texels, const Vertices& vertices_in_head,
                 const UnwrapOptions& options);

  // A texel is seen when its triangle faces the camera at no more than the grazing angle and nothing of the mesh, front
  // or back, lies between the camera and its surface point. Triangles without area show nothing. 1 channel: 255 or 0.
  //
  // The ray starts at the surface point, in head space, where coordinates and so their rounding are small. Its first
  // `clearance_mm()` are free: rounding leaves the point off its own triangle by up to that much along the ray.
  ImageU8 Visibility(const Eigen::Vector3d& camera_centre_in_head) const;

  // Bilinear samples of `image` (RGB, of the camera's size) at the projections of the texels that are visible, where
  // the four pixels lie inside the image and, if a head mask is given, all four are head (255).
  UnwrappedView Unwrap(const Camera& camera, const RigidTransform& world_from_head, const ImageU8& image,
                       const ImageU8* head_mask) const;

  float clearance_mm() const { return clearance_mm_; }

 private:
  // 4 x 4 texels, which share one packet of rays.
  struct Block {
    int x = 0, y = 0;                             // of its first texel
    uint32_t covered = 0;                         // bit 4 * row + column: a triangle covers this texel
    float px[16] = {}, py[16] = {}, pz[16] = {};  // surface points, mm, head space
    float nx[16] = {}, ny[16] = {}, nz[16] = {};  // unit normals of their triangles
  };

  uint32_t Facing(const Block& block, const Eigen::Vector3f& centre) const;
  uint32_t Unoccluded(const Block& block, uint32_t wanted, const Eigen::Vector3f& centre) const;

  const int size_;
  const float min_cosine_;
  float clearance_mm_ = 0;
  std::vector<Block> blocks_;
  RayScene scene_;
};

}  // namespace likeness
