#include "likeness/train/render/shade_kernel.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace likeness {
namespace {

// A triangle as its pixels need it: a_i = slope_x_i dx + slope_y_i dy + at_origin_i at (dx, dy) pixels from an origin
// on the triangle, so that nothing cancels in float. All a are scaled to a sum near 1.
template <typename Real>
struct Plane {
  Real slope_x[3], slope_y[3], at_origin[3];
  Real tx[3], ty[3];  // corners in texels, 0 at the first one's centre
  int x0 = 0, y0 = 0;
  int64_t triangle = 0;
  Eigen::Matrix3d inverse;                                                        // P^-1
  Eigen::Matrix3d sums = Eigen::Matrix3d::Zero();                                 // (i, j): h_i a_j over its pixels
  Eigen::Matrix<double, 2, 3> corner_sums = Eigen::Matrix<double, 2, 3>::Zero();  // b_i g
};

template <typename Real>
class Planes {
 public:
  explicit Planes(const ShadeOperands<Real>& operands)
      : o_(operands), projection_(operands.projection), slots_(operands.triangle_count, -1) {
    planes_.reserve(1024);
  }

  // The plane of a triangle that pixel (x, y) shows.
  Plane<Real>& At(int32_t triangle, int x, int y) {
    int32_t& slot = slots_[triangle];
    if (slot < 0) {
      slot = static_cast<int32_t>(planes_.size());
      planes_.push_back(Make(triangle, x, y));
    }
    return planes_[slot];
  }

  void AddGradients(Real* dvertices, Real* duvs) const {
    const Eigen::Matrix3d transposed = projection_.template leftCols<3>().transpose();
    for (const Plane<Real>& plane : planes_) {
      const Eigen::Matrix3d gradient = -transposed * (plane.inverse.transpose() * plane.sums);
      for (int j = 0; j < 3; ++j) {
        Real* dvertex = dvertices + 3 * o_.triangles[3 * plane.triangle + j];
        for (int axis = 0; axis < 3 && dvertices != nullptr; ++axis)
          dvertex[axis] += static_cast<Real>(gradient(axis, j));
        if (duvs == nullptr) continue;
        Real* duv = duvs + 2 * o_.triangle_uvs[3 * plane.triangle + j];
        duv[0] += static_cast<Real>(plane.corner_sums(0, j) * o_.texture_width);
        duv[1] -= static_cast<Real>(plane.corner_sums(1, j) * o_.texture_height);
      }
    }
  }

 private:
  Plane<Real> Make(int32_t triangle, int x, int y) const {
    Plane<Real> plane;
    plane.triangle = triangle;
    plane.x0 = x;
    plane.y0 = y;
    Eigen::Matrix3d corners;
    for (int j = 0; j < 3; ++j) {
      const Real* v = o_.vertices + 3 * o_.triangles[3 * plane.triangle + j];
      corners.col(j) = projection_ * Eigen::Vector4d(v[0], v[1], v[2], 1);
      const Real* uv = o_.uvs + 2 * o_.triangle_uvs[3 * plane.triangle + j];
      plane.tx[j] = uv[0] * static_cast<Real>(o_.texture_width) - Real(0.5);
      plane.ty[j] = (1 - uv[1]) * static_cast<Real>(o_.texture_height) - Real(0.5);
    }
    plane.inverse = corners.inverse();
    if (!plane.inverse.allFinite()) plane.inverse.setZero();
    const Eigen::Vector3d at_origin = plane.inverse * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
    const double sum = at_origin.sum(), scale = sum > 0 ? 1 / sum : 1;
    for (int i = 0; i < 3; ++i) {
      plane.slope_x[i] = static_cast<Real>(scale * plane.inverse(i, 0));
      plane.slope_y[i] = static_cast<Real>(scale * plane.inverse(i, 1));
      plane.at_origin[i] = static_cast<Real>(scale * at_origin[i]);
    }
    return plane;
  }

