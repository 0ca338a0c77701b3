#include "likeness/decode/gl_plan.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/decode/half_float_impl.h"
#include "likeness/decode/layout.h"

namespace likeness {

namespace {

constexpr int kFewTiles = 64;  // a GPU has about as many processors: fewer tiles than that are made smaller

int DivideUp(int value, int step) { return (value + step - 1) / step; }
int RoundUpToFour(int value) { return DivideUp(value, 4) * 4; }

// Appends the weights transposed, [in, padded to fours][columns].
void AppendTransposed(const DenseLayer& layer, int columns, std::vector<float>* to) {
  const size_t begin = to->size();
  to->resize(begin + static_cast<size_t>(RoundUpToFour(layer.in)) * columns, 0.0f);
  for (int o = 0; o < layer.out; ++o) {
    for (int i = 0; i < layer.in; ++i) {
      (*to)[begin + static_cast<size_t>(i) * columns + o] = layer.weight[static_cast<size_t>(o) * layer.in + i];
    }
  }
}

// Texels of three values become ones of four, the last of which is always opaque.
DenseLayer WithOpacity(const DenseLayer& rgb) {
  DenseLayer rgba{rgb.in, rgb.out / 3 * 4, {}, {}, rgb.slope};
  rgba.weight.assign(static_cast<size_t>(rgba.out) * rgb.in, 0.0f);
  rgba.bias.assign(rgba.out, 255.0f);
  for (int o = 0; o < rgb.out; ++o) {
    const int to = o / 3 * 4 + o % 3;
    std::copy_n(rgb.weight.begin() + static_cast<ptrdiff_t>(o) * rgb.in, rgb.in,
                rgba.weight.begin() + static_cast<ptrdiff_t>(to) * rgb.in);
    rgba.bias[to] = rgb.bias[o];
  }
  return rgba;
}

// [texels, channels] with padded channels; of one texel where all are alike.
std::vector<float> BiasesOf(const DecoderNetwork& network, const ConvolutionLayer& layer, int channels) {
  const bool every = network.HasBiasForEveryTexel(layer), last = &layer == &network.layers.back();
  const int size = layer.out_size, rows = every ? size : 1, columns = every ? size : 1;
  std::vector<float> biases(static_cast<size_t>(rows) * columns * channels, 0.0f);
  std::vector<float> row(static_cast<size_t>(size) * layer.out);
  for (int y = 0; y < rows; ++y) {
    network.BiasRow(layer, y, row.data());
    for (int x = 0; x < columns; ++x) {
      float* const to = biases.data() + (static_cast<size_t>(y) * columns + x) * channels;
      std::copy_n(row.data() + static_cast<size_t>(x) * layer.out, layer.out, to);
      if (last) to[3] = 255;
    }
  }
  return biases;
}

void ChooseTile(GlConvolutionShape* shape) {
  const int columns = shape->columns();
  if (columns < kChannelMultiple) {  // colours of a convolution that keeps the size: four columns
    shape->tile_rows = 256;
    shape->tile_columns = columns;
    return;
  }
  shape->tile_columns = columns % 64 == 0 ? 64 : columns % 32 == 0 ? 32 : 16;
  const int tiles = DivideUp(shape->grid() * shape->grid(), shape->tile_rows) * (columns / shape->tile_columns);
  if (tiles < kFewTiles && shape->tile_columns == 64) shape->tile_rows = shape->tile_columns = 32;
}

}  // namespace

GlPlan::GlPlan(const GlFunctions& gl, const DecoderNetwork& network, const GlStorage& storage)
    : gl_(gl), storage_(storage), frame_(network) {
  if (!gl.AtLeast(4, 3)) {
    throw Error("decoding on a GPU needs OpenGL 4.3; this context ({}) has {}.{}", gl.renderer, gl.major_version,
                gl.minor_version);
  }
  while (gl.GetError() != GL_NO_ERROR) continue;  // of whoever used the context before
  gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most_bytes_);
  const Architecture& a = network.architecture;
  frame_buffer_ = NewBuffer(static_cast<int64_t>(frame_.values().size_bytes()), nullptr);
  vertices_ = NewBuffer(int64_t{4} * RoundUpToFour(network.mesh.out), nullptr);
  const GLenum format = storage.format == PixelFormat::kRgba8 ? GL_RGBA8 : GL_RGBA16F;
  for (GlTexture& texture : textures_) texture = MakeTexture(gl, format, a.texture_size, a.texture_size);

