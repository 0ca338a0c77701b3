#include "likeness/decode/gl_shaders.h"

#include <fmt/format.h>

namespace likeness {

namespace {

constexpr char kStorage[] = R"(
#ifdef HALF
#define FOUR uvec2
vec4 Unpack(uvec2 v) { return vec4(unpackHalf2x16(v.x), unpackHalf2x16(v.y)); }
uvec2 Pack(vec4 v) { return uvec2(packHalf2x16(v.xy), packHalf2x16(v.zw)); }
#else
#define FOUR vec4
vec4 Unpack(vec4 v) { return v; }
vec4 Pack(vec4 v) { return v; }
#endif

layout(location = 0) uniform int views;
layout(std430, binding = 1) readonly buffer Weights { FOUR weights[]; };
layout(std430, binding = 3) readonly buffer Frame { vec4 frame[]; };
)";

// Write: sums of four channels, the channel counted in fours.
constexpr char kResults[] = R"(
#ifdef COLOURS
layout(PIXELS, binding = 0) writeonly uniform image2D first_texture;
layout(PIXELS, binding = 1) writeonly uniform image2D second_texture;
void Write(int texel, int view, int channel, vec4 value) {
  ivec2 at = ivec2(texel % OUT_SIZE, texel / OUT_SIZE);
  if (view == 0) imageStore(first_texture, at, value / 255.0);
  else imageStore(second_texture, at, value / 255.0);
}
#else
#ifdef PLAIN
layout(std430, binding = 4) writeonly buffer Results { vec4 results[]; };
#define PACK(v) (v)
#else
layout(std430, binding = 4) writeonly buffer Results { FOUR results[]; };
#define PACK(v) Pack(v)
#endif
void Write(int texel, int view, int channel, vec4 value) {
  value = max(value, SLOPE * value);
#if ADD_AT >= 0
  value += frame[ADD_AT + view * OUT_FOURS + channel];
#endif
  results[(texel * views + view) * OUT_FOURS + channel] = PACK(value);
}
#endif

// The number of this work group, other than along x.
int Group() { return int(gl_WorkGroupID.z) * MOST_GROUPS + int(gl_WorkGroupID.y); }
)";

constexpr char kDense[] = R"(
layout(local_size_x = AT_ONCE, local_size_y = SHARES) in;
layout(std430, binding = 0) readonly buffer Input { vec4 shared_values[]; };
layout(std430, binding = 2) readonly buffer Biases { vec4 biases[]; };

shared vec4 parts[2][SHARES][AT_ONCE];

void main() {
  int x = int(gl_LocalInvocationID.x), share = int(gl_LocalInvocationID.y);
  int column = Group() * AT_ONCE + x;
  vec4 sums[2] = vec4[2](vec4(0.0), vec4(0.0));
  if (column < COLUMNS) {
    for (int i = share; i < SHARED_IN; i += SHARES) {
      vec4 v = shared_values[i];
      int at = 4 * i * COLUMNS + column;
      sums[0] += v.x * Unpack(weights[at]) + v.y * Unpack(weights[at + COLUMNS]) +
                 v.z * Unpack(weights[at + 2 * COLUMNS]) + v.w * Unpack(weights[at + 3 * COLUMNS]);
    }
    sums[1] = sums[0];
    for (int i = share; i < VIEW_IN; i += SHARES) {
      int at = 4 * (SHARED_IN + i) * COLUMNS + column;
      vec4 w0 = Unpack(weights[at]), w1 = Unpack(weights[at + COLUMNS]);
      vec4 w2 = Unpack(weights[at + 2 * COLUMNS]), w3 = Unpack(weights[at + 3 * COLUMNS]);
      for (int view = 0; view < views; ++view) {
        vec4 v = frame[VIEW_IN_AT + view * VIEW_IN + i];
        sums[view] += v.x * w0 + v.y * w1 + v.z * w2 + v.w * w3;
      }
    }
  }
  parts[0][share][x] = sums[0];
  parts[1][share][x] = sums[1];
  barrier();
  // A share for each view adds up all of them.
  if (share >= views || column >= COLUMNS) return;
  vec4 sum = biases[column];
  for (int i = 0; i < SHARES; ++i) sum += parts[share][i][x];
  Write(column / OUT_FOURS, share, column % OUT_FOURS, sum);
}
)";

constexpr char kConvolution[] = R"(
layout(local_size_x = THREADS) in;
layout(std430, binding = 0) readonly buffer Input { FOUR features[]; };
layout(std430, binding = 2) readonly buffer Biases { FOUR biases[]; };

// Always 4. A uniform, since drivers would unroll the loop over a constant: 64 multiplications in a row are enough for
// the GPU, and four times as many take the driver four times as long to compile.
layout(location = 1) uniform int fours_at_once;

// 16 of the depth at once, in fours. A row of inputs has a fifth four, which is empty, so that rows of one invocation
// after the other begin in different banks of the shared memory.
const int ROW = 5;
shared vec4 input_tile[TILE_ROWS * ROW];
shared vec4 weight_tile[16 * TILE_FOURS];

const int LOADS = (TILE_ROWS * 4 + THREADS - 1) / THREADS;

// Column and row in the grid of result rows, and view.
ivec3 PlaceOf(int row) {
  int position = row / views;
  return ivec3(position % GRID, position / GRID, row % views);
}

