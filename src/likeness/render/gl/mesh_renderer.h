// Mesh + texture + camera -> pixels, by OpenGL 3.3. The same pictures as the CPU's renderer (render/rasterizer.h)
// makes, but for pixels that an edge crosses, and for textures that are seen smaller than they are: here they are
// mip-mapped.

#pragma once

#include <Eigen/Core>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/geometry/rigid.h"
#include "likeness/gl/objects.h"
#include "likeness/render/mesh_style.h"

namespace likeness {

// From a mesh's own space, mm, to OpenGL's clip space of a camera's whole image; what lies nearer than `near_mm` or
// farther than `far_mm` along the camera's axis is cut off.
Eigen::Matrix4d ClipFromMesh(const Camera& camera, const RigidTransform& world_from_mesh, double near_mm,
                             double far_mm);

// What a mesh is drawn with, for others who draw into the same depth. Twenty thousandfold: with 24 bits of depth 0.01
// mm are told apart at half a metre.
inline constexpr double kNearMm = 10;
inline constexpr double kFarMm = 2e5;

class GlMeshRenderer {
 public:
  // For the context that is current now and in every call.
  explicit GlMeshRenderer(const GlFunctions& gl);

  // Before anything else; may be called again for another mesh.
  void SetTopology(const MeshTopology& topology);
  void SetVertices(const Vertices& vertices);  // as many as the topology has

  // Draws into columns x ... x + camera.width - 1 of the framebuffer that is bound, which is as high as the camera's
  // image and has a depth buffer that is cleared.
  //   texture  two-dimensional, row 0 is v = 1, sRGB-encoded values in a linear format
  void Draw(GLuint texture, const Camera& camera, const RigidTransform& world_from_mesh, int x,
            const MeshStyle& style = {}) const;

 private:
  void DrawTriangles(bool textured, const MeshStyle& style) const;

  const GlFunctions* gl_;
  GlProgram program_;
  GLint clip_from_mesh_, exposure_, line_colour_, textured_;
  GlVertexArray array_;
  GlBuffer positions_, uvs_, indices_;
  std::vector<int> corner_vertices_;  // the mesh's vertex of each of ours: one for each pair of vertex and uv
  std::vector<float> gathered_;       // [corner_vertices_, 3]
  int index_count_ = 0;
};

// A square RGBA texture that gets new texels for every frame, through a buffer, so that the caller does not wait for
// the device. Sampled with all its smaller levels, trilinearly.
class GlTextureStream {
 public:
  explicit GlTextureStream(const GlFunctions& gl) : gl_(&gl) {}

  //   texels  size x size x 4 bytes, row 0 is v = 1
  void Upload(const uint8_t* texels, int size);
  GLuint id() const { return texture_.id(); }  // 0 before the first upload
  int size() const { return size_; }

 private:
  const GlFunctions* gl_;
  GlTexture texture_;
  GlBuffer buffer_;
  int size_ = 0;
};

}  // namespace likeness
