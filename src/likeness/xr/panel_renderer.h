// Flat pictures in space: the menu, the ray that points at it.

#pragma once

#include "likeness/geometry/camera.h"
#include "likeness/gl/objects.h"

namespace likeness {

class GlPanelRenderer {
 public:
  // For the context that is current now and in every call.
  explicit GlPanelRenderer(const GlFunctions& gl);

  // Draws into the framebuffer that is bound, as large as the camera's image, whose depth a GlMeshRenderer may have
  // filled. Seen from both sides.
  //   texture            two-dimensional, row 0 at the bottom, sRGB-encoded, colours times opacity
  //   local_from_panel   the panel lies around its origin at z = 0, x to its right, y up
  void Draw(GLuint texture, const Camera& camera, const RigidTransform& local_from_panel, double width_mm,
            double height_mm) const;

 private:
  const GlFunctions* gl_;
  GlProgram program_;
  GLint clip_from_panel_, half_size_;
  GlVertexArray array_;
};

// A texture of one colour, RGBA, times opacity.
GlTexture PlainTexture(const GlFunctions& gl, const uint8_t (&rgba)[4]);

}  // namespace likeness