vec4 Feature(ivec3 place, ivec2 shift, int four) {
  ivec2 texel = place.xy + shift;
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, ivec2(IN_SIZE)))) return vec4(0.0);
  return Unpack(features[((texel.y * IN_SIZE + texel.x) * views + place.z) * IN_FOURS + four]);
}

void main() {
  int thread = int(gl_LocalInvocationIndex);
  int x = thread % TILE_FOURS, y = thread / TILE_FOURS;
  int first_column = int(gl_WorkGroupID.x) * TILE_FOURS, first_row = Group() * TILE_ROWS;
  ivec3 places[LOADS];
  for (int i = 0; i < LOADS; ++i) places[i] = PlaceOf(first_row + (thread + i * THREADS) / 4);

  vec4 sums[4] = vec4[4](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
  for (int part = 0; part < DEPTH / 16; ++part) {
    int tap = part / (IN_FOURS / 4), four = part % (IN_FOURS / 4) * 4;
    ivec2 shift = ivec2(tap % WINDOW, tap / WINDOW) - 1;
    for (int i = 0; i < LOADS; ++i) {
      int at = thread + i * THREADS;
      if (at < TILE_ROWS * 4) input_tile[at / 4 * ROW + at % 4] = Feature(places[i], shift, four + at % 4);
    }
    for (int at = thread; at < 16 * TILE_FOURS; at += THREADS) {
      weight_tile[at] = Unpack(weights[(part * 16 + at / TILE_FOURS) * COLUMNS + first_column + at % TILE_FOURS]);
    }
    barrier();
    for (int k = 0; k < fours_at_once; ++k) {
      vec4 w0 = weight_tile[4 * k * TILE_FOURS + x], w1 = weight_tile[(4 * k + 1) * TILE_FOURS + x];
      vec4 w2 = weight_tile[(4 * k + 2) * TILE_FOURS + x], w3 = weight_tile[(4 * k + 3) * TILE_FOURS + x];
      for (int r = 0; r < 4; ++r) {
        vec4 v = input_tile[(y + r * (TILE_ROWS / 4)) * ROW + k];
        sums[r] += v.x * w0 + v.y * w1 + v.z * w2 + v.w * w3;
      }
    }
    barrier();
  }

  int column = first_column + x, block = column / OUT_FOURS, channel = column % OUT_FOURS;
  ivec2 offset = ivec2(block % STEP, block / STEP) - (STEP - 1);
  for (int r = 0; r < 4; ++r) {
    int row = first_row + y + r * (TILE_ROWS / 4);
    if (row >= GRID * GRID * views) break;
    ivec3 place = PlaceOf(row);
    ivec2 texel = STEP * place.xy + offset;
    if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, ivec2(OUT_SIZE)))) continue;
    int at = texel.y * OUT_SIZE + texel.x;
    Write(at, place.z, channel, sums[r] + Unpack(biases[at * BIAS_FOURS + channel]));
  }
}
)";

class Source {
 public:
  Source(const GlResults& results, const GlStorage& storage) {
    if (storage.half) text_ += "#define HALF\n";
    if (results.kind == GlResults::Kind::kPlain) text_ += "#define PLAIN\n";
    if (results.kind == GlResults::Kind::kColours) text_ += "#define COLOURS\n";
    text_ += storage.format == PixelFormat::kRgba8 ? "#define PIXELS rgba8\n" : "#define PIXELS rgba16f\n";
    Define("MOST_GROUPS", kMostGlGroups);
    Define("OUT_SIZE", results.size);
    Define("OUT_FOURS", results.channels / 4);
    Define("ADD_AT", results.add_at);
    text_ += fmt::format("#define SLOPE {:.9e}\n", results.slope);
  }

  void Define(const char* name, int value) { text_ += fmt::format("#define {} ({})\n", name, value); }

  std::string Complete(const char* main) const { return text_ + kStorage + kResults + main; }

 private:
  std::string text_ = "#version 430 core\n";
};

}  // namespace

std::string DenseShader(const GlDenseShape& shape, const GlStorage& storage) {
  Source source(shape.results, storage);
  source.Define("AT_ONCE", GlDenseShape::kColumnsAtOnce);
  source.Define("SHARES", GlDenseShape::kShares);
  source.Define("COLUMNS", shape.fours());
  source.Define("SHARED_IN", shape.shared_in / 4);
  source.Define("VIEW_IN", shape.view_in / 4);
  source.Define("VIEW_IN_AT", shape.view_in_at);
  return source.Complete(kDense);
}

std::string ConvolutionShader(const GlConvolutionShape& shape, const GlStorage& storage) {
  Source source(shape.results, storage);
  source.Define("TILE_ROWS", shape.tile_rows);
  source.Define("TILE_FOURS", shape.tile_columns / 4);
  source.Define("THREADS", shape.tile_rows / 4 * (shape.tile_columns / 4));
  source.Define("COLUMNS", shape.columns() / 4);
  source.Define("DEPTH", shape.depth());
  source.Define("IN_SIZE", shape.in_size);
  source.Define("IN_FOURS", shape.in_channels / 4);
  source.Define("GRID", shape.grid());
  source.Define("WINDOW", shape.window());
  source.Define("STEP", shape.step());
  source.Define("BIAS_FOURS", shape.every_texel ? shape.results.channels / 4 : 0);
  return source.Complete(kConvolution);
}

}  // namespace likeness