  GLuint features = frame_buffer_.id();  // of linear models: the code itself
  const auto plain = [](const DenseLayer& layer) {
    return GlResults{GlResults::Kind::kPlain, 1, RoundUpToFour(layer.out), layer.slope, -1};
  };
  if (!network.code.empty()) {
    code_features_ = NewBuffer(int64_t{4} * RoundUpToFour(network.code.out), nullptr);
    Pass& pass = passes_.emplace_back(DensePass(Pass::Kind::kCode, "code_fc", network.code, {}, plain(network.code)));
    pass.input = features;
    pass.results = features = code_features_.id();
  }
  Pass& mesh = passes_.emplace_back(DensePass(Pass::Kind::kMesh, "mesh_fc", network.mesh, {}, plain(network.mesh)));
  mesh.input = features;
  mesh.results = vertices_.id();
  if (!network.layers.empty()) {
    AddConvolutions(network, features);
  } else {
    const DenseLayer colours = WithOpacity(network.texels), none;
    const bool bilinear = a.model == ModelKind::kBilinear;
    passes_
        .emplace_back(DensePass(Pass::Kind::kTexture, "texture_fc", bilinear ? none : colours,
                                bilinear ? colours : none, {GlResults::Kind::kColours, a.texture_size, 4, 1, -1}))
        .input = features;
  }
  CheckGlErrors(gl, "preparing the decoder");
}

void GlPlan::AddConvolutions(const DecoderNetwork& network, GLuint features) {
  const int size = InnerSize(network.architecture);
  int64_t bytes[2] = {};
  for (size_t i = 0; i < network.layers.size(); ++i) {
    const ConvolutionLayer& layer = network.layers[i];
    const int64_t values = int64_t{kMostViews} * layer.in_size * layer.in_size * PaddedChannels(layer.in);
    bytes[i % 2] = std::max(bytes[i % 2], values * static_cast<int64_t>(ValueBytes()));
  }
  for (int i = 0; i < 2; ++i) {
    if (bytes[i] > 0) maps_[i] = NewBuffer(bytes[i], nullptr);
  }
  Pass& inner = passes_.emplace_back(
      DensePass(Pass::Kind::kTexture, "texture_fc", TexelMajor(network.inner, size * size),
                TexelMajor(network.inner_view, size * size), FeaturesFor(network, 0, network.inner.slope)));
  inner.input = features;
  inner.results = maps_[0].id();
  for (size_t i = 0; i < network.layers.size(); ++i) {
    Pass& pass = passes_.emplace_back(ConvolutionPass(network, i));
    pass.input = maps_[i % 2].id();
    pass.results = maps_[(i + 1) % 2].id();
  }
}

GlResults GlPlan::FeaturesFor(const DecoderNetwork& network, size_t next, float slope) const {
  const ConvolutionLayer& layer = network.layers[next];
  const int add_at = frame_.AddAt(next);
  return {GlResults::Kind::kFeatures, layer.in_size, PaddedChannels(layer.in), slope, add_at < 0 ? -1 : add_at / 4};
}

GlPlan::Pass GlPlan::DensePass(Pass::Kind kind, const std::string& name, const DenseLayer& shared,
                               const DenseLayer& of_view, const GlResults& results) {
  GlDenseShape shape;
  shape.shared_in = RoundUpToFour(shared.in);
  shape.view_in = RoundUpToFour(of_view.in);
  shape.view_in_at = frame_.view_at() / 4;
  shape.results = results;
  const int columns = 4 * shape.fours();
  std::vector<float> weights;
  AppendTransposed(shared, columns, &weights);
  AppendTransposed(of_view, columns, &weights);
  std::vector<float> bias = shared.empty() ? of_view.bias : shared.bias;
  bias.resize(columns, 0.0f);

  Pass pass;
  pass.kind = kind;
  pass.program = MakeProgram(gl_, name, {{GL_COMPUTE_SHADER, DenseShader(shape, storage_)}});
  pass.weights = Upload(weights, storage_.half);
  pass.biases = Upload(bias, false);
  pass.rows = shape.fours();
  pass.rows_at_once = GlDenseShape::kColumnsAtOnce;
  pass.cost = {name, 2.0 * shape.shared_in * columns, ValueBytes() * static_cast<double>(weights.size()), 4.0 * columns,
               4.0 * shape.shared_in};
  pass.cost_of_view.flops = 2.0 * shape.view_in * columns;
  if (results.kind == GlResults::Kind::kPlain) {
    pass.cost.feature_bytes += 4.0 * columns;
  } else {
    pass.cost_of_view.feature_bytes =
        4.0 * shape.view_in + (results.kind == GlResults::Kind::kColours ? PixelBytes() / 4 : ValueBytes()) * columns;
  }
  return pass;
}