  const ShadeOperands<Real>& o_;
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> projection_;
  std::vector<int32_t> slots_;  // of each triangle in planes_
  std::vector<Plane<Real>> planes_;
};

// One axis of a bilinear sample.
template <typename Real>
struct Tap {
  int first = 0;        // texel; the other is the next one, if there is one
  Real share = 0;       // of the other
  bool inside = false;  // not held at the border, where the coordinate passes no gradient
};

template <typename Real>
inline Tap<Real> TapAt(Real t, int size) {
  const auto last = static_cast<Real>(size - 1);
  Tap<Real> tap;
  tap.inside = t > 0 && t < last;
  t = std::min(std::max(t, Real(0)), last);
  tap.first = std::min(static_cast<int>(t), std::max(size - 2, 0));
  tap.share = t - static_cast<Real>(tap.first);
  return tap;
}

// Where a pixel samples the texture.
template <typename Real>
struct Sample {
  Real a[3];            // before what is negative counts as 0
  Real c[3];            // after it
  Real over_sum = 0;    // 1 / s; 0: outside of everything, no gradient
  Real tx = 0, ty = 0;  // texels
};

template <typename Real>
inline Sample<Real> SampleAt(const Plane<Real>& plane, Real dx, const Real* row) {
  Sample<Real> s;
  for (int i = 0; i < 3; ++i) {
    s.a[i] = row[i] + plane.slope_x[i] * dx;
    s.c[i] = std::max(s.a[i], Real(0));
  }
  const Real sum = s.c[0] + s.c[1] + s.c[2];
  if (!(sum > 0)) {
    s.tx = plane.tx[0];
    s.ty = plane.ty[0];
    return s;
  }
  s.over_sum = 1 / sum;
  s.tx = (s.c[0] * plane.tx[0] + s.c[1] * plane.tx[1] + s.c[2] * plane.tx[2]) * s.over_sum;
  s.ty = (s.c[0] * plane.ty[0] + s.c[1] * plane.ty[1] + s.c[2] * plane.ty[2]) * s.over_sum;
  return s;
}

// Calls span(plane, y, x_begin, x_end) for pixels side by side that show one triangle.
template <typename Real, typename Span>
void ForSpans(const ShadeOperands<Real>& o, Planes<Real>* planes, const Span& span) {
  for (int y = 0; y < o.height; ++y) {
    const int32_t* row = o.triangle + static_cast<int64_t>(y) * o.width;
    for (int x = 0; x < o.width;) {
      const int32_t triangle = row[x];
      int end = x + 1;
      while (end < o.width && row[end] == triangle) ++end;
      if (triangle >= 0) span(planes->At(triangle, x, y), y, x, end);
      x = end;
    }
  }
}

}  // namespace

template <typename Real>
void ShadeForward(const ShadeOperands<Real>& o, Real* image) {
  std::fill_n(image, static_cast<int64_t>(o.height) * o.width * 3, Real(0));
  Planes<Real> planes(o);
  const int64_t right = o.texture_width > 1 ? 3 : 0, down = o.texture_height > 1 ? int64_t{3} * o.texture_width : 0;
  ForSpans(o, &planes, [&](const Plane<Real>& plane, int y, int x_begin, int x_end) {
    const auto dy = static_cast<Real>(y - plane.y0);
    Real row[3];
    for (int i = 0; i < 3; ++i) row[i] = plane.at_origin[i] + plane.slope_y[i] * dy;
    Real* pixel = image + (static_cast<int64_t>(y) * o.width + x_begin) * 3;
    for (int x = x_begin; x < x_end; ++x, pixel += 3) {
      const Sample<Real> s = SampleAt(plane, static_cast<Real>(x - plane.x0), row);
      const Tap<Real> tx = TapAt(s.tx, o.texture_width), ty = TapAt(s.ty, o.texture_height);
      const Real* texel = o.texture + (static_cast<int64_t>(ty.first) * o.texture_width + tx.first) * 3;
      for (int c = 0; c < 3; ++c) {
        const Real above = texel[c] + tx.share * (texel[right + c] - texel[c]);
        const Real below = texel[down + c] + tx.share * (texel[down + right + c] - texel[down + c]);
        pixel[c] = above + ty.share * (below - above);
      }
    }
  });
}

