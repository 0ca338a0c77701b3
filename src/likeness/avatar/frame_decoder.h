// What shows or judges an avatar needs of it: a texture and a mesh for a code, a view, and whose face it is.

#pragma once

#include <Eigen/Core>
#include <span>

#include "likeness/avatar/conditions.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

struct DecodedFrame {
  ImageF texture;             // RGB, 0 ... 255 but not clamped; square, row 0 is v = 1
  Vertices vertices_in_head;  // mm
};

class FrameDecoder {
 public:
  virtual ~FrameDecoder() = default;

  //   code           [latent] as Encode or the avatar's codes give it
  //   view_in_head   unit direction from the head's centre to the camera, head space (ViewVector)
  //   conditions     whose face, and the frame's named conditions
  virtual DecodedFrame Decode(std::span<const float> code, const Eigen::Vector3d& view_in_head,
                              const FrameConditions& conditions) const = 0;

  // The first person under mean conditions.
  DecodedFrame Decode(std::span<const float> code, const Eigen::Vector3d& view_in_head) const {
    return Decode(code, view_in_head, FrameConditions());
  }
};

}  // namespace likeness