GlPlan::Pass GlPlan::ConvolutionPass(const DecoderNetwork& network, size_t index) {
  const ConvolutionLayer& layer = network.layers[index];
  const bool last = index + 1 == network.layers.size();
  GlConvolutionShape shape;
  shape.up = layer.kind == ConvolutionLayer::Kind::kUp;
  shape.in_size = layer.in_size;
  shape.in_channels = PaddedChannels(layer.in);
  shape.every_texel = network.HasBiasForEveryTexel(layer);
  shape.results = last ? GlResults{GlResults::Kind::kColours, layer.out_size, 4, 1, -1}
                       : FeaturesFor(network, index + 1, layer.slope);
  ChooseTile(&shape);
  const std::string name = fmt::format("convolution {}", index);
  const std::vector<float> weights = GemmWeights(layer, shape.in_channels, shape.results.channels, shape.columns());
  const std::vector<float> biases = BiasesOf(network, layer, shape.results.channels);

  Pass pass;
  pass.convolution = true;
  pass.program = MakeProgram(gl_, name, {{GL_COMPUTE_SHADER, ConvolutionShader(shape, storage_)}});
  pass.weights = Upload(weights, storage_.half);
  pass.biases = Upload(biases, storage_.half);
  pass.groups_x = shape.columns() / shape.tile_columns;
  pass.rows_of_view = shape.grid() * shape.grid();
  pass.rows_at_once = shape.tile_rows;
  pass.cost = {name, 0, ValueBytes() * static_cast<double>(weights.size()),
               ValueBytes() * static_cast<double>(biases.size()), 0};
  const double texels = static_cast<double>(layer.out_size) * layer.out_size;
  pass.cost_of_view.flops = 2.0 * shape.depth() * shape.columns() * pass.rows_of_view;
  pass.cost_of_view.feature_bytes = ValueBytes() * layer.in_size * layer.in_size * shape.in_channels +
                                    texels * (last ? PixelBytes() : ValueBytes() * shape.results.channels);
  return pass;
}

GlBuffer GlPlan::NewBuffer(int64_t bytes, const void* data) {
  if (bytes > most_bytes_) {
    throw Error("decoding this avatar on a GPU takes a buffer of {} MB; OpenGL ({}) allows {} MB", bytes >> 20,
                gl_.renderer, most_bytes_ >> 20);
  }
  bytes_ += bytes;
  return MakeBuffer(gl_, static_cast<GLsizeiptr>(bytes), data, data != nullptr ? GL_STATIC_DRAW : GL_DYNAMIC_COPY);
}

GlBuffer GlPlan::Upload(std::span<const float> values, bool half) {
  if (!half) return NewBuffer(static_cast<int64_t>(values.size_bytes()), values.data());
  std::vector<uint16_t> halves(values.size());
  std::transform(values.begin(), values.end(), halves.begin(), HalfFloat);
  return NewBuffer(static_cast<int64_t>(2 * halves.size()), halves.data());
}

void GlPlan::Decode(std::span<const float> code, std::span<const std::array<float, 3>> directions, bool mesh) {
  frame_.Write(code, directions);
  gl_.BindBuffer(GL_COPY_WRITE_BUFFER, frame_buffer_.id());
  gl_.BufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(frame_.values().size_bytes()),
                    frame_.values().data());
  gl_.BindBuffer(GL_COPY_WRITE_BUFFER, 0);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, frame_buffer_.id());
  const int views = static_cast<int>(directions.size());
  const GLenum format = storage_.format == PixelFormat::kRgba8 ? GL_RGBA8 : GL_RGBA16F;
  for (int v = 0; v < kMostViews; ++v) {
    gl_.BindImageTexture(static_cast<GLuint>(v), textures_[v].id(), 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
  }
  // Whoever still draws the last frame reads it before it is overwritten.
  gl_.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  for (const Pass& pass : passes_) {
    if (pass.kind == Pass::Kind::kMesh && !mesh) continue;
    if (pass.kind == Pass::Kind::kTexture && views == 0) continue;
    Run(pass, pass.kind == Pass::Kind::kTexture ? views : 1);
    // Nothing here waits for the mesh.
    if (pass.kind != Pass::Kind::kMesh) gl_.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }
  gl_.UseProgram(0);
  gl_.MemoryBarrier(GL_ALL_BARRIER_BITS);
}

void GlPlan::Run(const Pass& pass, int views) const {
  gl_.UseProgram(pass.program.id());
  gl_.Uniform1i(0, views);
  if (pass.convolution) gl_.Uniform1i(1, 4);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, pass.input);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, pass.weights.id());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, pass.biases.id());
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 4, pass.results);
  const int groups = DivideUp(pass.rows + views * pass.rows_of_view, pass.rows_at_once);
  const int along_y = std::min(groups, kMostGlGroups);
  gl_.DispatchCompute(static_cast<GLuint>(pass.groups_x), static_cast<GLuint>(along_y),
                      static_cast<GLuint>(DivideUp(groups, along_y)));
}

std::vector<GlLayerCost> GlPlan::Costs(int views, bool mesh) const {
  std::vector<GlLayerCost> costs;
  for (const Pass& pass : passes_) {
    if (pass.kind == Pass::Kind::kMesh && !mesh) continue;
    if (pass.kind == Pass::Kind::kTexture && views == 0) continue;
    GlLayerCost& cost = costs.emplace_back(pass.cost);
    cost.flops += views * pass.cost_of_view.flops;
    cost.feature_bytes += views * pass.cost_of_view.feature_bytes;
  }
  return costs;
}

}  // namespace likeness