template <typename Real>
void ShadeBackward(const ShadeOperands<Real>& o, const Real* dimage, Real* dtexture, Real* dvertices, Real* duvs) {
  Planes<Real> planes(o);
  const bool geometry = dvertices != nullptr || duvs != nullptr;
  const int64_t right = o.texture_width > 1 ? 3 : 0, down = o.texture_height > 1 ? int64_t{3} * o.texture_width : 0;
  ForSpans(o, &planes, [&](Plane<Real>& plane, int y, int x_begin, int x_end) {
    const auto dy = static_cast<Real>(y - plane.y0);
    Real row[3], sums[3][3] = {}, corner_sums[3][2] = {};
    for (int i = 0; i < 3; ++i) row[i] = plane.at_origin[i] + plane.slope_y[i] * dy;
    const Real* dpixel = dimage + (static_cast<int64_t>(y) * o.width + x_begin) * 3;
    for (int x = x_begin; x < x_end; ++x, dpixel += 3) {
      if (dpixel[0] == 0 && dpixel[1] == 0 && dpixel[2] == 0) continue;
      const Sample<Real> s = SampleAt(plane, static_cast<Real>(x - plane.x0), row);
      const Tap<Real> tx = TapAt(s.tx, o.texture_width), ty = TapAt(s.ty, o.texture_height);
      const int64_t at = (static_cast<int64_t>(ty.first) * o.texture_width + tx.first) * 3;
      if (dtexture != nullptr) {
        Real* texel = dtexture + at;
        const Real below = ty.share, above = 1 - below;
        const Real w00 = above * (1 - tx.share), w01 = above * tx.share, w10 = below * (1 - tx.share),
                   w11 = below * tx.share;
        for (int c = 0; c < 3; ++c) {
          texel[c] += w00 * dpixel[c];
          texel[right + c] += w01 * dpixel[c];
          texel[down + c] += w10 * dpixel[c];
          texel[down + right + c] += w11 * dpixel[c];
        }
      }
      if (!geometry) continue;
      const Real* texel = o.texture + at;
      Real gx = 0, gy = 0;
      for (int c = 0; c < 3; ++c) {
        const Real above = texel[right + c] - texel[c], below = texel[down + right + c] - texel[down + c];
        const Real left = texel[down + c] - texel[c], far = texel[down + right + c] - texel[right + c];
        gx += dpixel[c] * (above + ty.share * (below - above));
        gy += dpixel[c] * (left + tx.share * (far - left));
      }
      gx = tx.inside ? gx * s.over_sum : 0;
      gy = ty.inside ? gy * s.over_sum : 0;
      for (int i = 0; i < 3; ++i) {
        const Real h = s.a[i] > 0 ? gx * (plane.tx[i] - s.tx) + gy * (plane.ty[i] - s.ty) : 0;
        for (int j = 0; j < 3; ++j) sums[i][j] += h * s.a[j];
        corner_sums[i][0] += s.c[i] * gx;
        corner_sums[i][1] += s.c[i] * gy;
      }
    }
    if (!geometry) return;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) plane.sums(i, j) += sums[i][j];
      for (int axis = 0; axis < 2; ++axis) plane.corner_sums(axis, i) += corner_sums[i][axis];
    }
  });
  if (geometry) planes.AddGradients(dvertices, duvs);
}

template void ShadeForward(const ShadeOperands<float>&, float*);
template void ShadeForward(const ShadeOperands<double>&, double*);
template void ShadeBackward(const ShadeOperands<float>&, const float*, float*, float*, float*);
template void ShadeBackward(const ShadeOperands<double>&, const double*, double*, double*, double*);

}  // namespace likeness
