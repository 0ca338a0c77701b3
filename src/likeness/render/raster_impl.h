// The kernels' code, for any width of vector; included once by each kernel, which defines LIKENESS_VECTOR_BYTES and the
// three functions that are declared here.

#pragma once

#include "likeness/render/raster_kernel.h"

namespace likeness {
namespace {

constexpr int kLanes = LIKENESS_VECTOR_BYTES / 4;
typedef float Floats __attribute__((vector_size(LIKENESS_VECTOR_BYTES), aligned(4), may_alias));
typedef int32_t Ints __attribute__((vector_size(LIKENESS_VECTOR_BYTES), aligned(4), may_alias));
typedef float Texel __attribute__((vector_size(16)));
typedef float TexelPair __attribute__((vector_size(32)));  // two neighbours, red to opacity and again

// Two texels that follow each other in memory.
inline void LoadPair(const uint8_t* from, TexelPair* pair);
// A colour of 0 to 255, cut to whole numbers.
inline uint32_t Pack(const Texel* colour);
// A bit for each lane of a mask, whose lanes are 0 or -1.
inline uint32_t BitsOf(const Ints& mask);

inline Floats Load(const float* from) { return *reinterpret_cast<const Floats*>(from); }
inline void Store(float* to, Floats v) { *reinterpret_cast<Floats*>(to) = v; }
inline Ints LoadInts(const void* from) { return *static_cast<const Ints*>(from); }
inline void StoreInts(void* to, Ints v) { *static_cast<Ints*>(to) = v; }
inline Floats ToFloats(Ints v) { return __builtin_convertvector(v, Floats); }
inline Ints ToInts(Floats v) { return __builtin_convertvector(v, Ints); }
inline Floats Max(Floats a, Floats b) { return a > b ? a : b; }

// What is no number becomes `least`.
inline Floats Clamp(Floats v, Floats least, Floats most) {
  v = v > least ? v : least;
  return v < most ? v : most;
}

inline Ints LaneNumbers() {
  Ints lanes;
  for (int i = 0; i < kLanes; ++i) lanes[i] = i;
  return lanes;
}

// Where the pixels of each row begin and end that a triangle covers in a tile, for one sample of each pixel. Exact: an
// edge is crossed where x = -(b y + c) / a, with c cut to whole pixels. Half is added to b y + c, a whole number, so
// that no crossing is at a whole number; it is at least 2^-30 away from one, far more than what a double's division
// rounds.
struct Spans {
  int32_t begin[kTileHeight], end[kTileHeight];
};

struct Box {
  int x_begin, x_end, y_begin, y_end;
};

inline void FindSpans(const RasterTriangle& t, const Box& box, int sample_x, int sample_y, Spans* spans) {
  const int rows = box.y_end - box.y_begin;
  const double first = box.x_begin - 1, most = box.x_end - box.x_begin;
  for (int r = 0; r < rows; ++r) spans->begin[r] = box.x_begin, spans->end[r] = box.x_end;
  for (int e = 0; e < 3; ++e) {
    const int64_t c =
        (t.c[e] + 16 * (static_cast<int64_t>(t.a[e]) * sample_x + static_cast<int64_t>(t.b[e]) * sample_y)) >> 8;
    const double a = t.a[e], b = t.b[e], at0 = static_cast<double>(c) + b * box.y_begin + 0.5;
    int32_t* const limit = t.a[e] < 0 ? spans->end : spans->begin;
    int32_t crossing[kTileHeight];
    for (int r = 0; r < rows; ++r) {
      double x = -(at0 + b * r) / a - first;
      x = x > 0 ? x : 0;
      x = x < most ? x : most;
      crossing[r] = box.x_begin + static_cast<int32_t>(x);
    }
    if (t.a[e] < 0) {
      for (int r = 0; r < rows; ++r) limit[r] = limit[r] < crossing[r] ? limit[r] : crossing[r];
    } else {
      for (int r = 0; r < rows; ++r) limit[r] = limit[r] > crossing[r] ? limit[r] : crossing[r];
    }
  }
}

// Where in a level of the texture pixels look.
struct LevelCoordinates {
  int32_t first[kLanes];       // the upper left of four texels
  float x[kLanes], y[kLanes];  // how far to the others, 0 to 1
};

// `scale` is 1 / 2^level.
inline void FindTexels(Floats u, Floats v, Floats scale, float size, LevelCoordinates* found) {
  const Floats side = scale * size, zero = {};
  const Floats x = Clamp(u * scale - 0.5f, zero, side - 1), y = Clamp(v * scale - 0.5f, zero, side - 1);
  const Ints x0 = ToInts(x < side - 2 ? x : side - 2), y0 = ToInts(y < side - 2 ? y : side - 2);
  StoreInts(found->first, y0 * ToInts(side) + x0);
  Store(found->x, x - ToFloats(x0));
  Store(found->y, y - ToFloats(y0));
}

// Half of the binary logarithm, by the exponent and a parabola for the mantissa; 0.005 off at most.
inline Floats HalfLog2(Floats square) {
  const Ints bits = (Ints)square;
  const Floats exponent = ToFloats((bits >> 23) - 127), mantissa = (Floats)((bits & 0x7fffff) | 0x3f800000);
  return 0.5f * (exponent + ((-1.0f / 3) * mantissa + 2) * mantissa - 5.0f / 3);
}

inline void Sample(const MipMaps& texture, int level, const LevelCoordinates& at, int lane, float share,
                   TexelPair* sum) {
  const uint8_t* const texels = texture.levels[level] + 4 * static_cast<int64_t>(at.first[lane]);
  TexelPair above, below;
  LoadPair(texels, &above);
  LoadPair(texels + 4 * static_cast<int64_t>(texture.size >> level), &below);
  const TexelPair left = {1, 1, 1, 1, 0, 0, 0, 0}, turn = {-1, -1, -1, -1, 1, 1, 1, 1};
  *sum += (above + (below - above) * at.y[lane]) * ((left + turn * at.x[lane]) * share);
}

// The texture's colours at the lanes of `bits`, trilinear, of the level whose texels are as large as the pixel's
// footprint along the longer of its sides.
//   x, y  pixels from the first of the triangle's box
inline void Shade(const RasterTriangle& t, const MipMaps& texture, Floats x, float y, Floats over_depth, uint32_t bits,
                  uint32_t* colours) {
  const Floats depth = 1 / over_depth;
  const Floats u = Clamp((t.u.at0 + t.u.dy * y + t.u.dx * x) * depth, Floats{} + t.least_u, Floats{} + t.most_u);
  const Floats v = Clamp((t.v.at0 + t.v.dy * y + t.v.dx * x) * depth, Floats{} + t.least_v, Floats{} + t.most_v);
  const Floats u_dx = (t.u.dx - u * t.over_depth.dx) * depth, u_dy = (t.u.dy - u * t.over_depth.dy) * depth;
  const Floats v_dx = (t.v.dx - v * t.over_depth.dx) * depth, v_dy = (t.v.dy - v * t.over_depth.dy) * depth;
  const Floats square = Max(u_dx * u_dx + v_dx * v_dx, u_dy * u_dy + v_dy * v_dy);
  const Floats most = Floats{} + static_cast<float>(texture.count - 1), zero = {};
  const Floats detail = Clamp(HalfLog2(square), zero, most);
  const Ints level = ToInts(detail < most - 1 ? detail : most - 1);
  const Floats scale = (Floats)((127 - level) << 23);

  int32_t levels[kLanes];
  float shares[kLanes];  // of the coarser level
  LevelCoordinates fine, coarse;
  StoreInts(levels, level);
  Store(shares, detail - ToFloats(level));
  FindTexels(u, v, scale, static_cast<float>(texture.size), &fine);
  FindTexels(u, v, 0.5f * scale, static_cast<float>(texture.size), &coarse);
  for (; bits != 0; bits &= bits - 1) {
    const int lane = __builtin_ctz(bits);
    const float share = shares[lane];
    TexelPair sum = {};
    Sample(texture, levels[lane], fine, lane, 1 - share, &sum);
    if (share > 0) Sample(texture, levels[lane] + 1, coarse, lane, share, &sum);
    const Texel colour =
        __builtin_shufflevector(sum, sum, 0, 1, 2, 3) + __builtin_shufflevector(sum, sum, 4, 5, 6, 7) + 0.5f;
    colours[lane] = Pack(&colour);
  }
}

template <int kSamples>
void DrawTriangle(const RasterTriangle& t, const MipMaps& texture, const RasterTile& tile) {
  const Box box = {
      t.x_begin > tile.x ? t.x_begin : tile.x, t.x_end < tile.x + tile.width ? t.x_end : tile.x + tile.width,
      t.y_begin > tile.y ? t.y_begin : tile.y, t.y_end < tile.y + tile.height ? t.y_end : tile.y + tile.height};
  Spans spans[kSamples];
  for (int s = 0; s < kSamples; ++s) {
    FindSpans(t, box, kSamples == 1 ? 0 : kSampleX[s], kSamples == 1 ? 0 : kSampleY[s], &spans[s]);
  }
  const Ints lanes = LaneNumbers();
  const Floats least = Floats{} + t.least_over_depth, most = Floats{} + t.most_over_depth;
  for (int r = 0; r < box.y_end - box.y_begin; ++r) {
    int begin = box.x_end, end = box.x_begin;
    for (int s = 0; s < kSamples; ++s) {
      if (spans[s].begin[r] >= spans[s].end[r]) continue;
      begin = spans[s].begin[r] < begin ? spans[s].begin[r] : begin;
      end = spans[s].end[r] > end ? spans[s].end[r] : end;
    }
    const float y = static_cast<float>(box.y_begin + r - t.y_begin);
    const float row_over_depth = t.over_depth.at0 + t.over_depth.dy * y;
    const int row = (box.y_begin + r - tile.y) * kTilePitch - tile.x;
    for (int x = begin; x < end; x += kLanes) {
      const Ints column = lanes + x;
      const Floats in_box = ToFloats(column - t.x_begin);
      const Floats centre = row_over_depth + t.over_depth.dx * in_box;
      Ints passed[kSamples];
      Ints any = {};
      for (int s = 0; s < kSamples; ++s) {
        float* const nearest = tile.over_depth + s * kTileTexels + row + x;
        const float offset = kSamples == 1 ? 0 : (t.over_depth.dx * kSampleX[s] + t.over_depth.dy * kSampleY[s]) / 16;
        const Floats over_depth = Clamp(centre + offset, least, most), old = Load(nearest);
        passed[s] = (column >= spans[s].begin[r]) & (column < spans[s].end[r]) & (over_depth > old);
        Store(nearest, passed[s] ? over_depth : old);
        any |= passed[s];
      }
      const uint32_t bits = BitsOf(any);
      if (bits == 0) continue;
      uint32_t colours[kLanes];
      Shade(t, texture, in_box, y, Clamp(centre, least, most), bits, colours);
      for (int s = 0; s < kSamples; ++s) {
        uint32_t* const pixels = tile.colours + s * kTileTexels + row + x;
        StoreInts(pixels, passed[s] ? LoadInts(colours) : LoadInts(pixels));
      }
    }
  }
}

void Average(const uint32_t* colours, int count, uint32_t* pixels) {
  const uint8_t* const from = reinterpret_cast<const uint8_t*>(colours);
  uint8_t* const to = reinterpret_cast<uint8_t*>(pixels);
  for (int i = 0; i < 4 * count; ++i) {
    uint16_t sum = kMostSamples / 2;
    for (int s = 0; s < kMostSamples; ++s) sum = static_cast<uint16_t>(sum + from[4 * s * kTileTexels + i]);
    to[i] = static_cast<uint8_t>(sum / kMostSamples);
  }
}

void Halve(const uint8_t* row0, const uint8_t* row1, int count, uint8_t* to) {
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 4; ++c) {
      const int left = 8 * i + c, right = left + 4;
      to[4 * i + c] = static_cast<uint8_t>((row0[left] + row0[right] + row1[left] + row1[right] + 2) / 4);
    }
  }
}

}  // namespace
}  // namespace likeness
