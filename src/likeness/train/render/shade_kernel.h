// The inner loops of drawing a textured mesh and of its gradients, without LibTorch.
//
// At a pixel centre q = (x, y, 1) that shows a triangle with corners v_j, let P = [P_0 P_1 P_2] hold the corners'
// homogeneous pixel coordinates P_j = M (v_j, 1). Then a = P^-1 q are the barycentric weights divided by the corners'
// depths (Olano and Greer 1997), so with s = a_0 + a_1 + a_2
//   b_i = a_i / s,   t = sum_i b_i t_i,   colour = bilinear sample of the texture at t,
// where t_i are the corners' texel coordinates. Backwards, with g = dL/dt from the sample,
//   h_i  = dL/da_i = g . (t_i - t) / s
//   dL/dP_j = -P^-T h a_j     as da = -P^-1 dP a
//   dL/dv_j = M' dL/dP_j      M' the transpose of M's first three columns
//   dL/dt_i = b_i g
// P^-T does not depend on the pixel: a triangle sums up h_i a_j over its pixels, and is multiplied once.
//
// Rasterising snaps corners to 1/256 pixel, so a centre may lie a trifle outside the triangle: a_i < 0 counts as 0 and
// passes no gradient, which keeps t inside the triangle however thin that is.

#pragma once

#include <cstdint>

namespace likeness {

// One image and what it shows. Real is float or double.
template <typename Real>
struct ShadeOperands {
  int height = 0, width = 0;
  const int32_t* triangle = nullptr;   // [height, width]; -1: nothing
  const double* projection = nullptr;  // M [3, 4], from the mesh to homogeneous pixel coordinates
  int64_t vertex_count = 0, triangle_count = 0;
  const Real* vertices = nullptr;         // [vertex_count, 3] mm
  const int64_t* triangles = nullptr;     // [triangle_count, 3], into vertices
  const int64_t* triangle_uvs = nullptr;  // [triangle_count, 3], into uvs
  const Real* uvs = nullptr;              // [..., 2]; v = 1 is the texture's first row
  int texture_height = 0, texture_width = 0;
  const Real* texture = nullptr;  // [texture_height, texture_width, 3]; its border is repeated
};

// image [height, width, 3]: 0 where there is no triangle.
template <typename Real>
void ShadeForward(const ShadeOperands<Real>& operands, Real* image);

// Adds to the gradients, each of the operand's shape; one that is null is left out.
//   dimage  [height, width, 3]
template <typename Real>
void ShadeBackward(const ShadeOperands<Real>& operands, const Real* dimage, Real* dtexture, Real* dvertices,
                   Real* duvs);

}  // namespace likeness
